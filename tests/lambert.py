"""Stacks of nothing but diffuse reflection, whose linearization is known: the input itself."""

import numpy as np

from photolin.stack import ImageStack


def lambertian(
    count: int = 10,
    size: tuple[int, int] = (24, 30),
    seed: int = 0,
    *,
    flat: bool = False,
    coplanar: bool = False,
) -> tuple[ImageStack, np.ndarray]:
    """A relief lit everywhere by `count` lights, without shadows, highlights or noise.

    Args:
        flat: all surface directions are the same.
        coplanar: all lights lie in one plane.

    Returns:
        The stack, its intensities between 0.15 and 0.95, and its lights (count,3).
    """
    rng = np.random.default_rng(seed)
    H, W = size
    normals = rng.uniform(-0.45, 0.45, (H * W, 3)) * (not flat)
    normals[:, 2] = 1
    normals *= (rng.uniform(0.5, 0.9, H * W) / np.linalg.norm(normals, axis=1))[:, None]
    lights = rng.uniform(-0.6, 0.6, (count, 3)) * (1, not coplanar, 1)
    lights[:, 2] = 1
    lights *= (rng.uniform(0.8, 1, count) / np.linalg.norm(lights, axis=1))[:, None]
    images = (lights @ normals.T).reshape(count, H, W).astype(np.float32)
    return wrap(images), lights


def wrap(images: np.ndarray, mask: np.ndarray | None = None) -> ImageStack:
    """A stack of images (K,H,W), numbered."""
    if mask is None:
        mask = np.ones(images.shape[1:], bool)
    names = tuple(f"{k:03d}.png" for k in range(len(images)))
    return ImageStack(images.astype(np.float32), mask, names)
