"""The sampled pixels: which, how many, and in both orders."""

import numpy as np
import pytest
from lambert import lambertian, wrap

from photolin.sample import draw_sample


def numbered(mask: np.ndarray) -> np.ndarray:
    """(6,H,W) images whose value tells image and pixel."""
    pixel = np.arange(1, mask.size + 1).reshape(mask.shape)
    return (pixel + mask.size * np.arange(6)[:, None, None]) / (7 * mask.size)


@pytest.mark.parametrize("count", [1, 50, 10_000])
def test_a_sample_holds_different_mask_pixels_in_order_and_both_layouts(count: int) -> None:
    mask = np.arange(400).reshape(20, 20) % 3 == 0
    s = draw_sample(wrap(numbered(mask), mask), seed=1, count=count)
    assert s.images.shape == (6, min(count, mask.sum()))
    np.testing.assert_array_equal(s.pixels, s.images.T)
    assert s.pixels.flags.c_contiguous
    assert s.images.flags.c_contiguous
    pixels = np.rint(s.images[0] * 7 * 400).astype(int) - 1
    np.testing.assert_array_equal(s.places, pixels)
    assert (np.diff(pixels) > 0).all()
    assert mask.ravel()[pixels].all()
    np.testing.assert_array_equal(s.images, numbered(mask).reshape(6, -1)[:, pixels].astype("f4"))


def test_the_seed_decides_which_pixels() -> None:
    stack, _ = lambertian()
    one, same, other = (draw_sample(stack, seed, count=100).images for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert (one != other).any()


def test_a_sample_covers_the_whole_picture() -> None:
    s = draw_sample(wrap(numbered(np.ones((40, 40), bool))), seed=0, count=400)
    quarters = np.histogram(s.images[0], 4)[0]
    assert (quarters > 70).all()


@pytest.mark.parametrize(("count", "left"), [(7, 8), (50, 50), (51, 100), (100, 100), (999, 100)])
def test_thinning_keeps_evenly_spaced_pixels(count: int, left: int) -> None:
    s = draw_sample(lambertian()[0], 0, count=100)
    thin = s.thin(count)
    assert thin.images.shape[1] == left
    np.testing.assert_array_equal(thin.pixels, thin.images.T)
    np.testing.assert_array_equal(thin.places, s.places[:: 100 // min(count, 100)])
    np.testing.assert_array_equal(thin.images, s.images[:, :: 100 // min(count, 100)])
