"""The fit of a band of pixels with the weights of their blocks, against a plain twin, and its laws.

The twin sums in double precision: solutions agree to single precision, and votes wherever no
residual lies within rounding of a limit.
"""

import numpy as np
import pytest

from photolin.kernels import fine_band

f32 = np.float32
Array = np.ndarray
Problem = tuple[Array, Array, Array, np.float32, Array, int, np.float32, np.float32]
"""Images, factors, white levels, shadow level, weights of blocks, step, T, what noise may be."""

SIZE = (23, 30)


def problem(seed: int, step: int = 4, K: int = 14) -> Problem:
    """Noise, sparks, shadows, saturated pixels, some at the very levels, blocks of all weights."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3, K))
    A[0] = 1
    truth = rng.uniform(-0.1, 0.1, (3, *SIZE))
    truth[0] = rng.uniform(0.3, 0.6, SIZE)
    images = np.tensordot(A.T, truth, 1) + rng.normal(0, 0.005, (K, *SIZE))
    wrong = rng.random(images.shape)
    images[wrong < 0.02] += 0.2
    images[(wrong > 0.02) & (wrong < 0.06)] = 0.1  # exactly Ts
    images[(wrong > 0.06) & (wrong < 0.1)] = 0.05
    images[wrong > 0.97] = 0.7  # exactly white
    images[4:, wrong[0] < 0.1] = 0  # lit in few images
    weights = rng.random((K, -(-SIZE[0] // step), -(-SIZE[1] // step))).clip(0.1, 0.9) * 1.25
    weights -= 0.125  # a tenth are 0, a tenth 1
    white = np.where(np.arange(K) % 2, f32(0.7), f32(np.inf)).astype(f32)
    arrays = (images.astype(f32), A.astype(f32), white, f32(0.1), weights.astype(f32))
    return *arrays, step, f32(0.03), f32(0.02)


def fit(known: Problem, *bands: tuple[int, ...]) -> tuple[Array, Array, Array]:
    """What the compiled loop writes: bases, lead and doubt; 7, 7 and true elsewhere."""
    size = known[0].shape[1:]
    out = (np.full((3, *size), 7, f32), np.full(size, 7, np.int32), np.ones(size, bool))
    for band in bands or cut(known, size[1]):
        fine_band(*known, *band, *out)
    return out


def cut(known: Problem, width: int) -> list[tuple[int, ...]]:
    """Bands of the whole picture, so many columns wide."""
    step, (H, W) = known[5], known[0].shape[1:]
    return [
        (top, left, min(step, H - top), min(width, W - left))
        for top in range(0, H, step)
        for left in range(0, W, width)
    ]


def twin(known: Problem) -> tuple[Array, Array, Array, Array]:
    """Bases, lead and doubt of the whole picture, and where a limit is too close to tell."""
    images, A, white, Ts, weights, step, T, wide = known
    _, H, W = images.shape
    w = weights.repeat(step, axis=1).repeat(step, axis=2)[:, :H, :W].astype(float)
    seen = (images >= Ts) & (images < white[:, None, None])
    bases, failed = np.zeros((3, H, W)), np.ones((H, W), bool)
    for at in zip(*np.nonzero((w * seen).sum(axis=0) >= 3.5), strict=True):
        root = np.sqrt((w * seen)[:, *at])
        bases[:, *at] = np.linalg.lstsq(root[:, None] * A.T, root * images[:, *at])[0]
        failed[at] = False
    l = np.tensordot(A.T, bases, 1)
    r, slack = images - l, T * images
    room = np.maximum(slack, wide)
    wrong = (r < -room) | (l < -wide) | ((r > room) & (w >= 0.5))
    lead = seen.sum(axis=0) + (seen & (np.abs(r) <= slack)).sum(axis=0)
    margins = [np.abs(r) - slack, np.abs(r) - room, l + wide]
    close = (seen & (np.abs(margins).min(axis=0) < 1e-5)).any(axis=0)
    return bases, lead, failed | (seen & wrong).any(axis=0), close & ~failed


def check(known: Problem, band: tuple[int, ...]) -> None:
    """A band is the twin's, and nothing else is written."""
    *expected, close = twin(known)
    inside = np.zeros(close.shape, bool)
    inside[band[0] : band[0] + band[2], band[1] : band[1] + band[3]] = True
    assert close.mean() < 0.02
    bases, *votes = fit(known, band)
    np.testing.assert_allclose(bases[:, inside], expected[0][:, inside], rtol=1e-4, atol=2e-5)
    for found, right, other in zip(votes, expected[1:], (7, True), strict=True):
        np.testing.assert_array_equal(found[inside & ~close], right[inside & ~close])
        assert (found[~inside] == other).all()
    assert (bases[:, ~inside] == 7).all()


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize(
    ("step", "band"),
    [
        (4, (0, 0, 4, 30)),
        (4, (8, 0, 4, 12)),
        (4, (12, 8, 4, 12)),
        (4, (20, 0, 3, 30)),
        (4, (20, 28, 3, 2)),
        (4, (4, 28, 4, 2)),
        (4, (4, 8, 1, 1)),
        (7, (14, 7, 7, 23)),
        (7, (21, 28, 2, 2)),
        (1, (22, 29, 1, 1)),
        (1, (5, 3, 1, 20)),
        (40, (0, 0, 23, 30)),
    ],
)
def test_a_band_is_the_twins_and_nothing_else_is_written(
    step: int, band: tuple[int, ...], seed: int
) -> None:
    check(problem(seed, step), band)


@pytest.mark.parametrize("seed", [2, 3])
def test_bands_together_are_the_twins_picture(seed: int) -> None:
    known = problem(seed)
    bases, lead, doubt, close = twin(known)
    out = fit(known)
    np.testing.assert_allclose(out[0], bases, rtol=1e-4, atol=2e-5)
    np.testing.assert_array_equal(out[1][~close], lead[~close])
    np.testing.assert_array_equal(out[2][~close], doubt[~close])
    # all ways to end are there
    failed = (bases == 0).all(axis=0)
    assert min(failed.sum(), (doubt & ~failed).sum(), (~doubt).sum()) > 30


@pytest.mark.parametrize("width", [4, 8, 12, 28])
def test_the_columns_a_picture_is_cut_at_do_not_change_a_bit(width: int) -> None:
    known = problem(4)
    for found, expected in zip(fit(known, *cut(known, width)), fit(known), strict=True):
        np.testing.assert_array_equal(found, expected)


def test_saturated_and_dark_observations_are_left_out_whatever_their_value() -> None:
    images, A, white, Ts, *others = problem(5)
    dark, over = images < Ts, images >= white[:, None, None]
    assert (images == Ts).any()
    assert min(dark.mean(), over.mean()) > 0.01
    expected = fit((images, A, white, Ts, *others))
    for low, high in ((-1, 0.7), (0.0999, 0.9), (0, 50)):
        other = np.where(dark, f32(low), np.where(over, f32(high), images))
        for found, right in zip(fit((other, A, white, Ts, *others)), expected, strict=True):
            np.testing.assert_array_equal(found, right)
    never = np.full_like(white, np.inf)
    for levels in ((never, Ts), (white, f32(-1)), (white, f32(0.3))):
        assert (fit((images, A, *levels, *others))[0] != expected[0]).any()


def lone(K: int = 9, weight: float = 1.0) -> tuple[Problem, Array]:
    """One pixel, exactly diffuse, in a block of 3 x 3, and its bases."""
    A = np.random.default_rng(6).normal(size=(3, K))
    A[0] = 1
    bases = np.array([0.5, 0.05, -0.05])
    images = (bases @ A).astype(f32).reshape(K, 1, 1)
    weights, white = np.full((K, 1, 1), weight, f32), np.full(K, np.inf, f32)
    return (images, A.astype(f32), white, f32(0.01), weights, 3, f32(0.02), f32(0.01)), bases


@pytest.mark.parametrize(
    ("K", "weight", "enough"), [(3, 1, False), (4, 1, True), (9, 0.38, False), (9, 0.4, True)]
)
def test_a_pixel_is_fitted_from_a_weight_of_three_and_a_half(
    K: int, weight: float, enough: bool
) -> None:
    """One that is not is 0 and doubted; it keeps the votes of what is lit."""
    known, right = lone(K, weight)
    bases, lead, doubt = fit(known)
    np.testing.assert_allclose(bases[:, 0, 0], right if enough else 0, atol=1e-5)
    assert (lead.item(), doubt.item()) == (K * (1 + enough), not enough)


def test_factors_in_a_plane_determine_nothing() -> None:
    images, A, *others = problem(7)
    A[2] = A[0] - 2 * A[1]
    bases, _, doubt = fit((images, A, *others))
    assert (bases == 0).all()
    assert doubt.all()


@pytest.mark.parametrize("weight", [0, 0.49])
@pytest.mark.parametrize(
    ("excess", "doubted"), [(0.03, False), (0.009, False), (-0.009, False), (-0.02, True)]
)
def test_where_a_highlight_was_seen_only_what_is_too_dark_is_doubted(
    weight: float, excess: float, doubted: bool
) -> None:
    """A weight below a half lets the observation be as bright as it likes."""
    known, _ = lone(60)
    known[4][3], known[0][3] = weight, known[0][3] + f32(excess)
    _, lead, doubt = fit(known)
    assert doubt.item() == doubted
    assert lead.item() == 120 - (abs(excess) > 0.01)


@pytest.mark.parametrize(("excess", "doubted"), [(0.03, True), (0.009, False), (-0.03, True)])
@pytest.mark.parametrize("weight", [0.51, 1])
def test_where_no_highlight_was_seen_both_sides_are_doubted(
    excess: float, doubted: bool, weight: float
) -> None:
    known, _ = lone(60)
    known[4][3], known[0][3] = weight, known[0][3] + f32(excess)
    assert fit(known)[2].item() == doubted


def test_what_is_lit_though_it_faces_away_is_doubted() -> None:
    """However bright, and whatever was seen there: the light would be behind the surface."""
    known, right = lone(12)
    images, A, *_, weights, _, _, _ = known
    A[:, 3], weights[3] = -2 * right, 0
    for bright, doubted in ((0.3, True), (0.0, False)):
        images[3] = bright
        _, lead, doubt = fit(known)
        assert (lead.item(), doubt.item()) == (22 + (bright > 0), doubted)
