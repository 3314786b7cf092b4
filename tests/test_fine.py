"""Large pictures: which pixels stand for their blocks, and what the fit of all others makes of it.

What the compiled loop does with a band is in `test_kernels_fine.py`.
"""

from dataclasses import replace

import numpy as np
import pytest
from lambert import lambertian

from photolin import fine as module
from photolin.errors import Cancelled
from photolin.factorize import orthogonalize
from photolin.fine import COARSE_PIXELS, choose_step, fit_fine, thin_out
from photolin.observations import Observations

f32 = np.float32
Array = np.ndarray
K, SIZE, STEP, T = 12, (22, 31), 4, 0.02
BLOCKS = (K, 6, 8)


def relief(noise: float = 0.0) -> tuple[Observations, Array]:
    """Diffuse observations, and the bases of those without noise."""
    stack, lights = lambertian(K, SIZE)
    images = stack.images + np.random.default_rng(1).normal(0, noise, stack.shape)
    factors = np.ascontiguousarray(orthogonalize(lights).T, f32)
    bases = (np.tensordot(factors, stack.images, 1) * 3 / K).astype(f32)
    white = np.full(K, np.inf, f32)
    seen = Observations(images.astype(f32), stack.mask, factors, white, 0.01, 0.001, 0.9)
    return seen, bases


def mixed() -> tuple[Observations, Array]:
    """Noise, sparks, shadows, a mask; and weights of blocks."""
    seen, _ = relief(0.005)
    rng = np.random.default_rng(0)
    wrong = rng.random(seen.images.shape)
    seen.images[wrong < 0.01] += 0.3
    seen.images[wrong > 0.95] = 0
    return replace(seen, mask=rng.random(SIZE) > 0.2), rng.random(BLOCKS).astype(f32)


def clear() -> Array:
    """No highlight was seen anywhere."""
    return np.ones(BLOCKS, f32)


# Which pixels stand for others


@pytest.mark.parametrize(
    ("pixels", "step"),
    [
        (0, 1),
        (1, 1),
        (20_000, 1),
        (44_999, 1),
        (45_001, 2),
        (80_000, 2),
        (124_999, 2),
        (125_001, 3),
        (512 * 512, 4),
        (10**6, 7),
        (24 * 10**6, 35),
    ],
)
def test_the_step_leaves_about_as_many_pixels_as_wanted(pixels: int, step: int) -> None:
    assert choose_step(pixels) == step
    if step > 1:
        assert 0.5 < pixels / step**2 / COARSE_PIXELS < 1.6


@pytest.mark.parametrize("step", [1, 2, 3, 4, 5, 7, 22, 40])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.7, 1.0])
def test_a_block_is_its_centre_or_another_pixel_of_the_mask(step: int, share: float) -> None:
    """Images tell the place of each pixel; blocks at the right and the bottom may lack a centre."""
    seen, _ = relief()
    H, W = SIZE
    places = np.arange(H * W).reshape(H, W) + H * W * np.arange(K)[:, None, None]
    mask = np.random.default_rng(0).random(SIZE) < share
    thin = thin_out(replace(seen, images=places.astype(f32), mask=mask), step)
    assert thin.images.shape == (K, -(-H // step), -(-W // step))
    assert (thin.images.dtype, thin.mask.dtype) == (f32, bool)
    np.testing.assert_array_equal(thin.images - thin.images[0], places[:, :1, :1] + 0 * thin.images)
    for (i, j), there in np.ndenumerate(thin.mask):
        rows, columns = (slice(at * step, (at + 1) * step) for at in (i, j))
        block, inside = places[0, rows, columns], mask[rows, columns]
        assert there == inside.any()
        if there:
            row, column = np.argwhere(block == thin.images[0, i, j])[0]
            assert inside[row, column]
            middle = step // 2
            if middle < len(inside) and middle < len(inside[0]) and inside[middle, middle]:
                assert (row, column) == (middle, middle)


def test_what_is_known_of_all_observations_stays_and_a_step_of_one_changes_nothing() -> None:
    seen, _ = mixed()
    thin = thin_out(seen, 3)
    for name in ("factors", "white", "Ts", "noise", "bright"):
        assert getattr(thin, name) is getattr(seen, name)
    same = thin_out(seen, 1)
    np.testing.assert_array_equal(same.images, seen.images)
    np.testing.assert_array_equal(same.mask, seen.mask)


# The fit of all pixels


def test_diffuse_pixels_are_exact_and_nobody_doubts() -> None:
    seen, right = relief()
    bases, lead, doubtful = fit_fine(seen, clear(), STEP, T)
    np.testing.assert_allclose(bases, right, atol=1e-6)
    assert (bases.dtype, lead.dtype, lead.shape) == (f32, np.int32, SIZE)
    assert (lead == 2 * K).all()
    assert doubtful.size == 0


@pytest.mark.parametrize("pixel", [(0, 0), (9, 14), (21, 30)])
def test_a_pixel_is_doubted_whose_spark_its_block_does_not_show(pixel: tuple[int, int]) -> None:
    """Where the block shows it, all pixels of the block do without that image, and are exact."""
    seen, right = relief()
    seen.images[2, *pixel] += 0.3
    doubtful = fit_fine(seen, clear(), STEP, T)[2]
    assert doubtful.tolist() == [pixel[0] * SIZE[1] + pixel[1]]
    weights = clear()
    weights[2, pixel[0] // STEP, pixel[1] // STEP] = 0
    bases, lead, doubtful = fit_fine(seen, weights, STEP, T)
    np.testing.assert_allclose(bases, right, atol=1e-6)
    assert doubtful.size == 0
    # twice those that are D, once the highlight
    assert lead[pixel] == 2 * K - 1
    assert (lead == 2 * K).sum() == lead.size - 1


def test_a_pixel_darker_than_possible_is_doubted_whatever_its_block_shows() -> None:
    seen, _ = relief()
    seen.images[5, 7, 8] *= f32(0.9)
    weights = clear()
    weights[5] = 0
    assert fit_fine(seen, clear(), STEP, T)[2].tolist() == [7 * SIZE[1] + 8]
    assert fit_fine(seen, weights, STEP, T)[2].tolist() == [7 * SIZE[1] + 8]


def test_shadows_and_saturated_observations_have_no_vote() -> None:
    seen, right = relief()
    seen.images[1, 7, 8], seen.images[2, 7, 8], seen.images[3, 7, 8] = 0, 0.009, 2
    seen.white[3] = 2
    bases, lead, doubtful = fit_fine(seen, clear(), STEP, T)
    np.testing.assert_allclose(bases, right, atol=1e-6)
    assert doubtful.size == 0
    assert lead[7, 8] == 2 * (K - 3)


def test_noise_as_large_as_it_is_known_to_be_raises_no_doubt() -> None:
    """4 times its standard deviation is rare; half as much is not."""
    seen, _ = relief(0.005)
    doubted = [
        len(fit_fine(replace(seen, noise=noise), clear(), STEP, 1e-3)[2]) / seen.mask.size
        for noise in (0.005, 0.0025)
    ]
    assert doubted[0] < 0.01
    assert doubted[1] > 0.2


def test_too_few_observations_are_doubted_and_left_at_zero() -> None:
    seen, _ = relief()
    seen.images[3:, 7, 8] = 0
    bases, _, doubtful = fit_fine(seen, clear(), STEP, T)
    assert doubtful.tolist() == [7 * SIZE[1] + 8]
    assert (bases[:, 7, 8] == 0).all()


def test_outside_the_mask_all_is_zero_and_nothing_doubted_and_inside_nothing_changes() -> None:
    seen, weights = mixed()
    mask = seen.mask
    bases, lead, doubtful = fit_fine(seen, weights, STEP, T)
    assert (bases[:, ~mask] == 0).all()
    assert mask.reshape(-1)[doubtful].all()
    whole = fit_fine(replace(seen, mask=np.ones(SIZE, bool)), weights, STEP, T)
    np.testing.assert_array_equal(bases[:, mask], whole[0][:, mask])
    np.testing.assert_array_equal(lead[mask], whole[1][mask])
    np.testing.assert_array_equal(doubtful, whole[2][mask.reshape(-1)[whole[2]]])
    assert 0.05 * mask.sum() < len(doubtful) < 0.95 * mask.sum()


@pytest.mark.parametrize("step", [1, 3, STEP, 7])
def test_neither_threads_nor_columns_change_a_bit(
    step: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen, _ = mixed()
    h, w = thin_out(seen, step).mask.shape
    weights = np.random.default_rng(3).random((K, h, w)).astype(f32)
    expected = fit_fine(seen, weights, step, T, threads=1)
    for threads, columns in ((2, 512), (3, 1), (1, 9), (2, 16)):
        monkeypatch.setattr(module, "COLUMNS", columns)
        for found, right in zip(fit_fine(seen, weights, step, T, threads), expected, strict=True):
            np.testing.assert_array_equal(found, right)


# Progress and cancellation


def test_progress_rises_to_one_within_the_stage() -> None:
    told: list[tuple[str, float]] = []
    fit_fine(*mixed(), STEP, T, progress=lambda stage, done: told.append((stage, done)))
    assert {stage for stage, _ in told} == {"linearize"}
    shares = [0, *(done for _, done in told)]
    assert shares[-1] == 1
    assert (np.diff(shares) > 0).all()


@pytest.mark.parametrize("after", [0, 2])
def test_it_can_be_cancelled(after: int) -> None:
    asked: list[int] = []
    with pytest.raises(Cancelled, match="linearize was cancelled"):
        fit_fine(*mixed(), STEP, T, cancel=lambda: asked.append(1) or len(asked) > after)
