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
        None where the ray meets nothing, or the surface from behind.
    """
    eye, along = ray
    H, W = depth.shape
    if not np.isfinite(depth).any():
        return None
    low, high = float(np.nanmin(depth)) - 1, float(np.nanmax(depth)) + 1
    part = clip_ray(ray, np.array([0.0, 0.0, low]), np.array([W, H, high], float))
    if part is None:
        return None
    start, stop = part
    length = np.hypot(along[0], along[1]) * (stop - start) * STEPS_A_PIXEL
    steps = int(np.clip(np.ceil(length), 8, MOST_STEPS))
    points = eye + np.linspace(start, stop, steps)[:, None] * along
    above = points[:, 2] - heights(depth, points[:, 1] - 0.5, points[:, 0] - 0.5)
    with np.errstate(invalid="ignore"):
        front = (above[:-1] > 0) & (above[1:] <= 0)
        behind = (above[:-1] < 0) & (above[1:] >= 0)
    met = np.flatnonzero(front | behind)
    if not met.size or behind[met[0]]:
        return None
    n = met[0]
    share = above[n] / (above[n] - above[n + 1])
    column, row = np.floor(points[n, :2] + share * (points[n + 1, :2] - points[n, :2])).astype(int)
    return (int(np.clip(row, 0, H - 1)), int(np.clip(column, 0, W - 1)))


def clip_ray(
    ray: Ray, low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[float, float] | None:
    """From where to where, in lengths of its direction, a ray is in a box; None where nowhere."""
    start, stop = 0.0, np.inf
    for eye, along, one, other in zip(*ray, low, high, strict=True):
        if along == 0:
            if not one <= eye <= other:
                return None
            continue
        near, far = sorted(((one - eye) / along, (other - eye) / along))
        start, stop = max(start, near), min(stop, far)
    return (float(start), float(stop)) if start < stop < np.inf else None


def heights(
    depth: NDArray[np.float32], rows: NDArray[np.float64], columns: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Heights (N,) between pixel centres, at whole rows and columns; NaN where none is."""
    H, W = depth.shape
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
