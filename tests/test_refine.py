"""Weighted factorization: its step against finite differences, the noise it reads, refusals."""

from statistics import NormalDist

import numpy as np
import pytest
from lambert import lambertian, wrap

from photolin.errors import DegenerateError
from photolin.evaluate import light_error
from photolin.factorize import NO_NOISE, Noise, orthogonalize
from photolin.refine import (
    MAX_T,
    MIN_T,
    WITHIN,
    change_of_span,
    follow_noise,
    gauss_newton_step,
    measure_noise,
    refine_coefficients,
)
from photolin.sample import draw_sample


def problem() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Noisy observations X (M,K), weights W (M,K) with zeros, coefficients (K,3)."""
    rng = np.random.default_rng(0)
    c = rng.normal(size=(9, 3))
    X = (rng.normal(size=(200, 3)) @ c.T + rng.normal(0, 0.05, (200, 9))).astype(np.float32)
    W = rng.random((200, 9)) * (rng.random((200, 9)) > 0.3)
    return X, W, orthogonalize(c + rng.normal(0, 0.05, c.shape))


def loss(X: np.ndarray, W: np.ndarray, c: np.ndarray) -> float:
    """Sum of W (X - b c)^2 with the best b of every pixel, by lstsq."""
    total = 0.0
    for x, w in zip(X, np.sqrt(W), strict=True):
        if np.count_nonzero(w) >= 3:
            b = np.linalg.lstsq(w[:, None] * c, w * x)[0]
            total += float(np.sum((w * x - w * (c @ b)) ** 2))
    return total


def test_steps_end_where_no_small_change_lowers_the_loss() -> None:
    X, W, c = problem()
    losses = [loss(X, W, c)]
    for _ in range(6):
        c = orthogonalize(gauss_newton_step(X, W, c))
        losses.append(loss(X, W, c))
    assert losses[1] < losses[0]
    assert losses[-2] - losses[-1] < 1e-6 * losses[-1]
    rng = np.random.default_rng(1)
    for _ in range(10):
        way = rng.normal(size=c.shape) * 1e-3
        up, down = loss(X, W, c + way), loss(X, W, c - way)
        assert min(up, down) > losses[-1]
        assert abs(up - down) < 0.05 * (up + down - 2 * losses[-1])


def test_the_change_of_a_span_is_zero_for_the_same_and_one_for_another() -> None:
    c = orthogonalize(np.random.default_rng(0).normal(size=(9, 3)))
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    assert change_of_span(c, c @ turn) == pytest.approx(0, abs=1e-12)
    other = np.linalg.qr(c, mode="complete")[0][:, 3:6] * np.linalg.norm(c[:, 0])
    assert change_of_span(c, other) == pytest.approx(1)


def test_noisy_diffuse_images_are_solved_as_well_as_their_noise_allows() -> None:
    stack, lights = lambertian(14)
    noisy = stack.images * np.random.default_rng(0).normal(1, 0.01, stack.shape)
    start = lights + np.random.default_rng(1).normal(0, 0.03, lights.shape)
    sample = draw_sample(wrap(np.clip(noisy, 0, 1)), 0)
    found = refine_coefficients(sample, start, 0.01, 0, 500)
    assert found.noise.relative == pytest.approx(0.01, rel=0.2)
    assert light_error(start, lights) > 1
    assert light_error(found.coefficients, lights) < 0.2


@pytest.mark.parametrize("seed", [1, 2, 4])
def test_bases_and_coefficients_explain_the_images_even_where_directions_are_noise(
    seed: int,
) -> None:
    """There the last step turns the frame: bases left behind in the one before explain nothing."""
    stack, lights = lambertian(14, flat=True)
    rng = np.random.default_rng(seed)
    noisy = stack.images + rng.normal(0, 0.005, stack.shape)
    sample = draw_sample(wrap(np.clip(noisy, 0, 1)), 0)
    start = lights + rng.normal(0, 0.03, lights.shape)
    found = refine_coefficients(sample, start, 0.01, 0, 500)
    excess = np.abs(found.coefficients @ found.bases - sample.images)
    assert np.median(excess) < 0.005


def test_the_tolerance_is_the_tail_of_the_noise_within_bounds() -> None:
    assert follow_noise(Noise(0.7, 0.7, 0.05)) == 0.05
    assert follow_noise(NO_NOISE) == MIN_T
    assert follow_noise(Noise(0.01, 0.01, 1)) == MAX_T


def read_noise(i: np.ndarray, l: np.ndarray, T: float) -> Noise:
    """Noise of observations (40,M) of a fit l, which has one light for all."""
    bases = np.concatenate([l[:1], np.zeros((2, l.shape[1]))]).astype(np.float32)
    return measure_noise(i.astype(np.float32), np.tile([1.0, 0, 0], (40, 1)), bases, T, 0.02)


def test_noise_is_read_below_the_fit_only_and_from_lit_pixels() -> None:
    rng = np.random.default_rng(0)
    l = np.full((40, 2500), 0.5)
    i = l * (1 + rng.normal(0, 0.01, l.shape))
    i[:16] += 0.2  # highlights
    i[16:20] = 0.001  # shadows
    noise = read_noise(i, l, 0.1)
    taken = np.sqrt(20 / 17)  # twenty near the fit, which has three unknowns
    assert noise.relative == pytest.approx(0.01 * taken, rel=0.03)
    assert noise.absolute == pytest.approx(0.005 * taken, rel=0.03)
    tail = 0.01 * taken * NormalDist().inv_cdf(0.5 + WITHIN / 2)
    assert noise.tail == pytest.approx(tail, rel=0.03)


@pytest.mark.parametrize("lit", [4, 6, 20])
def test_noise_is_read_right_however_few_images_a_pixel_is_lit_in(lit: int) -> None:
    """Residuals of a fit to four observations are half the noise."""
    rng = np.random.default_rng(0)
    c = rng.normal((0, 0, 4), 1, (lit, 3))
    l = c @ rng.uniform(0.05, 0.1, (3, 20_000))
    i = (l + rng.normal(0, 0.002, l.shape)).astype(np.float32)
    noise = measure_noise(i, c, np.linalg.lstsq(c, i)[0].astype(np.float32), 0.1, 0.02)
    assert noise.absolute == pytest.approx(0.002, rel=0.2)


def test_pixels_that_fit_whatever_they_are_tell_no_noise() -> None:
    l = np.full((3, 50), 0.5, np.float32)
    bases = np.concatenate([l[:1] + 0.01, np.zeros((2, 50), np.float32)])
    assert measure_noise(l, np.tile([1.0, 0, 0], (3, 1)), bases, 0.1, 0.02) == NO_NOISE


def test_noise_of_one_size_is_read_from_the_bright_and_its_tail_beyond_the_tolerance() -> None:
    """T i cuts off the noise of dim observations, so that they would show too little of it."""
    rng = np.random.default_rng(0)
    l = np.tile(np.concatenate([np.full(1250, 0.1), np.full(1250, 0.8)]), (40, 1))
    noise = read_noise(l + rng.normal(0, 0.01, l.shape), l, 0.04)
    assert noise.absolute == pytest.approx(0.01 * np.sqrt(40 / 37), rel=0.05)
    assert noise.relative < 0.02
    assert noise.tail > 0.05


def test_where_nothing_is_below_the_fit_there_is_no_noise() -> None:
    nothing = np.zeros((3, 5), np.float32)
    assert measure_noise(nothing, np.eye(3), nothing, 0.1, 0.0) == NO_NOISE
    unknown = np.full((3, 5), np.nan, np.float32)
    assert measure_noise(nothing + 1, np.eye(3), unknown, 0.1, 0.0) == NO_NOISE


def test_observations_that_determine_nothing_are_refused() -> None:
    """Each pixel is lit in three images: any coefficients fit."""
    stack, lights = lambertian(8)
    images = stack.images.reshape(8, -1).copy()
    rng = np.random.default_rng(0)
    for pixel in images.T:
        pixel[rng.permutation(8)[3:]] = 0
    sample = draw_sample(wrap(images.reshape(stack.shape)), 0)
    with pytest.raises(DegenerateError, match="no base images explain the others"):
        refine_coefficients(sample, lights, 0.01, 0, 500)


def test_a_step_from_pixels_that_determine_nothing_stays_where_it_is() -> None:
    c = orthogonalize(np.random.default_rng(0).normal(size=(7, 3)))
    X = np.full((5, 7), 0.5, np.float32)
    for weights in (np.zeros((5, 7)), np.eye(5, 7)):
        np.testing.assert_array_equal(gauss_newton_step(X, weights, c), c)
