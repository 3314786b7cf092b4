"""Light directions from images of a mirror ball."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from ..errors import InputError
from .sphere import sphere_normals

LEAST_RADIUS = 6.0
"""Pixels."""
ROUND = 0.9
"""Least overlap of a mask with the circle of its area and centre: intersection over union."""
CONTRAST = 0.1
"""Least brightness of a spot above the ball, fraction of full scale."""
EDGE = 0.15
"""Share of the greatest brightness from which on a pixel belongs to a spot: partly covered ones
must, for the spot of a small light is a few pixels wide."""
RIVAL = 0.25
"""Share of the brightest spot's light from which on another one makes it doubtful."""
WIDE = 0.1
"""Share of the ball's area from which on a spot is doubtful."""


@dataclass(frozen=True, eq=False)
class BallLights:
    """Light directions seen in a mirror ball; read-only. Space is x right, y up, z to camera."""

    directions: NDArray[np.float64]
    """(K,3) unit, towards the light; NaN for an image without a spot."""
    spots: NDArray[np.float64]
    """(K,2) row and column of the spot, pixels, whole at pixel centres; NaN without."""
    doubts: tuple[str, ...]
    """K sentences on what is doubtful in an image; empty where nothing is."""
    centre: tuple[float, float]
    """Row and column of the ball's centre, pixels, whole at pixel centres."""
    radius: float
    """Of its outline, pixels."""

    def __post_init__(self) -> None:
        self.directions.setflags(write=False)
        self.spots.setflags(write=False)

    @property
    def found(self) -> NDArray[np.intp]:
        """(N,) numbers of the images that show a spot, from 0."""
        return np.flatnonzero(np.isfinite(self.directions).all(axis=1))


def estimate_lights(images: NDArray[np.floating], mask: NDArray[np.bool_]) -> BallLights:
    """Light directions s = 2 (n.z) n - z from the brightest spot on a mirror ball in each image.

    n is the ball's normal at the spot, z the direction to the camera (orthographic). A mirror ball
    shows the whole sky and each part of it on an area in proportion, so the mean of s over the
    spot, weighted with its light, is the middle of the light's own disc, however wide.

    Args:
        images: (K,H,W) linear, fraction of full scale; clipped spots are accepted.
        mask: (H,W) the ball, and nothing else.

    Raises:
        InputError: shapes that do not fit; a mask that is no disk, cut off or smaller than 6
            pixels in radius; no image with a spot.
    """
    if images.ndim != 3 or mask.shape != images.shape[1:]:
        raise InputError(
            f"images of shape {images.shape} and a ball's mask of shape {mask.shape}; (K,H,W) and "
            "(H,W) of the same rows and columns are accepted"
        )
    centre, radius = find_ball(mask)
    normals, inside = sphere_normals(images.shape[1:], centre, radius)
    inside &= mask
    towards = 2 * normals[..., 2:] * normals - (0, 0, 1)
    directions, spots = np.full((len(images), 3), np.nan), np.full((len(images), 2), np.nan)
    doubts = []
    for k, image in enumerate(images):
        if not np.isfinite(image[inside]).all():
            raise InputError(f"image {k} of the ball holds NaN or infinity; numbers are accepted")
        weights, doubt = find_spot(image, inside)
        doubts.append(doubt)
        if weights.any():
            s = np.tensordot(weights, towards, 2)
            directions[k] = s / np.linalg.norm(s)
            # back to the ball: the normal halves the angle between light and camera
            normal = directions[k] + (0, 0, 1)
            normal /= max(np.linalg.norm(normal), 1e-9)
            spots[k] = centre[0] - radius * normal[1], centre[1] + radius * normal[0]
    if not np.isfinite(directions).any():
        raise InputError(
            f"none of {len(images)} images shows a bright spot on the ball at row {centre[0]:.0f}, "
            f"column {centre[1]:.0f}; a mirror ball that reflects the light is accepted"
        )
    return BallLights(directions, spots, tuple(doubts), centre, radius)


def find_ball(mask: NDArray[np.bool_]) -> tuple[tuple[float, float], float]:
    """Centre (row, column) and radius of the disk that a mask is.

    Raises:
        InputError: it is empty, small, or no disk.
    """
    rows, columns = np.nonzero(mask)
    radius = float(np.sqrt(len(rows) / np.pi))
    if radius < LEAST_RADIUS:
        raise InputError(
            f"the ball's mask has {len(rows)} pixels, a radius of {radius:.1f}; a radius of at "
            f"least {LEAST_RADIUS:g} pixels is needed"
        )
    centre = float(rows.mean()), float(columns.mean())
    row, column = np.indices(mask.shape)
    disk = np.hypot(row - centre[0], column - centre[1]) < radius
    overlap = (disk & mask).sum() / (np.pi * radius**2 + (mask & ~disk).sum())
    if overlap < ROUND:
        raise InputError(
            f"the ball's mask is no disk: {100 * overlap:.0f} % overlap with the circle of its "
            f"area; the whole outline of one ball, at least {100 * ROUND:.0f} %, is accepted"
        )
    return centre, radius


def find_spot(
    image: NDArray[np.floating], inside: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], str]:
    """Weights (H,W), the light of the brightest spot, and what is doubtful in it."""
    ground = float(np.median(image[inside]))
    height = float(image[inside].max()) - ground
    if height < CONTRAST:
        return np.zeros(inside.shape), (
            f"no spot: nothing on the ball is brighter than the rest by {CONTRAST:g} of full scale"
        )
    excess = np.where(inside & (image > ground + EDGE * height), image - ground, 0.0)
    parts, count = label(excess > 0, np.ones((3, 3)))  # type: ignore[misc]
    light = np.bincount(parts.ravel(), excess.ravel(), count + 1)
    light[0] = 0
    brightest = int(light.argmax())
    weights = np.where(parts == brightest, excess, 0.0)
    doubts = []
    rivals = int((light > RIVAL * light[brightest]).sum()) - 1
    if rivals:
        doubts.append(f"{rivals + 1} spots of similar light; the one with most is taken")
    share = (weights > 0).sum() / inside.sum()
    if share > WIDE:
        doubts.append(f"the spot covers {100 * share:.0f} % of the ball")
    return weights, "; ".join(doubts)
