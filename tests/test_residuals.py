"""What is left below the fit: exactly the lit observations there, and the T of their noise."""

from dataclasses import replace

import numpy as np
import pytest

from photolin import Options, analyze, render_scene
from photolin.residuals import measure_residuals

SCENE = render_scene("sphere_cone", size=(60, 80), images=10, noise=0.01, bits=8)
RESULT = analyze(SCENE.stack)


def test_residuals_are_of_lit_observations_below_the_fit() -> None:
    a, Ts = RESULT, RESULT.thresholds.Ts
    found = measure_residuals(SCENE.stack, a, Ts, most=10**9).values
    l = np.stack([a.linearized(k) for k in range(10)])[:, a.determined()]
    i = SCENE.stack.images[:, a.determined()]
    below = (i >= Ts) & (l > i)
    expected = (l - i)[below] / i[below]
    # what is equal but for rounding is counted or not, by how a machine adds
    sure = np.count_nonzero(expected > 1e-5)
    assert abs(len(found) - len(expected)) <= len(expected) - sure
    np.testing.assert_allclose(np.sort(found)[-sure:], np.sort(expected)[-sure:], atol=1e-5)
    few = measure_residuals(SCENE.stack, a, Ts, most=5000).values
    assert 100 < few.size < found.size
    assert np.median(few) == pytest.approx(np.median(found), rel=0.2)


def test_the_share_that_passes_is_counted_and_grows_with_T() -> None:
    found = measure_residuals(SCENE.stack, RESULT, RESULT.thresholds.Ts)
    shares = [found.passed(T) for T in (1e-6, 0.01, 0.03, 0.1, 1e6)]
    assert shares == sorted(shares)
    assert shares[0] < 0.01
    assert shares[-1] == 1
    assert found.passed(float(np.median(found.values))) == pytest.approx(0.5, abs=0.01)


def test_T_is_about_the_suggested_one_and_follows_the_noise() -> None:
    found = measure_residuals(SCENE.stack, RESULT, RESULT.thresholds.Ts)
    assert pytest.approx(RESULT.thresholds.T, rel=0.2) == found.T
    quiet = render_scene("sphere_cone", size=(60, 80), images=10, noise=0.004, bits=16)
    less = measure_residuals(quiet.stack, analyze(quiet.stack), RESULT.thresholds.Ts)
    assert less.T < 0.8 * found.T


def test_T_does_not_depend_on_the_T_that_is_set() -> None:
    given = [analyze(SCENE.stack, Options(T=T, Ts=0.03)) for T in (0.02, 0.08)]
    one, two = (measure_residuals(SCENE.stack, a, 0.03).T for a in given)
    assert one == pytest.approx(two, rel=0.15)


@pytest.mark.parametrize("Ts", [0.0, 0.999])
def test_extremes_of_Ts_give_a_T_that_can_be_set(Ts: float) -> None:
    found = measure_residuals(SCENE.stack, RESULT, Ts)
    assert np.isfinite(found.values).all()
    assert 0 < found.T <= 1
    assert np.isnan(found.passed(0.1)) == (found.values.size == 0)


def test_nothing_determined_leaves_no_residuals() -> None:
    bases = np.full_like(RESULT.linearized_bases, np.nan)
    found = measure_residuals(SCENE.stack, replace(RESULT, linearized_bases=bases), 0.03)
    assert found.values.size == 0
    assert 0 < found.T <= 1
