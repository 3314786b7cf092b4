"""The last fit with neighbours: what it removes, what it leaves as it is, and its symmetries."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lambert import lambertian

from photolin import refit as module
from photolin.errors import Cancelled
from photolin.factorize import orthogonalize
from photolin.kernels import pooled_tile
from photolin.observations import Observations
from photolin.refit import find_clear, measure_means, refit_bases

f32 = np.float32
Array = np.ndarray
K, BRIGHT = 20, 0.9


def relief(
    noise: float, size: tuple[int, int] = (50, 70), more: Array | float = 0.0
) -> tuple[Observations, Array, Array]:
    """Observations with `more` light in them, plain least squares of them and of the truth."""
    stack, lights = lambertian(K, size)
    rng = np.random.default_rng(1)
    images = (stack.images + more + rng.normal(0, noise, stack.shape)).astype(f32)
    factors = np.ascontiguousarray(orthogonalize(lights).T, f32)
    white = np.full(K, np.inf, f32)
    # LEAST_NOISE of linearize
    level = noise + 6e-4 * BRIGHT
    seen = Observations(images, stack.mask, factors, white, 0.01, level, BRIGHT)
    fits = [(np.tensordot(factors, x, 1) * 3 / K).astype(f32) for x in (images, stack.images)]
    return seen, *fits


def error(seen: Observations, bases: Array, truth: Array) -> Array:
    """(K,H,W) of the linearized images."""
    return np.tensordot(seen.factors.T, bases - truth, 1)


def before_and_after(seen: Observations, plain: Array, truth: Array) -> list[Array]:
    """Errors of least squares and of the fit that starts from it."""
    return [error(seen, bases, truth) for bases in (plain, refit_bases(seen, plain))]


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


def mixed() -> tuple[Observations, Array]:
    """Noise, wide highlights, shadows, a saturated image, an unknown pixel, a mask."""
    more, _ = blobs(0.02, (50, 70))
    seen, bases, _ = relief(0.01, more=more)
    rng = np.random.default_rng(0)
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
    before, after = before_and_after(*relief(0.005, (90, 90), more))
    assert before[:, inside].mean() > 0.18 * light * 0.005
    assert abs(after[:, inside].mean()) < left * before[:, inside].mean()
    assert rms(after[:, ~inside]) < 1.05 * rms(before[:, ~inside])


@pytest.mark.parametrize(
    ("light", "noise"), [(0.05, 0.0), (0.05, 0.001), (0.07, 0.001), (-0.035, 0.001)]
)
def test_single_sparks_do_not_come_back_into_the_fit(light: float, noise: float) -> None:
    """Though the fit that is given has followed them; nor do specks of dust."""
    spots = np.random.default_rng(0).random((K, 50, 70)) < 0.01
    before, after = before_and_after(*relief(noise, more=light * spots))
    seen, calm, truth = relief(noise)
    best = error(seen, calm, truth)
    spoiled = spots.any(axis=0)
    assert rms(before[:, spoiled]) > 0.08 * abs(light)
    assert rms(after[:, spoiled]) < 1e-6 + 1.15 * rms(best[:, spoiled])


@pytest.mark.parametrize("factor", [1.02, 0.995])
def test_bases_that_start_a_little_off_come_to_the_truth(factor: float) -> None:
    """Further from above, where highlights pull them, than from below."""
    seen, plain, truth = relief(0.0)
    out = refit_bases(seen, plain * f32(factor))
    assert rms(error(seen, out, truth)) < 1e-5


# What it leaves


def test_exactly_diffuse_pixels_stay_where_they_are() -> None:
    seen, bases, _ = relief(0.0)
    given = bases.copy()
    np.testing.assert_allclose(refit_bases(seen, bases), given, atol=1e-6)
    np.testing.assert_array_equal(bases, given)


@pytest.mark.parametrize("noise", [0.002, 0.01, 0.05])
def test_noise_alone_is_fitted_as_well_as_by_least_squares(noise: float) -> None:
    seen, *fits = relief(noise)
    before, after = before_and_after(replace(seen, Ts=-1.0), *fits)
    assert rms(after) < 1.15 * rms(before)
    assert abs(after.mean()) < 0.06 * noise


def test_outside_the_mask_and_where_nothing_is_known_bases_stay_as_they_are() -> None:
    seen, bases = mixed()
    bases[:, ~seen.mask] = np.arange(3)[:, None]
    out = refit_bases(seen, bases)
    assert out.dtype == f32
    np.testing.assert_array_equal(np.isnan(out), np.isnan(bases))
    np.testing.assert_array_equal(out[:, ~seen.mask], bases[:, ~seen.mask])
    # an unknown pixel is to its neighbours what one outside the mask is
    mask = seen.mask & np.isfinite(bases[0])
    other = refit_bases(replace(seen, mask=mask), np.where(mask, bases, 0))
    np.testing.assert_array_equal(other[:, mask], out[:, mask])


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (7, 1), (3, 3), (4, 40)])
def test_pictures_smaller_than_a_window_are_fitted(size: tuple[int, int]) -> None:
    seen, plain, truth = relief(0.01, size)
    assert rms(error(seen, refit_bases(seen, plain), truth)) < 0.01
    nothing = replace(seen, mask=np.zeros(size, bool))
    np.testing.assert_array_equal(refit_bases(nothing, plain), plain)
    assert (find_clear(nothing, plain) == 1).all()


# The noise of means


EXPECTED = 0.01 / 5 * np.sqrt(1 - 3 / K)
"""A fifth of the noise, as residuals of three unknowns have it."""


@pytest.mark.parametrize("hidden", [0, 0.95, 1.5])
def test_means_of_25_vary_by_a_fifth_of_the_noise(hidden: float) -> None:
    """Whether others are dark, outside or saturated."""
    seen, plain, _ = relief(0.01, (90, 120))
    mask, gone = np.zeros((90, 120), bool), np.random.default_rng(2).random((K, 90, 120)) < 0.3
    mask[8:-8, 8:-8] = True
    if hidden == 0.95:
        gone[:] = gone[0]
        mask &= ~gone[0]
    seen.images[gone], seen.white[:] = hidden, 1.5
    assert measure_means(seen, mask, 0.05, plain) == pytest.approx(EXPECTED, rel=0.05)


@pytest.mark.parametrize("size", [(20, 20), (64, 64), (78, 80), (117, 60)])
def test_the_noise_of_means_is_right_up_to_the_edges_of_a_picture(size: tuple[int, int]) -> None:
    """Places beyond are not lit; pixels repeated there would make means of fewer look noisier."""
    seen, plain, _ = relief(0.01, size)
    assert measure_means(seen, seen.mask, 0.05, plain) == pytest.approx(EXPECTED, rel=0.06)


def test_highlights_are_no_noise_of_means() -> None:
    more, _ = blobs(0.04, (90, 120))
    seen, _, truth = relief(0.01, (90, 120), more)
    assert measure_means(seen, seen.mask, 0.05, truth) == pytest.approx(0.002, rel=0.15)


# Symmetries


def test_threads_do_not_change_a_bit() -> None:
    seen, bases = mixed()
    expected = refit_bases(seen, bases, threads=1)
    clear = find_clear(seen, expected, threads=1)
    for threads in (2, 3):
        np.testing.assert_array_equal(refit_bases(seen, bases, threads), expected)
        np.testing.assert_array_equal(find_clear(seen, expected, threads), clear)


@pytest.mark.parametrize("factor", [0.25, 8])
def test_everything_scales_with_the_light_exactly(factor: float) -> None:
    """A power of two changes no rounding."""
    seen, bases = mixed()
    names = ("images", "white", "Ts", "noise", "bright")
    scaled: dict[str, Any] = {name: getattr(seen, name) * factor for name in names}
    out = refit_bases(replace(seen, **scaled), bases * f32(factor))
    np.testing.assert_array_equal(out, refit_bases(seen, bases) * f32(factor))


def test_the_faintest_light_divides_by_nothing() -> None:
    """Squares of it are 0 in single precision."""
    seen, plain, _ = relief(0.0)
    faint: dict[str, Any] = {name: getattr(seen, name) * 1e-22 for name in ("noise", "bright")}
    faint |= {"images": seen.images * f32(1e-22), "Ts": 0.0}
    other, start = replace(seen, **faint), plain * f32(1e-22)
    np.testing.assert_allclose(refit_bases(other, start) * f32(1e22), plain, atol=1e-5)
    assert (find_clear(other, start) == 1).all()


@pytest.mark.parametrize(
    "turn",
    [lambda a: a[..., ::-1, :], lambda a: a[..., ::-1], lambda a: a.swapaxes(-1, -2)],
    ids=["upside down", "mirrored", "transposed"],
)
def test_a_turned_picture_gives_the_turned_result(turn: Callable[[Array], Array]) -> None:
    """But for the noise of means, which is measured in other squares."""
    seen, bases = mixed()
    images, start = (np.ascontiguousarray(turn(a)) for a in (seen.images, bases))
    out = refit_bases(replace(seen, images=images, mask=turn(seen.mask)), start)
    assert rms(np.nan_to_num(turn(out) - refit_bases(seen, bases))) < 0.01 * seen.noise


def test_the_order_of_images_changes_nothing_but_rounding() -> None:
    seen, bases = mixed()
    order = np.random.default_rng(2).permutation(K)
    factors = np.ascontiguousarray(seen.factors[:, order])
    other = replace(seen, images=seen.images[order], factors=factors, white=seen.white[order])
    out = refit_bases(other, bases)
    np.testing.assert_allclose(out, refit_bases(seen, bases), atol=1e-5)


# Tiles


def test_where_no_tile_is_left_alone_their_size_does_not_change_a_bit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen, bases = mixed()
    early = refit_bases(seen, bases)
    monkeypatch.setattr(module, "STILL", -1.0)
    expected = refit_bases(seen, bases)
    clear = find_clear(seen, expected)
    for tile in ((7, 9), (100, 3), (1, 500)):
        monkeypatch.setattr(module, "TILE", tile)
        np.testing.assert_array_equal(refit_bases(seen, bases), expected)
        np.testing.assert_array_equal(find_clear(seen, expected), clear)
    # leaving still ones alone costs less than the noise
    assert 0 < rms(np.nan_to_num(early - expected)) < 0.01 * seen.noise
    assert np.nanmax(np.abs(early - expected)) < 0.2 * seen.noise


def test_what_is_left_alone_keeps_the_latest_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    seen, bases = mixed()
    monkeypatch.setattr(module, "STILL", 1e9)
    out = refit_bases(seen, bases)
    for rounds, same in ((3, True), (2, False)):
        other = refit_bases(seen, bases, rounds=rounds)
        assert np.array_equal(other, out, equal_nan=True) == same


def test_only_what_moves_and_what_touches_it_is_fitted_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """A faint highlight in the tile at (2, 1); nothing of the object in the last column."""
    more, mask = np.zeros((K, 80, 390)), np.ones((80, 390), bool)
    more[:4, 36:44, 200:210] = 0.003
    mask[:, 384:] = False
    seen, plain, _ = relief(0.0, mask.shape, more)
    calls = np.zeros((5, 4), int)

    def count(*args: Any) -> float:
        top, left, rows, columns = args[8:12]
        assert (rows, columns) == (16, 128)
        calls[top // 16, left // 128] += 1
        return pooled_tile(*args)

    monkeypatch.setattr(module, "pooled_tile", count)
    refit_bases(replace(seen, mask=mask), plain, threads=1)
    m = calls[2, 1]
    assert 3 < m <= module.ROUNDS
    assert calls.tolist() == [[3, 3, 3, 0], *[[m, m, m, 0]] * 3, [3, 3, 3, 0]]


# What surroundings show


def test_surroundings_are_clear_but_for_highlights_and_the_sparks_themselves() -> None:
    """Highlights little brighter than the noise; a spark alone says nothing of its neighbours."""
    light, _ = blobs(0.008, (90, 90))
    spark = np.zeros(light.shape, bool)
    spark[5, 4::20, 4::20] = True
    seen, _, truth = relief(0.005, (90, 90), light + 0.1 * spark)
    clear = find_clear(seen, refit_bases(seen, truth))
    assert (clear.shape, clear.dtype) == (light.shape, f32)
    assert (clear[spark] == 0).all()
    near = [np.roll(light > 0, (i, j), (1, 2)) for i in (-2, 0, 2) for j in (-2, 0, 2)]
    assert clear[np.all(near, axis=0)].mean() < 0.05
    assert clear[~np.any(near, axis=0) & ~spark].mean() > 0.9
    assert (clear.min(), clear.max()) == (0, 1)


# Progress and cancellation


def test_progress_rises_to_one_within_the_stage() -> None:
    told: list[tuple[str, float]] = []
    refit_bases(*mixed(), progress=lambda stage, done: told.append((stage, done)))
    assert {stage for stage, _ in told} == {"linearize"}
    shares = [0, *(done for _, done in told)]
    assert len(shares) > 3
    assert shares[-1] == 1
    assert (np.diff(shares) > 0).all()


@pytest.mark.parametrize(
    ("work", "after"), [(refit_bases, 0), (refit_bases, 20), (find_clear, 0), (find_clear, 2)]
)
def test_it_can_be_cancelled(work: Callable[..., Array], after: int) -> None:
    asked: list[int] = []
    seen, bases = mixed()
    with pytest.raises(Cancelled, match="linearize was cancelled"):
        work(seen, bases, cancel=lambda: asked.append(1) or len(asked) > after)
