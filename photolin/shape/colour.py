"""Albedo in colour, once normals and lights are known."""

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..factors import OUTSIDE, Factor

LEAST = 0.05
"""Cosine of the angle of incidence below which a light says nothing of albedo."""


def colour_albedo(
    normals: NDArray[np.floating],
    lights: NDArray[np.floating],
    labels: NDArray[np.uint8],
    images: NDArray[np.floating],
    white: NDArray[np.floating] | None = None,
) -> NDArray[np.float32]:
    """Albedo of one channel by least squares on D observations: i_k = albedo · (n·s_k).

    Call it for each of `photolin.load.load_channels` and stack the three: highlights, which have
    the colour of the light, and shadows are left out.

    Args:
        normals: (H,W,3) unit, x right, y up, z to the camera; NaN where unknown.
        lights: (K,3) direction towards the light times power, in the frame of the normals.
        labels: (K,H,W) Factor codes of the gray stack.
        images: (K,H,W) of one channel, linear, in any unit.
        white: (K,) value from which an observation of this channel is saturated and left out.

    Returns:
        (H,W) in the unit of the images over that of the lights; NaN where the normal is, or where
        no D observation is left; 0 outside the mask.

    Raises:
        InputError: shapes that do not belong together.
    """
    K, H, W = labels.shape
    shapes = (normals.shape, lights.shape, images.shape, None if white is None else white.shape)
    if shapes[:3] != ((H, W, 3), (K, 3), (K, H, W)) or shapes[3] not in (None, (K,)):
        raise InputError(
            f"normals, lights, images and white have shapes {shapes[0]}, {shapes[1]}, {shapes[2]} "
            f"and {shapes[3]}; {(H, W, 3)}, {(K, 3)}, {(K, H, W)} and {(K,)} are accepted for "
            f"labels of {K} images of {H} x {W}"
        )
    seen, squares = np.zeros((H, W)), np.zeros((H, W))
    powers = np.linalg.norm(lights, axis=1)
    for k in range(K):
        cosine = np.einsum("hwc,c->hw", normals, lights[k])
        with np.errstate(invalid="ignore"):
            used = (labels[k] == Factor.DIFFUSE) & (cosine > LEAST * powers[k])
        if white is not None:
            used &= images[k] < white[k]
        shading = np.where(used, cosine, 0)
        seen += shading * images[k]
        squares += shading**2
    albedo = np.divide(seen, squares, out=np.full((H, W), np.nan), where=squares > 0)
    return np.where(labels[0] == OUTSIDE, 0, albedo).astype(np.float32)
