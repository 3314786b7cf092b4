"""Ties settled by neighbours: who listens, what is taken over, how far it spreads, and laws."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from photolin import settle as module
from photolin.errors import Cancelled
from photolin.factorize import orthogonalize
from photolin.observations import Observations
from photolin.settle import is_rough, settle_ties

H, W, K = 12, 16, 24
Array = np.ndarray


def relief(turned: float = 0.0) -> tuple[Observations, Array]:
    """A smooth relief lit by all lights, its right half turned by so much, and its solutions."""
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:H, :W]
    slope = np.arctan(0.3 * np.sin(x / 12)) + turned * (x >= W // 2)
    n = np.stack([np.sin(slope), 0.3 * np.cos(y / 12), np.cos(slope)])
    n *= (0.7 + 0.1 * np.sin(x / 3)) / np.linalg.norm(n, axis=0)
    lights = np.column_stack([rng.uniform(-0.8, 0.8, (K, 2)), rng.uniform(0.5, 1, K)])
    A = orthogonalize(lights).T.astype(np.float32)
    ideal = np.tensordot(lights, n, 1)
    bases = np.linalg.lstsq(A.T, ideal.reshape(K, -1))[0].reshape(3, H, W).astype(np.float32)
    images = np.maximum(np.tensordot(A.T, bases, 1), 0)
    white = np.full(K, np.inf, np.float32)
    return Observations(images, np.ones((H, W), bool), A, white, 0.01, 0.01, 1.0), bases


def sure() -> Array:
    """Every pixel's solution won by many votes."""
    return np.full((H, W), 9, np.int32)


def settle(seen: Observations, bases: Array, lead: Array, threads: int | None = None) -> Array:
    return settle_ties(seen, bases.copy(), lead[seen.mask], threads)


def tie(seen: Observations, bases: Array, pixel: tuple[int, int], each: int = 3) -> Array:
    """Light `pixel` in `each` images as it is, in as many as if turned; the turned solution.

    To either solution the other's observations are highlights: nothing but neighbours can tell.
    """
    right = bases[:, *pixel]
    across = np.cross(right, [0.3, 1, 0.2])
    size = np.linalg.norm(right)
    wrong = np.cos(0.7) * right + np.sin(0.7) * size * across / np.linalg.norm(across)
    one, other = right @ seen.factors, wrong @ seen.factors
    seen.images[:, *pixel] = 0
    for low, high in ((one, other), (other, one)):
        sets = np.array([*combinations(np.flatnonzero((low > 0.05) & (high - low > 0.1)), each)])
        a = seen.factors.T[sets]
        # of those that differ, the images that determine a solution best
        chosen = sets[np.linalg.det(a.transpose(0, 2, 1) @ a).argmax()]
        seen.images[chosen, *pixel] = high[chosen]
    return wrong.astype(np.float32)


def spoil(
    seen: Observations, bases: Array, lead: Array, pixels: list[tuple[int, int]], each: int = 3
) -> Array:
    """Ties at `pixels` that the wrong solution has won: the bases to start from."""
    start = bases.copy()
    for pixel in pixels:
        start[:, *pixel] = tie(seen, bases, pixel, each)
        lead[pixel] = 0
    return start


# What is taken over


@pytest.mark.parametrize(
    "pixels", [[(5, 7)], [(0, 0)], [(0, 15), (11, 0)], [(5, 6), (5, 7), (6, 7), (8, 8), (11, 15)]]
)
def test_a_tie_goes_to_the_solution_that_suits_the_neighbours(
    pixels: list[tuple[int, int]],
) -> None:
    (seen, right), lead = relief(), sure()
    start = spoil(seen, right, lead, pixels)
    before = start.copy()
    found = settle(seen, start, lead)
    for pixel in pixels:
        assert np.abs(start - right)[:, *pixel].max() > 0.3
        np.testing.assert_allclose(found[:, *pixel], right[:, *pixel], atol=0.01)
        found[:, *pixel] = right[:, *pixel]
    np.testing.assert_array_equal(found, right)
    np.testing.assert_array_equal(start, before)


@pytest.mark.parametrize("band", [np.s_[:, 4:12], np.s_[2:10]])
def test_what_was_taken_over_is_passed_on(band: tuple[slice, ...] | slice) -> None:
    """Two pixels a sweep: the middle of eight undecided lines has no trusted neighbour."""
    (seen, right), lead = relief(), sure()
    lead[band] = 0
    start = spoil(seen, right, lead, [(i, j) for i, j in np.argwhere(lead == 0)])
    np.testing.assert_allclose(settle(seen, start, lead), right, atol=0.02)


def test_a_solution_spreads_over_eight_pixels_in_four_sweeps() -> None:
    (seen, right), lead = relief(), sure()
    start = spoil(seen, right, lead, [(i, j) for i in range(H) for j in range(6, 16)])
    found = settle(seen, start, lead)
    np.testing.assert_allclose(found[..., :14], right[..., :14], atol=0.02)
    np.testing.assert_array_equal(found[..., 14:], start[..., 14:])


def test_neighbours_that_are_hardly_trusted_decide_a_tie_all_the_same() -> None:
    (seen, right), lead = relief(), np.ones((H, W), np.int32)
    seen.mask[:] = False
    seen.mask[5, 5:9] = True
    start = spoil(seen, right, lead, [(5, 7)])
    np.testing.assert_allclose(settle(seen, start, lead)[:, 5, 7], right[:, 5, 7], atol=0.01)


# Who listens


@pytest.mark.parametrize(("votes", "listens"), [(0, True), (1, True), (2, False)])
def test_a_pixel_whose_solution_won_by_two_votes_keeps_it(votes: int, listens: bool) -> None:
    (seen, right), lead = relief(), sure()
    start = spoil(seen, right, lead, [(5, 7)], each=5)
    lead[5, 7] = votes
    found = settle(replace(seen, noise=0.005), start, lead)[:, 5, 7]
    np.testing.assert_allclose(found, (right if listens else start)[:, 5, 7], atol=0.01 * listens)


@pytest.mark.parametrize(("uncertainty", "listens"), [(0.027, False), (0.033, True)])
def test_a_pixel_that_knows_its_direction_keeps_it(uncertainty: float, listens: bool) -> None:
    (seen, right), lead = relief(), sure()
    start = spoil(seen, right, lead, [(5, 7)], each=5)
    lead[5, 7] = 9
    x, v = seen.images[:, 5, 7], start[:, 5, 7]
    a = seen.factors[:, np.abs(x - v @ seen.factors) < 1e-4].astype(float)
    noise = uncertainty * np.linalg.norm(v) / np.sqrt(np.trace(np.linalg.inv(a @ a.T)))
    found = settle(replace(seen, noise=float(noise)), start, lead)
    assert (found[:, 5, 7] != v).any() == listens


def test_another_surface_next_door_turns_nobody() -> None:
    """Even those who won by one vote: six observations outweigh all neighbours."""
    (seen, right), lead = relief(turned=0.9), np.ones((H, W), np.int32)
    lead[::2, :8] = 9
    seen.images[np.arange(K) % 4 > 0, :, 8:] = 0
    found = settle(seen, right, lead)
    np.testing.assert_allclose(found, right, atol=1e-3)


@pytest.mark.parametrize("excess", [0.4, -0.4])
def test_neighbours_reveal_one_highlight_in_three_but_no_fit_above_what_is_seen(
    excess: float,
) -> None:
    (seen, right), lead = relief(), sure()
    start = spoil(seen, right, lead, [(5, 7)])
    x, ideal = seen.images[:, 5, 7], right[:, 5, 7] @ seen.factors
    shown = np.flatnonzero(np.abs(x - ideal) < 1e-4)
    x[:] = 0
    x[shown] = ideal[shown] + excess * (np.arange(3) == 0)
    start[:, 5, 7] = np.linalg.solve(seen.factors[:, shown].T, x[shown])
    found = settle(seen, start, lead)[:, 5, 7]
    assert ((x - found @ seen.factors)[shown] > -4 * seen.noise).all()
    assert np.allclose(found, right[:, 5, 7], atol=0.01) == (excess > 0)


@pytest.mark.parametrize(
    "pixel",
    [
        (5, 7),
        (0, 8),
        (5, 8),
    ],
)
def test_a_tie_beside_another_surface_goes_to_its_own(pixel: tuple[int, int]) -> None:
    (seen, right), lead = relief(turned=0.9), sure()
    start = spoil(seen, right, lead, [pixel])
    np.testing.assert_allclose(settle(seen, start, lead), right, atol=0.01)


# Laws


def messy() -> tuple[Observations, Array, Array]:
    """Noise, highlights, saturation, shadows and many ties."""
    (seen, right), lead = relief(), sure()
    rng = np.random.default_rng(1)
    start = spoil(seen, right, lead, [(i, j) for i in range(2, 9, 2) for j in range(H)])
    start += rng.normal(0, 0.02, start.shape).astype(np.float32)
    images = seen.images * rng.normal(1, 0.02, seen.images.shape)
    images += np.where(rng.random(images.shape) < 0.1, 0.3, 0)
    lead[9:] = rng.integers(0, 3, lead[9:].shape)
    white = np.full(K, 0.9, np.float32)
    return replace(seen, images=images.astype(np.float32), white=white), start, lead


@pytest.mark.parametrize("factor", [0.125, 4])
def test_scaling_what_was_measured_scales_the_result_exactly(factor: float) -> None:
    """A power of two changes no rounding."""
    seen, start, lead = messy()
    found = settle(seen, start, lead)
    assert (found != start).any(axis=0).sum() > 20
    scaled = Observations(
        *(seen.images * np.float32(factor), seen.mask, seen.factors),
        *(seen.white * np.float32(factor), seen.Ts * factor),
        *(seen.noise * factor, seen.bright * factor),
    )
    again = settle(scaled, start * np.float32(factor), lead)
    np.testing.assert_array_equal(again, found * np.float32(factor))


def test_neither_threads_nor_block_sizes_change_a_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    seen, start, lead = messy()
    expected = settle(seen, start, lead)
    for threads, block in ((1, 10**6), (3, 7), (2, 50)):
        monkeypatch.setattr(module, "BLOCK", block)
        monkeypatch.setattr(module, "FEW", block)
        np.testing.assert_array_equal(settle(seen, start, lead, threads), expected)


def test_undetermined_pixels_stay_so_and_their_neighbours_are_settled() -> None:
    (seen, right), lead = relief(), sure()
    start = spoil(seen, right, lead, [(5, 7)])
    start[:, 5, 6] = start[:, 6, 8] = np.nan
    found = settle(seen, start, lead)
    assert np.argwhere(np.isnan(found[0])).tolist() == [[5, 6], [6, 8]]
    np.testing.assert_allclose(found[:, 5, 7], right[:, 5, 7], atol=0.01)


def test_what_lies_outside_the_mask_stays_and_has_no_say() -> None:
    seen, start, lead = messy()
    mask = np.random.default_rng(2).random((H, W)) < 0.7
    seen = replace(seen, mask=mask)
    found = settle(seen, start, lead)
    np.testing.assert_array_equal(found[:, ~mask], start[:, ~mask])
    other = np.where(mask, start, np.float32(0.4))
    np.testing.assert_array_equal(settle(seen, other, lead)[:, mask], found[:, mask])


def test_only_pixels_named_doubt_and_all_others_are_trusted() -> None:
    (seen, right), lead = relief(), sure()
    start = spoil(seen, right, lead, [(5, 6), (8, 9)])
    named, votes = np.array([5 * W + 6]), np.zeros(1, np.int32)
    found = settle_ties(seen, start.copy(), votes, among=named)
    np.testing.assert_allclose(found[:, 5, 6], right[:, 5, 6], atol=0.01)
    found[:, 5, 6] = start[:, 5, 6]
    np.testing.assert_array_equal(found, start)


def test_where_nobody_doubts_nothing_changes() -> None:
    seen, right = relief()
    np.testing.assert_array_equal(settle(seen, right, sure()), right)


@pytest.mark.parametrize("pixels", [0, 1])
def test_a_mask_of_one_pixel_or_none_leaves_the_bases_as_they_are(pixels: int) -> None:
    seen, start, lead = messy()
    mask = np.zeros((H, W), bool)
    mask[4, 6 : 6 + pixels] = True
    np.testing.assert_array_equal(settle(replace(seen, mask=mask), start, lead), start)


@pytest.mark.parametrize("asked", [0, 1, 2, 3, 4])
def test_it_can_be_cancelled_in_every_sweep(asked: int) -> None:
    seen, start, lead = messy()
    answers = iter([False] * asked + [True] * 99)
    with pytest.raises(Cancelled, match="linearize was cancelled"):
        settle_ties(seen, start, lead.ravel(), cancel=lambda: next(answers))


@pytest.mark.parametrize(("roughness", "rough"), [(0.0, False), (0.1, False), (0.6, True)])
def test_pixels_that_have_nothing_in_common_do_not_ask_each_other(
    roughness: float, rough: bool
) -> None:
    rng = np.random.default_rng(0)
    flat = rng.normal((0, 0, 1), roughness, (900, 3)).T.astype(np.float32)
    trust = np.ones(900, np.float32)
    assert is_rough(flat, trust, (30, 30)) == rough
    assert not is_rough(flat, trust * (np.arange(900) < 40), (30, 30))  # too few to tell


@pytest.mark.parametrize("along", [0, 1])
def test_a_surface_that_is_smooth_one_way_only_is_half_smooth(along: int) -> None:
    """Grooves: along them neighbours agree, across them they do not; more than half then does."""
    rng = np.random.default_rng(0)
    grooves = np.broadcast_to(rng.normal((0, 0, 1), 0.2, (30, 1, 3)), (30, 30, 3))
    flat = np.moveaxis(grooves, 2, 0).astype(np.float32)
    flat = flat.swapaxes(1, 2) if along else flat
    assert not is_rough(
        np.ascontiguousarray(flat).reshape(3, -1), np.ones(900, np.float32), (30, 30)
    )
