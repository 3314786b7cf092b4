"""Derivatives of the linearized bases where the surface is smooth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, gaussian_filter

from ..errors import DegenerateError
from .directions import SINGULAR, Floats, normalize, spread_evenly

SMOOTH = 1.5
"""Standard deviation of the smoothing before differences are taken, pixels."""
STEEP, USUAL = 4.0, 0.8
"""A neighbour is beyond an edge when the direction turns by more than STEEP times what the share
USUAL of all neighbours turns at most."""
DARK = 0.3
"""Share of the median albedo below which a pixel has less weight in the smoothing."""
NOISE = 0.3
"""Least spread of the smoothed directions in each dimension, 0.58 where they spread evenly: noise
alone, which whitening lifts as high, is smoothed to 0.11."""
MIN_PIXELS = 100


@dataclass(frozen=True, eq=False)
class Derivatives:
    """N pixels away from outlines and edges. Space is x right, y up; read-only."""

    whitening: Floats
    """(3,3) W: W b spread evenly in direction, whatever lights the bases have."""
    values: Floats
    """(N,3) W b divided by albedo and smoothed."""
    by_x: Floats
    """(N,3) its derivative to the right, per pixel."""
    by_y: Floats
    """(N,3) its derivative upwards, per pixel."""
    used: NDArray[np.bool_]
    """(H,W) which pixels they are, in raster order."""

    def __post_init__(self) -> None:
        for array in vars(self).values():
            array.setflags(write=False)


def differentiate(bases: NDArray[np.floating], known: NDArray[np.bool_]) -> Derivatives:
    """Smoothed central differences, away from where normals jump.

    Across a depth edge differences are no derivatives, and they are the largest of all; hence
    smoothing stops there, too.

    Args:
        bases: (3,H,W) linearized bases.
        known: (H,W) pixels where they are finite and not zero.

    Raises:
        DegenerateError: fewer than MIN_PIXELS smooth pixels, or directions that do not spread in
            three dimensions but for noise.
    """
    if known.sum() < MIN_PIXELS:
        raise DegenerateError(
            f"{known.sum()} pixels have linearized bases; integrability needs at least {MIN_PIXELS}"
        )
    values = bases[:, known].T.astype(float)
    whitening = spread_evenly(normalize(values), SINGULAR)
    field = np.zeros(bases.shape)
    field[:, known] = divide_albedo(values @ whitening.T).T
    smooth = known & ~find_edges(field, known)
    field = blur(field, smooth, SMOOTH)
    used = binary_erosion(smooth, np.ones((3, 3))).astype(bool)
    if used.sum() < MIN_PIXELS:
        raise DegenerateError(
            f"{used.sum()} pixels lie away from outlines and edges; integrability needs at least "
            f"{MIN_PIXELS} of a smooth surface: larger images are accepted"
        )
    values = field[:, used].T
    spread = np.linalg.svd(normalize(values), compute_uv=False)[2] / np.sqrt(len(values))
    if spread < NOISE:
        raise DegenerateError(
            "integrability does not determine the lights: but for noise, the normals lie in a "
            "plane, as those of flat surfaces and cylinders; accepted are surfaces curved to all "
            "sides, or other ways to resolve the ambiguity"
        )
    by_x, by_y = np.gradient(field, axis=2), -np.gradient(field, axis=1)
    return Derivatives(whitening, values, by_x[:, used].T, by_y[:, used].T, used)


def divide_albedo(vectors: Floats) -> Floats:
    """Unit vectors (N,3); shorter ones of the very dark, whose direction is noise.

    A mean across two paints would else stand for places that lie more in the brighter one.
    """
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.maximum(lengths, DARK * np.median(lengths))


def find_edges(field: Floats, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(H,W) pixels on either side of a jump of the direction of `field` (3,H,W)."""
    calm = blur(field, known, 1.0)
    unit = calm / np.maximum(np.linalg.norm(calm, axis=0), np.finfo(float).tiny)
    edges = np.zeros(known.shape, bool)
    pairs = [(np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:, :], np.s_[:-1, :])]
    turns = [
        np.linalg.norm(unit[:, *a] - unit[:, *b], axis=0) * (known[a] & known[b]) for a, b in pairs
    ]
    both = [turn[known[a] & known[b]] for turn, (a, b) in zip(turns, pairs, strict=True)]
    limit = STEEP * np.quantile(np.concatenate([*both, [0.0]]), USUAL)
    for turn, (a, b) in zip(turns, pairs, strict=True):
        edges[a] |= turn > limit
        edges[b] |= turn > limit
    return edges


def blur(field: Floats, where: NDArray[np.bool_], sigma: float) -> Floats:
    """Gaussian mean of `field` (3,H,W) over the pixels `where`."""
    share = gaussian_filter(where.astype(float), sigma)
    total = np.stack([gaussian_filter(np.where(where, plane, 0.0), sigma) for plane in field])
    return total / np.maximum(share, np.finfo(float).tiny)
