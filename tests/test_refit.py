"""The last fit with neighbours: what it removes, what it leaves as it is, and its symmetries."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lambert import lambertian

from photolin import refit as module
from photolin.errors import Cancelled
from photolin.factorize import orthogonalize
from photolin.observations import Observations
from photolin.refit import measure_means, refit_bases

f32 = np.float32
Array = np.ndarray
Known = tuple[Observations, Array]
K, BRIGHT = 20, 0.9


def relief(
    noise: float, size: tuple[int, int] = (50, 70), more: Array | float = 0.0, seed: int = 0
) -> tuple[Observations, Array, Array]:
    """Observations with `more` light in them, plain least squares of them and of the truth."""
    stack, lights = lambertian(K, size, seed)
    around = np.random.default_rng(seed + 1).normal(0, noise, stack.shape)
    images = (stack.images + more + around).astype(f32)
    factors = np.ascontiguousarray(orthogonalize(lights).T, f32)
    white = np.full(K, np.inf, f32)
    # LEAST_NOISE of linearize
    level = noise + 6e-4 * BRIGHT
    seen = Observations(images, stack.mask, factors, white, 0.01, level, BRIGHT)
    return seen, least_squares(factors, images), least_squares(factors, stack.images)


def least_squares(factors: Array, images: Array) -> Array:
    return (np.tensordot(factors, images, 1) * 3 / K).astype(f32)


def error(seen: Observations, bases: Array, truth: Array) -> Array:
    """(K,H,W) of the linearized images."""
    return np.tensordot(seen.factors.T, bases - truth, 1)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values, dtype=float))))


def blobs(light: float, size: tuple[int, int]) -> tuple[Array, Array]:
    """Light (K,H,W) in squares of 10 x 10 pixels, each in four images, and where they are."""
    rng = np.random.default_rng(0)
    more = np.zeros((K, *size))
    for top in range(10, size[0] - 10, 20):
        for left in range(10, size[1] - 10, 20):
            more[rng.permutation(K)[:4], top : top + 10, left : left + 10] = light
    return more, (more > 0).any(axis=0)


def mixed(seed: int = 0) -> Known:
    """Noise, wide highlights, shadows, a saturated image, an unknown pixel, a mask."""
    more, _ = blobs(0.02, (50, 70))
    seen, bases, _ = relief(0.01, more=more, seed=seed)
    rng = np.random.default_rng(seed)
    seen.images[rng.random(seen.images.shape) < 0.05] = 0
    white, mask = seen.white.copy(), seen.mask.copy()
    white[3], mask[20:30, :15] = 0.6, False
    bases[:, 40, 50] = np.nan
    return replace(seen, white=white, mask=mask), bases


# What it removes


@pytest.mark.parametrize(("light", "left"), [(0.5, 0.8), (1, 0.35), (2, 0.06), (6, 0.03)])
def test_highlights_as_faint_as_the_noise_no_longer_pull_the_fit(light: float, left: float) -> None:
    """In units of the noise; those of half the noise are at the limit of what 25 pixels show."""
    more, inside = blobs(0.005 * light, (90, 90))
    seen, plain, truth = relief(0.005, (90, 90), more)
    before, after = (error(seen, b, truth) for b in (plain, refit_bases(seen, plain)))
    assert before[:, inside].mean() > 0.19 * light * 0.005
    assert abs(after[:, inside].mean()) < left * before[:, inside].mean()
    assert rms(after[:, ~inside]) < 1.05 * rms(before[:, ~inside])


def test_without_noise_highlights_of_a_third_of_a_percent_are_removed() -> None:
    more, inside = blobs(0.003, (50, 70))
    seen, plain, truth = relief(0.0, more=more)
    before, after = (error(seen, b, truth) for b in (plain, refit_bases(seen, plain)))
    assert abs(after[:, inside].mean()) < 0.1 * before[:, inside].mean()


@pytest.mark.parametrize("excess", [0.07, -0.035])
def test_single_observations_far_from_the_fit_have_no_say(excess: float) -> None:
    more = np.where(np.random.default_rng(0).random((K, 50, 70)) < 0.02, excess, 0)
    seen, plain, truth = relief(0.001, more=more)
    before, after = (error(seen, b, truth) for b in (plain, refit_bases(seen, plain)))
    assert rms(after) < 0.5 * rms(before)
    assert rms(after) < 0.0006


@pytest.mark.parametrize("factor", [1.01, 0.97])
def test_bases_that_start_a_little_off_come_to_the_truth(factor: float) -> None:
    seen, plain, truth = relief(0.0)
    out = refit_bases(seen, plain * f32(factor))
    assert rms(error(seen, plain * factor, truth)) > 0.004
    assert rms(error(seen, out, truth)) < 1e-5


# What it leaves


def test_exactly_diffuse_pixels_stay_where_they_are() -> None:
    seen, bases, _ = relief(0.0)
    given = bases.copy()
    np.testing.assert_allclose(refit_bases(seen, bases), given, atol=1e-6)
    np.testing.assert_array_equal(bases, given)


@pytest.mark.parametrize("noise", [0.002, 0.01, 0.05])
def test_noise_alone_is_fitted_as_well_as_by_least_squares(noise: float) -> None:
    seen, plain, truth = relief(noise)
    seen = replace(seen, Ts=-1.0)
    before, after = (error(seen, b, truth) for b in (plain, refit_bases(seen, plain)))
    assert rms(after) < 1.15 * rms(before)
    assert abs(after.mean()) < 0.03 * noise


def test_outside_the_mask_and_where_nothing_is_known_bases_stay_as_they_are() -> None:
    seen, bases = mixed()
    bases[:, ~seen.mask] = np.arange(3)[:, None]
    out = refit_bases(seen, bases)
    assert out.dtype == f32
    np.testing.assert_array_equal(np.isnan(out), np.isnan(bases))
    np.testing.assert_array_equal(out[:, ~seen.mask], bases[:, ~seen.mask])
    # an unknown pixel is to its neighbours what one outside the mask is
    mask = seen.mask & np.isfinite(bases[0])
    known = np.where(mask, bases, 0)
    np.testing.assert_array_equal(
        refit_bases(replace(seen, mask=mask), known)[:, mask], out[:, mask]
    )


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (7, 1), (3, 3), (4, 40)])
def test_pictures_smaller_than_a_window_are_fitted(size: tuple[int, int]) -> None:
    seen, plain, truth = relief(0.01, size)
    assert rms(error(seen, refit_bases(seen, plain), truth)) < 0.01
    nothing = replace(seen, mask=np.zeros(size, bool))
    np.testing.assert_array_equal(refit_bases(nothing, plain), plain)


# The noise of means


@pytest.mark.parametrize("lit", [1.0, 0.7])
def test_means_of_25_vary_by_a_fifth_of_the_noise(lit: float) -> None:
    """As residuals of fits with three unknowns do; fewer lit ones are scaled to 25."""
    seen, plain, _ = relief(0.01, (90, 120))
    mask = np.zeros(seen.mask.shape, bool)
    mask[8:-8, 8:-8] = True
    rng = np.random.default_rng(0)
    seen.images[rng.random(seen.images.shape) > lit] = 0
    expected = 0.01 / 5 * np.sqrt(1 - 3 / K)
    assert measure_means(seen, mask, 0.05, plain) == pytest.approx(expected, rel=0.05)


def test_highlights_are_no_noise_of_means() -> None:
    more, _ = blobs(0.04, (90, 120))
    seen, _, truth = relief(0.01, (90, 120), more)
    assert measure_means(seen, seen.mask, 0.05, truth) == pytest.approx(0.002, rel=0.15)


# Symmetries


def test_threads_do_not_change_a_bit() -> None:
    seen, bases = mixed()
    expected = refit_bases(seen, bases, threads=1)
    for threads in (2, 3):
        np.testing.assert_array_equal(refit_bases(seen, bases, threads), expected)


@pytest.mark.parametrize("factor", [0.25, 8])
def test_everything_scales_with_the_light_exactly(factor: float) -> None:
    """A power of two changes no rounding."""
    seen, bases = mixed()
    names = ("images", "white", "Ts", "noise", "bright")
    scaled: dict[str, Any] = {name: getattr(seen, name) * factor for name in names}
    expected = refit_bases(seen, bases) * f32(factor)
    out = refit_bases(replace(seen, **scaled), bases * f32(factor))
    np.testing.assert_array_equal(out, expected)


@pytest.mark.parametrize("turn", [np.flip, np.swapaxes, np.flipud, np.fliplr])
def test_a_turned_picture_gives_the_turned_result(turn: Any) -> None:
    """But for the noise of means, measured in other squares."""

    def turned(a: Array) -> Array:
        args = {np.flip: ((-1, -2),), np.swapaxes: (-1, -2)}.get(turn, ())
        return np.ascontiguousarray(turn(a, *args) if args else np.flip(a, AXES[turn]))

    seen, bases = mixed()
    other = replace(seen, images=turned(seen.images), mask=turned(seen.mask))
    out, expected = refit_bases(other, turned(bases)), turned(refit_bases(seen, bases))
    assert rms(np.nan_to_num(out - expected)) < 0.1 * seen.noise


def test_the_order_of_images_changes_nothing_but_rounding() -> None:
    seen, bases = mixed()
    order = np.random.default_rng(2).permutation(K)
    factors = np.ascontiguousarray(seen.factors[:, order])
    other = replace(seen, images=seen.images[order], factors=factors, white=seen.white[order])
    out = refit_bases(other, bases)
    np.testing.assert_allclose(out, refit_bases(seen, bases), atol=1e-5)


# Tiles
