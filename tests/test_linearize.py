"""Step 2: bases of every pixel, exact without disturbance, and laws of the mask and the seed."""

from dataclasses import replace

import numpy as np
import pytest
from lambert import lambertian, wrap

from photolin import linearize as module
from photolin.analysis import METHODS, Method, Options
from photolin.errors import Cancelled, DegenerateError
from photolin.factors import Thresholds
from photolin.linearize import linearize
from photolin.stack import ImageStack

BASES = (1, 4, 8)
THRESHOLDS = Thresholds(0.02, 0.01)


def coefficients(lights: np.ndarray) -> np.ndarray:
    return lights @ np.linalg.inv(lights[list(BASES)])


def run(stack: ImageStack, lights: np.ndarray, method: Method, seed: int = 0) -> np.ndarray:
    options = Options(method=method, seed=seed, samples=200)
    return linearize(stack, coefficients(lights), BASES, THRESHOLDS, options)[0]


@pytest.mark.parametrize("method", METHODS)
def test_diffuse_bases_are_linearized_to_themselves(method: Method) -> None:
    stack, lights = lambertian()
    bases = run(stack, lights, method)
    assert bases.dtype == np.float32
    # least squares loses rounding alone; the published winner may be an ill-conditioned sample
    tolerance = 1e-6 if method == "robust" else 1e-4
    np.testing.assert_allclose(bases, stack.images[list(BASES)], atol=tolerance)


@pytest.mark.parametrize("method", METHODS)
def test_outside_the_mask_all_is_zero_and_inside_nothing_changes(method: Method) -> None:
    stack, lights = lambertian()
    mask = np.random.default_rng(0).random(stack.mask.shape) > 0.4
    whole, masked = (run(s, lights, method) for s in (stack, replace(stack, mask=mask)))
    assert (masked[:, ~mask] == 0).all()
    np.testing.assert_array_equal(masked[:, mask], whole[:, mask])


@pytest.mark.parametrize("method", METHODS)
def test_neither_threads_nor_block_size_change_a_bit(
    method: Method, monkeypatch: pytest.MonkeyPatch
) -> None:
    stack, lights = lambertian()
    noisy = wrap(stack.images * np.random.default_rng(0).uniform(0.9, 1, stack.shape))
    c, options = coefficients(lights), Options(method=method, samples=50)
    expected = linearize(noisy, c, BASES, THRESHOLDS, options)
    for threads, block in ((1, 10**6), (3, 7), (2, 100)):
        monkeypatch.setattr(module, "BLOCK", block)
        found = linearize(noisy, c, BASES, THRESHOLDS, options, threads=threads)
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_array_equal(one, other)


def test_highlights_and_shadows_are_seen_through_and_negatives_kept() -> None:
    rng = np.random.default_rng(0)
    stack, lights = lambertian(14)
    lights[1] = (-1.5, 0, 0.3)  # a grazing base image: part of the relief faces away
    ideal = stack.images.reshape(14, -1)
    v = np.linalg.lstsq(lights[2:], ideal[2:].astype(float))[0]
    ideal = (lights @ v).astype(np.float32)
    images = np.maximum(ideal, 0)
    images[(rng.random(images.shape) < 0.15) & (images > 0)] += 0.1
    images[rng.random(images.shape) < 0.1] = 0
    stack = wrap(np.minimum(images, 1).reshape(14, 24, 30))
    c = coefficients(lights)
    found = c @ run(stack, lights, "robust").reshape(3, -1)
    assert (ideal < -0.02).sum() > 20
    error = np.abs(found - ideal)
    assert np.quantile(error, 0.97) < 1e-4
    assert (found[ideal < -0.02] < 0).mean() > 0.95


def test_a_pixel_lit_in_two_images_is_undetermined_for_robust_alone() -> None:
    stack, lights = lambertian()
    images = stack.images.copy()
    images[2:, 3, 4] = 0
    for method in METHODS:
        bases = run(wrap(images), lights, method)
        expected = [[r, 3, 4] for r in range(3)] if method == "robust" else []
        assert np.argwhere(np.isnan(bases)).tolist() == expected


def test_the_published_methods_never_sample_the_base_images() -> None:
    """Spoiling them changes nothing of the earlier method, which scores no support."""
    stack, lights = lambertian()
    images = stack.images.copy()
    images[list(BASES)] = 0.5
    one, other = (run(s, lights, "statistical") for s in (stack, wrap(images)))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("method", METHODS)
def test_a_pixel_of_known_albedo_scales_with_it(method: Method) -> None:
    """Exactly: half the albedo is half of every observation, a power of two changes no rounding."""
    stack, lights = lambertian()
    one, half = (run(s, lights, method) for s in (stack, wrap(stack.images / 2)))
    np.testing.assert_array_equal(half, one / 2)


@pytest.mark.parametrize("method", ["classification", "statistical"])
def test_other_images_with_lights_in_a_plane_are_refused(method: Method) -> None:
    stack, lights = lambertian()
    flat = lights.copy()
    others = np.setdiff1d(np.arange(10), BASES)
    flat[others, 1] = 0
    with pytest.raises(
        DegenerateError,
        match=r"coefficients lie in one plane, as with too small a T \(it is 0.02; .* add images",
    ):
        run(stack, flat, method)


@pytest.mark.parametrize("method", METHODS)
def test_it_can_be_cancelled(method: Method) -> None:
    stack, lights = lambertian()
    with pytest.raises(Cancelled, match="linearize was cancelled"):
        linearize(
            stack,
            coefficients(lights),
            BASES,
            THRESHOLDS,
            Options(method=method),
            cancel=lambda: True,
        )


def test_large_margins_are_cut_off_rather_than_turned_over(monkeypatch: pytest.MonkeyPatch) -> None:
    stack, lights = lambertian()
    lead = np.full(720, 70_000, np.int32)
    monkeypatch.setattr(module, "linearize_robustly", lambda *_: (np.zeros((3, 24, 30)), lead))
    _, margin = linearize(stack, coefficients(lights), BASES, THRESHOLDS, Options())
    assert margin.dtype == np.uint16
    assert (margin == 65_535).all()
