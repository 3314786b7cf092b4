"""Other thresholds from a result nearby: nearly what a run finds, in the whole and in parts."""

from dataclasses import astuple, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from photolin import follow as module
from photolin.analysis import Analysis, Options
from photolin.coefficients import relate_to_bases
from photolin.errors import Cancelled, DegenerateError, OptionError
from photolin.factorize import orthogonalize
from photolin.factors import OUTSIDE, Thresholds
from photolin.follow import (
    PIXELS,
    QUICK,
    SAMPLES,
    Ground,
    follow_thresholds,
    prepare_ground,
)
from photolin.label import label_images
from photolin.observations import Observations
from photolin.pipeline import analyze
from photolin.refine import refine_coefficients
from photolin.refit import refit_bases
from photolin.robust import THOROUGH, linearize_robustly
from photolin.sample import draw_sample
from photolin.saturation import find_white
from photolin.settle import settle_ties
from photolin.synthetic import render_scene

Array = np.ndarray
SCENE = render_scene("sphere_cone", size=(96, 128), images=10)
STACK = SCENE.stack
GROUND = prepare_ground(STACK)
NEAR = analyze(STACK, Options(T=0.05, Ts=0.02))
OTHER = Thresholds(0.1, 0.02)
REGION = np.s_[8:88, 4:124]
"""Rows and columns that are looked at alone."""


def follow(
    thresholds: Thresholds,
    near: Analysis = NEAR,
    ground: Ground = GROUND,
    threads: int | None = None,
) -> Analysis:
    return follow_thresholds(STACK.images, STACK.mask, ground, near, thresholds, threads=threads)


def part_of(rows: slice, columns: slice) -> tuple[Array, Array]:
    """Images and mask of some rows and columns."""
    images = np.ascontiguousarray(STACK.images[:, rows, columns])
    return images, np.ascontiguousarray(STACK.mask[rows, columns])


# What it finds


@pytest.mark.parametrize(
    ("T", "Ts"), [(0.016, 0.02), (0.03, 0.02), (0.3, 0.02), (0.05, 0.0), (0.05, 0.1)]
)
def test_labels_are_nearly_all_those_of_a_run(T: float, Ts: float) -> None:
    run = analyze(STACK, Options(T=T, Ts=Ts))
    agree = (follow(Thresholds(T, Ts)).labels == run.labels).mean()
    assert agree > 0.995
    assert agree > (NEAR.labels == run.labels).mean() + 0.005


def test_steps_of_a_slider_add_up_to_no_drift() -> None:
    """Each is followed from the one before, as far as coefficients go."""
    near = NEAR
    for T in np.linspace(0.05, 0.2, 8):
        near = follow(Thresholds(float(T), 0.02), near)
    run = analyze(STACK, Options(T=0.2, Ts=0.02))
    assert (near.labels == run.labels).mean() > 0.995
    np.testing.assert_allclose(near.coefficients, run.coefficients, atol=1e-3)


def test_coefficients_are_refined_and_not_only_kept() -> None:
    """They have to recover from a start that is a little off."""
    more = np.random.default_rng(0).normal(0, 0.01, NEAR.coefficients.shape)
    off = relate_to_bases(NEAR.coefficients + more, NEAR.base_images)
    found = follow(OTHER, replace(NEAR, coefficients=off))
    before, after = (np.abs(c - NEAR.coefficients).max() for c in (off, found.coefficients))
    assert before > 0.01
    assert after < before / 4


def test_base_images_keep_unit_rows_and_bases_are_their_linearized_images() -> None:
    found = follow(OTHER)
    assert found.base_images == NEAR.base_images
    np.testing.assert_array_equal(found.coefficients[list(NEAR.base_images)], np.eye(3))
    truth = SCENE.truth.ideal[list(NEAR.base_images)]
    assert np.nanquantile(np.abs(found.linearized_bases - truth), 0.8) < 1e-3


def test_labels_are_those_of_the_rule_by_its_own_bases() -> None:
    found = follow(OTHER)
    expected = label_images(
        STACK.images, found.linearized_bases, found.coefficients, STACK.mask, OTHER
    )
    np.testing.assert_array_equal(found.labels, expected)


def test_known_lights_keep_the_coefficients() -> None:
    known = replace(STACK, lights=SCENE.truth.lights)
    ground = prepare_ground(known)
    near = analyze(known, Options(T=0.05, Ts=0.02))
    found = follow(OTHER, near, ground)
    np.testing.assert_array_equal(found.coefficients, near.coefficients)
    assert found.lights is ground.lights is known.lights
    run = analyze(known, Options(T=OTHER.T, Ts=OTHER.Ts))
    assert (found.labels == run.labels).mean() > 0.995


def test_it_tells_what_it_was_asked_and_how_long_it_took() -> None:
    near = replace(NEAR, title="a title", files=(("a.png", "0"),))
    found = follow(OTHER, near)
    assert found.thresholds == OTHER
    assert found.options == Options(T=OTHER.T, Ts=OTHER.Ts)
    assert found.options.samples > SAMPLES
    assert (found.title, found.files, found.names) == ("a title", near.files, STACK.names)
    assert set(found.seconds) == {"follow", "total"}
    assert found.seconds["follow"] == found.seconds["total"] > 0
    assert found.confidence is None


def test_the_ground_is_a_sample_without_saturated_observations() -> None:
    images = np.minimum(STACK.images, 0.5)
    clipped = replace(STACK, images=images)
    ground, white = prepare_ground(clipped, seed=3), find_white(clipped)
    np.testing.assert_array_equal(ground.white, white)
    expected = draw_sample(clipped, 3, white, PIXELS)
    np.testing.assert_array_equal(ground.sample.images, expected.images)
    assert ground.sample.images.shape == (10, PIXELS)
    assert ground.sample.images.max() < 0.5 == images.max()
    assert ground.lights is None


# Laws


def test_threads_do_not_change_a_bit() -> None:
    expected = follow(OTHER, threads=1)
    for threads in (2, 3, None):
        found = follow(OTHER, threads=threads)
        np.testing.assert_array_equal(found.coefficients, expected.coefficients)
        np.testing.assert_array_equal(found.linearized_bases, expected.linearized_bases)
        np.testing.assert_array_equal(found.labels, expected.labels)


@pytest.mark.parametrize("step", [1, 2])
def test_a_part_is_nearly_what_the_whole_is_there(step: int) -> None:
    rows, columns = (slice(s.start, s.stop, step) for s in REGION)
    found = follow_thresholds(*part_of(rows, columns), GROUND, NEAR, OTHER)
    whole = follow(OTHER)
    np.testing.assert_array_equal(found.coefficients, whole.coefficients)
    l, expected = (
        np.tensordot(whole.coefficients, bases, 1)
        for bases in (found.linearized_bases, whole.linearized_bases[:, rows, columns])
    )
    assert np.nanquantile(np.abs(l - expected), 0.95) < 0.002
    np.testing.assert_array_equal(np.isnan(l), np.isnan(expected))
    assert (found.labels == whole.labels[:, rows, columns]).mean() > 0.99
    assert found.mask.shape == found.labels.shape[1:] == l.shape[1:]


@pytest.mark.parametrize("part", [np.s_[:1, :1], np.s_[40:41, :], np.s_[:, 60:61]])
def test_a_part_of_one_line_or_pixel_is_followed(part: tuple[slice, slice]) -> None:
    found = follow_thresholds(*part_of(*part), GROUND, NEAR, OTHER)
    assert (found.labels == follow(OTHER).labels[:, *part]).mean() > 0.9


@pytest.mark.parametrize("inside", [0, 1, 500])
def test_a_part_with_little_or_nothing_in_the_mask_is_followed(inside: int) -> None:
    """As is seen when zoomed in beside the object."""
    mask = np.zeros(STACK.mask.shape, bool)
    mask.reshape(-1)[5000 : 5000 + inside] = True
    found = follow_thresholds(STACK.images, mask, GROUND, NEAR, OTHER)
    assert (found.labels[:, ~mask] == OUTSIDE).all()
    assert (found.labels[:, mask] != OUTSIDE).all()
    assert (found.linearized_bases[:, ~mask] == 0).all()
    lit = (STACK.images >= OTHER.Ts).sum(axis=0)
    np.testing.assert_array_equal(found.determined(), mask & (lit >= 3))


# Fewer rounds and sweeps


@pytest.mark.parametrize("rounds", [1, 2])
def test_coefficients_nearly_right_take_as_few_rounds_as_asked_for(rounds: int) -> None:
    """The last round is on the whole sample, at the width of the noise."""
    asked: list[int] = []
    known = (GROUND.sample, NEAR.coefficients, OTHER.Ts, 0, SAMPLES)
    found = refine_coefficients(*known, lambda: bool(asked.append(1)), rounds)
    assert len(asked) == rounds
    assert found.bases.shape == (3, PIXELS)
    np.testing.assert_allclose(
        relate_to_bases(found.coefficients, NEAR.base_images), NEAR.coefficients, atol=2e-3
    )


def observations() -> tuple[Observations, Array]:
    """Those of the scene with noise, and bases of each pixel by itself that hold highlights."""
    factors = np.ascontiguousarray(orthogonalize(SCENE.truth.lights).T, np.float32)
    more = np.random.default_rng(0).normal(0, 0.002, STACK.images.shape)
    images = np.clip(STACK.images + more, 0, 1).astype(np.float32)
    seen = Observations(images, STACK.mask, factors, GROUND.white, 0.02, 0.003, 0.9)
    bases = np.linalg.lstsq(factors.T, SCENE.truth.ideal.reshape(10, -1))[0] * 1.01
    return seen, bases.reshape(3, *STACK.mask.shape).astype(np.float32)


def test_pixels_are_refitted_in_as_many_rounds_as_asked_for() -> None:
    seen, bases = observations()
    np.testing.assert_array_equal(refit_bases(seen, bases, rounds=0), bases)
    found = []
    for rounds in (1, 2, 3, 5):
        told: list[float] = []
        tell = lambda stage, done, told=told: told.append(done)  # noqa: E731
        found.append(refit_bases(seen, bases, progress=tell, rounds=rounds))
        assert told == [(n + 1) / rounds for n in range(rounds)]
    assert all((one != other).any() for one, other in pairwise(found))


def test_ties_are_settled_in_as_many_sweeps_as_asked_for() -> None:
    """Two pixels a sweep: of an undecided band of eight columns, two from each side."""
    seen, bases = observations()
    seen.images[3:, :, 60:68] = 0
    undecided = np.zeros(STACK.mask.shape, bool)
    undecided[:, 60:68] = True
    start = np.where(undecided, bases[[1, 0, 2]], bases)
    among = np.flatnonzero(undecided)
    known = (among.astype(np.int32) * 0, None, None, among)
    found = [settle_ties(seen, start.copy(), *known, sweeps) for sweeps in range(3)]
    changed = [np.flatnonzero((one != start).any(axis=(0, 1))).tolist() for one in found]
    assert changed == [[], [60, 61, 66, 67], [*range(60, 68)]]


def test_what_makes_it_quick_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[object, ...]] = []

    def spy(*known: Any) -> tuple[Array, Array]:
        asked.append((known[4].samples, *known[7:]))
        return linearize_robustly(*known)

    monkeypatch.setattr(module, "linearize_robustly", spy)
    follow(OTHER)
    follow(OTHER, replace(NEAR, options=replace(NEAR.options, samples=12)))
    assert asked == [(SAMPLES, QUICK), (12, QUICK)]
    less, more = astuple(QUICK), astuple(THOROUGH)
    assert all(a < b for a, b in zip(less, more, strict=True))


# Refusals


def test_a_result_of_another_method_or_stack_is_refused() -> None:
    other = replace(NEAR, options=replace(NEAR.options, method="statistical"))
    with pytest.raises(OptionError) as caught:
        follow(OTHER, other)
    assert str(caught.value) == (
        "a result by statistical of 10 images cannot be followed for 10; "
        "one by robust of the same images is accepted"
    )
    few = replace(NEAR, coefficients=NEAR.coefficients[:9])
    with pytest.raises(OptionError, match=r"^a result by robust of 9 images .* for 10; one by"):
        follow(OTHER, few)


@pytest.mark.parametrize("Ts", [0.9, 0.999])
def test_thresholds_that_leave_nothing_lit_determine_nothing(Ts: float) -> None:
    with pytest.raises(DegenerateError, match="lower Ts"):
        follow(Thresholds(0.05, Ts))


def test_it_can_be_cancelled_at_any_time() -> None:
    known = (STACK.images, STACK.mask, GROUND, NEAR, OTHER)
    asked: list[int] = []
    follow_thresholds(*known, threads=1, cancel=lambda: bool(asked.append(1)))
    times = len(asked)
    assert times > 20
    stages = set()
    for after in (*range(0, times, times // 8), times - 1):
        left = [False] * after
        with pytest.raises(Cancelled, match=r"^(coefficients|linearize) was cancelled$") as caught:
            follow_thresholds(
                *known, threads=1, cancel=lambda left=left: left.pop() if left else True
            )
        stages.add(str(caught.value))
    assert len(stages) == 2
