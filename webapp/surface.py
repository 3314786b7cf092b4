"""Pictures of a shape: albedo, normals, depth, and the scene under a light of one's own. Pure."""

import numpy as np
from numpy.typing import NDArray

from photolin.shape.recover import Shape
from photolin.shape.relight import relight

from .state import Layer

UNKNOWN = 128
"""Grey of pixels without a normal."""


def render_surface(
    shape: Shape, layer: Layer, light: tuple[float, float], mask: NDArray[np.bool_]
) -> tuple[NDArray[np.uint8], str]:
    """A picture (H,W) or (H,W,3) of a shape, and what its greys or colours mean.

    Args:
        layer: albedo, normals, depth or relit.
        light: x (right) and y (up) of the unit direction of the light of `relit`.
        mask: (H,W)
    """
    if layer == "normals":
        return render_normals(shape.normals, mask), (
            "normals: red x right, green y up, blue z to the camera, 128 is 0"
        )
    if layer == "depth" and shape.depth is not None:
        z = shape.lengths(shape.depth)
        low, high = range_of(z[np.isfinite(z)], 0.0)
        text = f"depth, black {low:.4g} to white {high:.4g} {shape.unit}, z to the camera"
        return render_grey((z - low) / max(high - low, 1e-12), mask), text
    bright = range_of(shape.albedo[mask], 1.0)[1]
    if layer == "relit":
        x, y = light
        z = float(np.sqrt(max(1 - x * x - y * y, 0)))
        lit = relight(shape, (x, y, z))
        text = f"relit from x {x:.2f} right, y {y:.2f} up, z {z:.2f} to the camera; drag the ball"
        return render_grey(np.maximum(lit, 0) / bright, mask), text
    if layer == "depth":
        return np.zeros(mask.shape, np.uint8), "depth was not computed"
    return render_grey(shape.albedo / bright, mask), f"albedo, white {bright:.3g}"


def render_normals(normals: NDArray[np.float32], mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Colours (H,W,3) of unit normals (H,W,3): -1 to 1 as 0 to 255 (OpenGL: green is up)."""
    picture = np.nan_to_num(normals * np.float32(127.5) + np.float32(128), nan=UNKNOWN)
    picture[~mask] = 0
    return np.clip(picture, 0, 255).astype(np.uint8, order="C")  # as encoders need it


def render_grey(values: NDArray[np.floating], mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Greys (H,W) of values from 0, black, to 1, white; unknown ones in the mask mid-grey."""
    picture = np.clip(np.nan_to_num(values * 255 + 0.5, nan=UNKNOWN), 0, 255)
    picture[~mask] = 0
    return picture.astype(np.uint8, order="C")  # as encoders need it


def range_of(values: NDArray[np.floating], least: float) -> tuple[float, float]:
    """0.5 and 99.5 percentile of the finite values; (0, `least` or 1) where there are none."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return 0.0, least or 1.0
    low, high = np.percentile(finite, (0.5, 99.5))
    return float(low), float(high) if high > 0 or least == 0 else least
