"""The pooled fit of a tile against a plain twin that knows no tiles, and laws of its weights.

The twin sums in another order and in double precision: the two agree to single precision.
"""

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

from photolin.kernels import clear_tile, pooled_tile

f32 = np.float32
Array = np.ndarray
Problem = tuple[Array, Array, Array, Array, np.float32, Array]
"""Images, usable pixels, factors, white levels, shadow level, bases."""

SIZE = (23, 30)
LIMITS = (0.08, 0.02)
"""Cap and reach: noise of 0.02 makes weights of all sizes."""
OPEN = (1e6, 1e6)
"""Nothing costs an observation its say."""
WHOLE = (0, 0, *SIZE)


def problem(seed: int, K: int = 14, size: tuple[int, int] = SIZE) -> Problem:
    """Noise, wide and narrow highlights, shadows, saturated pixels, some at the very levels."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3, K))
    A[0] = 1
    truth = rng.uniform(-0.1, 0.1, (3, *size))
    truth[0] = rng.uniform(0.3, 0.6, size)
    images = np.tensordot(A.T, truth, 1) + rng.normal(0, 0.02, (K, *size))
    images[:4, size[0] // 3 :, : size[1] // 2] += 0.03
    wrong = rng.random(images.shape)
    images[wrong < 0.05] += 0.2
    images[(wrong > 0.05) & (wrong < 0.1)] = 0.1  # exactly Ts
    images[wrong > 0.95] = 0.7  # exactly white
    images[:, wrong[0] < 0.05] = 0  # lit nowhere
    usable = rng.random(size) > 0.1
    white = np.where(np.arange(K) % 2, f32(0.7), f32(np.inf)).astype(f32)
    bases = truth + rng.normal(0, 0.01, truth.shape)
    return images.astype(f32), usable, A.astype(f32), white, f32(0.1), bases.astype(f32)


def fit(known: Problem, limits: tuple[float, ...], *tiles: tuple[int, ...]) -> tuple[Array, list]:
    """What the compiled loop writes, 7 elsewhere, and the changes it returns."""
    out = np.full_like(known[-1], 7)
    cuts = [f32(limit) for limit in limits]
    return out, [pooled_tile(*known, *cuts, *tile, out) for tile in tiles or (WHOLE,)]


def sums(a: Array) -> Array:
    """Of every window of 5 x 5, with nothing beyond the picture."""
    padded = np.pad(a.astype(np.float64), ((0, 0), (2, 2), (2, 2)))
    return sliding_window_view(padded, (5, 5), axis=(1, 2)).sum(axis=(-1, -2))


def look_around(known: Problem, cap: float, reach: float) -> tuple[Array, Array, Array]:
    """Residuals of the whole picture within the cap, which are lit, how clear surroundings are."""
    images, usable, A, white, Ts, bases = known
    residual = images - np.tensordot(A.T, bases, 1)
    lit = usable & (images >= Ts) & (images < white[:, None, None])
    near, counts = np.where(lit, residual.clip(-cap, cap), 0), np.maximum(sums(lit), 1)
    above = np.maximum(sums(near), 0) / counts / (reach * 5 / np.sqrt(counts))
    return near, lit, np.maximum(1 - above**2, 0) ** 2


def pooled(known: Problem, limits: tuple[float, ...]) -> tuple[Array, Array]:
    """Solutions of the whole picture and their relative changes; -1 where a pixel keeps its own."""
    images, usable, A, *_, bases = known
    near, lit, u = look_around(known, *limits)
    u *= lit * np.maximum(1 - (near / limits[0]) ** 2, 0) ** 2
    out, change = bases.copy(), np.full(usable.shape, -1.0)
    for at in zip(*np.nonzero(usable & (u.sum(axis=0) >= 3.5)), strict=True):
        w, old = np.sqrt(u[:, *at]), bases[:, *at].astype(np.float64)
        new = np.linalg.lstsq(w[:, None] * A.T, w * images[:, *at])[0]
        out[:, *at], change[at] = new, np.linalg.norm(new - old) / np.linalg.norm(old)
    return out, change


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize(
    "tile",
    [WHOLE, (7, 9, 8, 11), (0, 0, 6, 5), (0, 25, 4, 5), (20, 0, 3, 9), (22, 29, 1, 1)],
)
def test_a_tile_is_the_twins_and_nothing_else_is_written(seed: int, tile: tuple[int, ...]) -> None:
    known = problem(seed)
    expected, changes = pooled(known, LIMITS)
    out, [change] = fit(known, LIMITS, tile)
    top, left, rows, columns = tile
    inside = np.zeros(SIZE, bool)
    inside[top : top + rows, left : left + columns] = True
    np.testing.assert_allclose(out[:, inside], expected[:, inside], rtol=2e-5, atol=2e-5)
    assert (out[:, ~inside] == 7).all()
    assert change == pytest.approx(max(changes[inside].max(), 0), rel=2e-3)
    if tile == WHOLE:
        # all ways to end are there
        assert 30 < (changes[known[1]] < 0).sum() < 200


@pytest.mark.parametrize("size", [(1, 1), (1, 30), (23, 1), (5, 7), (22, 29)])
def test_the_tiles_a_picture_is_cut_into_do_not_change_a_bit(size: tuple[int, int]) -> None:
    known = problem(2)
    expected, whole = fit(known, LIMITS)
    tiles = [
        (top, left, min(size[0], SIZE[0] - top), min(size[1], SIZE[1] - left))
        for top in range(0, SIZE[0], size[0])
        for left in range(0, SIZE[1], size[1])
    ]
    out, changes = fit(known, LIMITS, *tiles)
    np.testing.assert_array_equal(out, expected)
    assert max(changes) == whole[0]


@pytest.mark.parametrize("size", [(1, 1), (1, 4), (4, 1), (2, 2), (3, 7)])
def test_pictures_smaller_than_a_window_are_the_twins(size: tuple[int, int]) -> None:
    known = problem(3, size=size)
    known[1][:] = True
    out, [change] = fit(known, LIMITS, (0, 0, *size))
    expected, changes = pooled(known, LIMITS)
    np.testing.assert_allclose(out, expected, rtol=2e-5, atol=2e-5)
    assert change == pytest.approx(max(changes.max(), 0), rel=2e-3)


def test_pixels_that_are_not_usable_stay_as_they_are_and_tell_neighbours_nothing() -> None:
    known = problem(4)
    images, usable, *_, bases = known
    expected, _ = fit(known, LIMITS)
    np.testing.assert_array_equal(expected[:, ~usable], bases[:, ~usable])
    images[:, ~usable] = 0.5
    bases[:, ~usable] = np.nan
    out, _ = fit(known, LIMITS)
    assert np.isnan(out[:, ~usable]).all()
    np.testing.assert_array_equal(out[:, usable], expected[:, usable])


def test_saturated_and_dark_observations_are_left_out_whatever_their_value() -> None:
    images, *others, bases = problem(5)
    usable, A, white, Ts = others
    dark, over = images < Ts, images >= white[:, None, None]
    assert (images == Ts).any()
    assert min(dark.mean(), over.mean()) > 0.03
    expected, _ = fit((images, *others, bases), LIMITS)
    for low, high in ((-1, 0.7), (0.0999, 0.9), (0, 50)):
        other = np.where(dark, f32(low), np.where(over, f32(high), images))
        np.testing.assert_array_equal(fit((other, *others, bases), LIMITS)[0], expected)
    never = np.full_like(white, np.inf)
    for changed in ((A, never, Ts), (A, white, f32(-1)), (A, white, f32(0.3))):
        assert (fit((images, usable, *changed, bases), LIMITS)[0] != expected).any()


def lone(K: int, excess: float) -> tuple[Problem, Array]:
    """One pixel whose observations all differ from its bases by `excess`, and its best fit."""
    A = np.random.default_rng(6).normal(size=(3, K))
    A[0] = 1  # the excess is a step of the first base
    bases = np.reshape([0.5, 0.05, -0.05], (3, 1, 1))
    images = np.tensordot(A.T, bases, 1) + excess
    images, A, white, bases = (a.astype(f32) for a in (images, A, np.full(K, np.inf), bases))
    step = np.reshape([excess, 0, 0], (3, 1, 1))
    return (images, np.ones((1, 1), bool), A, white, f32(0.01), bases), bases + step


@pytest.mark.parametrize(
    ("K", "share", "enough"),
    [(3, 1.0, False), (4, 1.0, True), (4, 0.86, False), (4, 0.89, True), (9, 0.38, False)],
)
def test_a_pixel_is_fitted_from_a_weight_of_three_and_a_half(
    K: int, share: float, enough: bool
) -> None:
    """The cap is one that leaves this share of the weight to a residual of 0.02."""
    cap = 0.02 / max(np.sqrt(1 - np.sqrt(share)), 1e-6)
    known, best = lone(K, -0.02)
    out, [change] = fit(known, (cap, 1e6), (0, 0, 1, 1))
    np.testing.assert_allclose(out, best if enough else known[-1], atol=1e-6)
    assert change == pytest.approx(enough * 0.02 / np.linalg.norm(known[-1]), rel=1e-4)


@pytest.mark.parametrize(
    ("excess", "limits", "fitted"),
    [
        # (own / cap)^2 of 0.36 leaves 9 observations a weight of 3.7, of 0.39 one of 3.3
        (0.05, (0.0833, 1e6), True),
        (-0.05, (0.0833, 1e6), True),
        (0.05, (0.08, 1e6), False),
        (-0.05, (0.08, 1e6), False),
        (0.05, (0.049, 1e6), False),
        (-0.05, (0.049, 1e6), False),
        (-0.05, (1e6, 0.001), True),
        # the mean of one residual varies 5 times as much as that of 25
        (0.05, (1e6, 0.0201), True),
        (0.05, (1e6, 0.0101), False),
    ],
)
def test_the_cap_acts_on_both_sides_of_the_fit_and_the_reach_above_it(
    excess: float, limits: tuple[float, ...], fitted: bool
) -> None:
    known, best = lone(9, excess)
    out, _ = fit(known, limits, (0, 0, 1, 1))
    np.testing.assert_allclose(out, best if fitted else known[-1], atol=1e-6)


def test_an_observation_above_the_fit_weighs_what_one_as_far_below_does() -> None:
    images, usable, A, *levels, bases = lone(9, 0)[0]
    moves = []
    for excess in (0.03, -0.03):
        other = images.copy()
        other[2] += f32(excess)
        out, _ = fit((other, usable, A, *levels, bases), (0.05, 1e6), (0, 0, 1, 1))
        moves.append(out - bases)
    np.testing.assert_allclose(moves[0], -moves[1], atol=1e-6)
    w = np.ones(9)
    w[2] = (1 - 0.6**2) ** 2
    expected = np.linalg.solve(A * w @ A.T, A[:, 2] * w[2] * 0.03)
    np.testing.assert_allclose(moves[0][:, 0, 0], expected, atol=1e-6)


@pytest.mark.parametrize("seed", range(7, 12))
@pytest.mark.parametrize("plane", [(0, 0), (1, -2), (0.3, 0.4)])
def test_factors_in_a_plane_leave_pixels_as_they_are(plane: tuple[float, float], seed: int) -> None:
    """Sums in single precision leave a determinant that is nothing but rounding."""
    images, usable, A, *levels, bases = problem(seed)
    A[2] = A.T[:, :2] @ f32(plane)
    out, changes = fit((images, usable, A, *levels, bases), OPEN)
    np.testing.assert_array_equal(out, bases)
    assert changes == [0]


def test_factors_a_little_out_of_a_plane_are_enough() -> None:
    images, usable, A, *levels, bases = problem(7)
    A[2] = A[0] - 2 * A[1] + 0.2 * A[2]
    known = (images, usable, A, *levels, bases)
    expected, changes = pooled(known, OPEN)
    assert (changes >= 0).mean() > 0.8
    np.testing.assert_allclose(fit(known, OPEN)[0], expected, atol=1e-3)


def test_a_black_pixel_may_become_bright() -> None:
    """Its change is not relative to nothing."""
    known, best = lone(9, 0.02)
    known[-1][:] = 0
    out, [change] = fit(known, OPEN, (0, 0, 1, 1))
    np.testing.assert_allclose(out, best, atol=1e-6)
    assert 1 < change < np.inf


@pytest.mark.parametrize("tile", [WHOLE, (7, 9, 8, 11), (0, 25, 4, 5), (20, 0, 3, 9)])
def test_how_clear_surroundings_are_is_the_twins(tile: tuple[int, ...]) -> None:
    """A pixel that is not lit has surroundings too; far below the fit is no highlight."""
    known, (cap, reach) = problem(8), LIMITS
    near, _, clear = look_around(known, cap, reach)
    out = np.full_like(known[0], 7)
    clear_tile(*known, f32(cap), f32(reach), *tile, out)
    inside = np.zeros(SIZE, bool)
    inside[tile[0] : tile[0] + tile[2], tile[1] : tile[1] + tile[3]] = True
    expected = np.where(near < cap, clear, 0)[:, inside]
    np.testing.assert_allclose(out[:, inside], expected, atol=1e-5)
    assert (out[:, ~inside] == 7).all()
    assert min((expected == 0).mean(), (expected > 0.5).mean()) > 0.02
