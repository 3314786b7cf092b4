"""Where a ray from the eye meets the relief. Pure."""

import re

import numpy as np
from numpy.typing import NDArray

STEPS_A_PIXEL = 4
MOST_STEPS = 50_000
_NUMBER = r"(-?[0-9]{1,9}(?:\.[0-9]{1,9})?)"
_RAY = re.compile("ray " + ",".join([_NUMBER] * 6))

Ray = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Eye and direction, each (column, row, height towards the camera) in pixels; the upper left corner
of the picture is column 0, row 0."""


def ray_in_text(text: str) -> Ray | None:
    """The ray that the page wrote as "ray column,row,height,column,row,height", or None."""
    found = _RAY.fullmatch(text)
    if found is None:
        return None
    numbers = np.array([float(number) for number in found.groups()])
    return numbers[:3], numbers[3:]


def meet_relief(depth: NDArray[np.float32], ray: Ray) -> tuple[int, int] | None:
    """The pixel (row, column) of the first point of a relief on a ray.

    Args:
        depth: (H,W) height towards the camera, pixels; NaN where there is no surface. Heights are
            those of pixel centres, linear between them.

    Returns:
        None where the ray meets nothing, or comes from behind.
    """
    eye, along = ray
    if not (along[2] < 0 and np.isfinite(depth).any()):
        return None
    start, stop = ((level - eye[2]) / along[2] for level in (np.nanmax(depth), np.nanmin(depth)))
    start = max(start - 1 / abs(along[2]), 0.0)
    length = np.hypot(along[0], along[1]) * (stop - start) * STEPS_A_PIXEL
    steps = int(np.clip(np.ceil(length), 8, MOST_STEPS))
    points = eye + np.linspace(start, stop + 1 / abs(along[2]), steps)[:, None] * along
    surface = heights(depth, points[:, 1] - 0.5, points[:, 0] - 0.5)
    below = np.flatnonzero(points[:, 2] <= surface)
    if not below.size:
        return None
    column, row = np.floor(points[below[0], :2]).astype(int)
    H, W = depth.shape
    return (int(np.clip(row, 0, H - 1)), int(np.clip(column, 0, W - 1)))


def heights(
    depth: NDArray[np.float32], rows: NDArray[np.float64], columns: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Heights (N,) between pixel centres, at whole rows and columns; NaN where none is."""
    H, W = depth.shape
    with np.errstate(invalid="ignore"):
        inside = (rows > -0.5) & (rows < H - 0.5) & (columns > -0.5) & (columns < W - 0.5)
    r, c = rows.clip(0, H - 1), columns.clip(0, W - 1)
    top, left = np.minimum(r.astype(int), max(H - 2, 0)), np.minimum(c.astype(int), max(W - 2, 0))
    bottom, right = np.minimum(top + 1, H - 1), np.minimum(left + 1, W - 1)
    v, u = r - top, c - left
    corners = ((top, left, (1 - v) * (1 - u)), (top, right, (1 - v) * u),
               (bottom, left, v * (1 - u)), (bottom, right, v * u))  # fmt: skip
    total, weight = np.zeros(len(rows)), np.zeros(len(rows))
    for i, j, w in corners:
        z = depth[i, j].astype(np.float64)
        known = np.isfinite(z) & (w > 0)
        total += np.where(known, w * np.nan_to_num(z), 0)
        weight += np.where(known, w, 0)
    # half of the surroundings or more: the surface does not reach beyond its pixels
    return np.where(inside & (weight >= 0.5), total / np.maximum(weight, 1e-9), np.nan)
