"""Albedo of one channel: the truth of a painted surface, and what has no say."""

import numpy as np
import pytest

from photolin.errors import InputError
from photolin.factors import Factor
from photolin.shape.colour import colour_albedo

K, H, W = 9, 6, 8
D = Factor.DIFFUSE


def painted() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Normals, lights, labels, images and albedo; all lit and D."""
    rng = np.random.default_rng(0)
    normals = rng.uniform(-0.3, 0.3, (H, W, 3))
    normals[..., 2] = 1
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    lights = rng.uniform(-0.4, 0.4, (K, 3)) + np.eye(3)[2]
    lights *= rng.uniform(0.5, 2, (K, 1))
    albedo = rng.uniform(0.1, 0.9, (H, W))
    images = albedo * np.tensordot(lights, normals, (1, 2))
    return normals, lights, np.full((K, H, W), D, np.uint8), images, albedo


def test_albedo_is_the_truth() -> None:
    *known, albedo = painted()
    found = colour_albedo(*known)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, albedo, rtol=1e-6)


def test_brightness_and_powers_scale_it() -> None:
    normals, lights, labels, images, albedo = painted()
    found = colour_albedo(normals, 4 * lights, labels, 10 * images)
    np.testing.assert_allclose(found, 2.5 * albedo, rtol=1e-6)


def test_it_is_least_squares() -> None:
    normals, lights, labels, images, _ = painted()
    images = images + np.random.default_rng(1).normal(0, 0.1, images.shape)
    found = colour_albedo(normals, lights, labels, images)
    shading = np.tensordot(lights, normals, (1, 2))
    right = np.linalg.lstsq(shading[:, 2, 3][:, None], images[:, 2, 3])[0]
    np.testing.assert_allclose(found[2, 3], right[0], rtol=1e-6)


@pytest.mark.parametrize("code", [0, 2, 3, 4])
def test_only_d_observations_have_a_say(code: int) -> None:
    normals, lights, labels, images, albedo = painted()
    images[2:5], labels[2:5] = 7, code
    np.testing.assert_allclose(colour_albedo(normals, lights, labels, images), albedo, rtol=1e-6)


def test_saturated_observations_have_none() -> None:
    normals, lights, labels, images, albedo = painted()
    cut = np.minimum(images, 0.6)
    assert 0.05 < (cut == 0.6).mean() < 0.6
    found = colour_albedo(normals, lights, labels, cut, np.full(K, 0.6))
    left = (cut < 0.6).any(axis=0)
    np.testing.assert_allclose(found[left], albedo[left], rtol=1e-6)
    assert np.isnan(found[~left]).all()
    assert (colour_albedo(normals, lights, labels, cut)[left] < albedo[left] - 1e-3).any()


def test_lights_from_behind_or_along_the_surface_have_none() -> None:
    normals, lights, labels, images, albedo = painted()
    lights[0] *= -1
    lights[1] = (1, 0, 0)  # up to 17 degrees before or behind the surface
    normals[..., 0] = np.minimum(normals[..., 0], 0.04)
    images = albedo * np.tensordot(lights, normals, (1, 2))
    images[:2] = 3
    np.testing.assert_allclose(colour_albedo(normals, lights, labels, images), albedo, rtol=1e-6)


def test_unknown_is_nan_and_outside_is_zero() -> None:
    normals, lights, labels, images, _ = painted()
    normals[0, 0], labels[:, 1, 1], labels[:, 2, 2] = np.nan, 255, Factor.CAST
    normals[3, 3], labels[:, 3, 3] = np.nan, 255
    found = colour_albedo(normals, lights, labels, images)
    assert np.isnan(found[[0, 2], [0, 2]]).all()
    assert (found[[1, 3], [1, 3]] == 0).all()
    assert np.isfinite(found).sum() == H * W - 2


@pytest.mark.parametrize("which", range(4))
def test_shapes_that_do_not_belong_together_are_refused(which: int) -> None:
    *known, _ = painted()
    known[which] = known[which][1:]
    with pytest.raises(InputError, match="are accepted for labels of"):
        colour_albedo(*known)
    with pytest.raises(InputError, match="are accepted for labels of"):
        colour_albedo(*painted()[:4], np.ones(K - 1))
