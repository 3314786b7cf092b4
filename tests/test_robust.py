"""Step 2 of `robust` on a rendered scene, by looking at every pixel and from a thinned-out picture.

The scene has 300 x 300 pixels; `COARSE_PIXELS` says which of the two is done.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from photolin import fine, render_scene
from photolin.analysis import Options
from photolin.errors import Cancelled
from photolin.factors import Thresholds
from photolin.robust import Quality, Talk, linearize_robustly
from photolin.synthetic import Scene

Array = np.ndarray
K, SIZE = 12, (300, 300)
EVERY, THINNED = 10**9, 5000
"""The latter is one pixel of 4 x 4."""
THRESHOLDS = Thresholds(0.02, 0.01)
both_ways = pytest.mark.parametrize("coarse", [EVERY, THINNED], ids=["every pixel", "thinned out"])


@cache
def scene() -> Scene:
    return render_scene("sphere_cone", size=SIZE, images=K)


def coefficients() -> Array:
    lights = scene().truth.lights
    return lights @ np.linalg.inv(lights[[0, 4, 8]])


Linearize = Callable[..., tuple[Array, Array]]


@pytest.fixture
def linearize(monkeypatch: pytest.MonkeyPatch) -> Linearize:
    """Bases and margins of the scene or of other images, with about so many pixels looked at."""

    def run(
        coarse: int,
        talk: Talk | None = None,
        images: Array | None = None,
        mask: Array | None = None,
        thresholds: Thresholds = THRESHOLDS,
        noise: float = 0.0,
    ) -> tuple[Array, Array]:
        monkeypatch.setattr(fine, "COARSE_PIXELS", coarse)
        images = scene().stack.images if images is None else images
        mask = np.ones(images.shape[1:], bool) if mask is None else mask
        quality = Quality(np.full(K, np.inf, np.float32), noise)
        known = (coefficients(), thresholds, Options(), quality)
        return linearize_robustly(images, mask, *known, talk or Talk())

    return run


def errors(bases: Array, where: Array | bool = True) -> Array:
    """Of the linearized images of what is determined, fractions of full scale."""
    some = np.isfinite(bases[0]) & where
    ideal = scene().truth.ideal[:, some]
    return np.abs(np.tensordot(coefficients(), bases[:, some], 1) - ideal).reshape(-1)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values, dtype=float))))


# What it finds


def test_a_thinned_out_picture_shows_as_much_as_every_pixel(linearize: Linearize) -> None:
    """Rms is that of pixels lit in three or four images, where either way fails by chance."""
    every, thinned = (errors(linearize(coarse)[0]) for coarse in (EVERY, THINNED))
    assert len(every) == len(thinned)
    assert rms(every) < 0.009
    assert abs(rms(thinned) - rms(every)) < 0.0005
    (median, p99), (other, thinned_p99) = (np.quantile(e, [0.5, 0.99]) for e in (every, thinned))
    assert max(median, other) < 5e-6
    assert p99 < 0.0016
    assert abs(thinned_p99 - p99) < 0.0006


def test_most_pixels_are_the_same_either_way(linearize: Linearize) -> None:
    every, thinned = (linearize(coarse)[0] for coarse in (EVERY, THINNED))
    assert (every != thinned).any()
    apart = np.abs(np.tensordot(coefficients(), every - thinned, 1)).max(axis=0)
    assert np.nanquantile(apart, 0.9) < 1e-4
    assert np.nanquantile(apart, 0.98) < 0.005


@both_ways
def test_what_is_lit_too_rarely_is_undetermined_and_nothing_else(
    coarse: int, linearize: Linearize
) -> None:
    bases, margin = linearize(coarse)
    lit = (scene().stack.images >= 0.01).sum(axis=0)
    unknown = np.isnan(bases)
    assert (unknown == unknown[0]).all()
    assert unknown[0].sum() > 5
    np.testing.assert_array_equal(unknown[0], lit < 3)
    assert np.isfinite(bases[:, ~unknown[0]]).all()
    assert (bases.dtype, bases.shape) == (np.float32, (3, *SIZE))
    assert (margin.dtype, margin.shape) == (np.int32, (SIZE[0] * SIZE[1],))


@both_ways
def test_margins_are_positive_but_for_ties_and_what_is_undetermined(
    coarse: int, linearize: Linearize
) -> None:
    """What is D in all images leads by twice their number."""
    bases, margin = linearize(coarse)
    known = np.isfinite(bases[0]).reshape(-1)
    assert margin.min() == 0
    assert margin.max() == 2 * K
    assert (margin[~known] == 0).all()
    assert (margin[known] > 0).mean() > 0.999


def test_with_noise_too_a_thinned_out_picture_shows_as_much(linearize: Linearize) -> None:
    noise = 0.005
    images = scene().stack.images
    more = np.random.default_rng(0).normal(0, noise, images.shape)
    images = np.clip(images + more, 0, 1).astype(np.float32)
    every, thinned = (
        errors(linearize(coarse, None, images, None, Thresholds(0.05, 0.02), noise)[0])
        for coarse in (EVERY, THINNED)
    )
    # of 12 images three unknowns are found
    assert rms(np.sort(every)[: len(every) * 9 // 10]) < noise / 2
    for share in (0.5, 0.9):
        expected = np.quantile(every, share)
        assert np.quantile(thinned, share) == pytest.approx(expected, rel=0.1)


# Laws


@both_ways
def test_threads_do_not_change_a_bit(coarse: int, linearize: Linearize) -> None:
    expected = linearize(coarse, Talk(threads=1))
    for threads in (2, 3):
        for found, right in zip(linearize(coarse, Talk(threads)), expected, strict=True):
            np.testing.assert_array_equal(found, right)


@both_ways
def test_outside_the_mask_all_is_zero_and_of_no_influence(
    coarse: int, linearize: Linearize
) -> None:
    """A round object with a hole, and single pixels that are left out."""
    i, j = np.indices(SIZE) - 150
    away = np.hypot(i, j)
    mask = (away < 140) & (away > 20) & (np.random.default_rng(0).random(SIZE) > 0.1)
    found = linearize(coarse, mask=mask)
    assert (found[0][:, ~mask] == 0).all()
    assert len(found[1]) == mask.sum()
    assert rms(errors(found[0], mask)) < 0.012
    junk = np.random.default_rng(1).random((K, *SIZE)).astype(np.float32)
    other = linearize(coarse, images=np.where(mask, scene().stack.images, junk), mask=mask)
    for one, same in zip(other, found, strict=True):
        np.testing.assert_array_equal(one, same)


@pytest.mark.parametrize("coarse", [EVERY, 40])
@pytest.mark.parametrize("shape", [(1, 300), (300, 1), (7, 90)])
def test_narrow_pictures_are_linearized(
    coarse: int, shape: tuple[int, int], linearize: Linearize
) -> None:
    rows, columns = (slice(150, 150 + size) if size < 300 else slice(300) for size in shape)
    part = np.ascontiguousarray(scene().stack.images[:, rows, columns])
    bases, margin = linearize(coarse, images=part)
    assert len(margin) == shape[0] * shape[1]
    l = np.tensordot(coefficients(), bases, 1)
    ideal = scene().truth.ideal[:, rows, columns]
    assert np.nanmedian(np.abs(l - ideal)) < 1e-4


# Progress and cancellation


@both_ways
@pytest.mark.parametrize("threads", [1, 2])
def test_progress_rises_from_nothing_to_one_once(
    coarse: int, threads: int, linearize: Linearize
) -> None:
    told: list[tuple[str, float]] = []
    linearize(coarse, Talk(threads, lambda stage, done: told.append((stage, done))))
    assert {stage for stage, _ in told} == {"linearize"}
    shares = [0, *(done for _, done in told)]
    assert len(shares) > 10
    assert (np.diff(shares) > 0).all()
    assert shares[-1] == pytest.approx(1, abs=1e-12)


@both_ways
def test_it_can_be_cancelled_at_any_time(coarse: int, linearize: Linearize) -> None:
    """With one thread it is asked equally often each time."""
    asked: list[int] = []
    linearize(coarse, Talk(1, cancel=lambda: bool(asked.append(1))))
    times = len(asked)
    assert times > 30
    for after in (*range(0, times, times // 12), times - 1):
        left = [False] * after
        talk = Talk(1, cancel=lambda left=left: left.pop() if left else True)
        with pytest.raises(Cancelled, match=r"^linearize was cancelled$"):
            linearize(coarse, talk)


# A small object in a large picture


@both_ways
@pytest.mark.parametrize("place", [(0, 0), (70, 330), (400, 500)])
def test_a_small_object_is_linearized_as_if_the_picture_ended_at_its_rectangle(
    linearize: Linearize, coarse: int, place: tuple[int, int]
) -> None:
    row, column = place
    images = np.zeros((K, 700, 800), np.float32)
    images[:, row : row + 300, column : column + 300] = scene().stack.images
    mask = np.zeros((700, 800), bool)
    mask[row : row + 300, column : column + 300] = True
    bases, lead = linearize(coarse, images=images, mask=mask)
    alone, alone_lead = linearize(coarse)
    np.testing.assert_array_equal(bases[:, row : row + 300, column : column + 300], alone)
    np.testing.assert_array_equal(lead, alone_lead)
    assert (bases[:, ~mask] == 0).all()


def test_an_object_of_one_pixel_is_linearized(linearize: Linearize) -> None:
    mask = np.zeros(SIZE, bool)
    mask[150, 150] = True
    bases, lead = linearize(EVERY, mask=mask)
    assert lead.shape == (1,)
    assert np.isfinite(bases[:, 150, 150]).all()
    assert (bases[:, ~mask] == 0).all()
