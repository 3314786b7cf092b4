"""Depth against the truth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import DegenerateError, InputError

JUMP = 1.0
"""Pixels by which depth rises from a pixel to the next otherwise than true normals say."""
GRAZING = 0.01
"""Least sum of the z of two normals that says how depth rises."""


@dataclass(frozen=True)
class DepthError:
    """Errors of depth, in the unit of both depths."""

    rms: float
    """Root mean square."""
    largest: float
    """Largest absolute error."""
    pixels: int
    """How many were compared."""
    parts: int
    """How many connected parts they form; a constant was taken off each."""
    median: float
    """Half of the pixels are off by less, once the median error of each part is taken off."""


def compare_depth(
    depth: NDArray[np.floating],
    true: NDArray[np.floating],
    mask: NDArray[np.bool_],
    normals: NDArray[np.floating] | None = None,
    px: float = 1.0,
) -> DepthError:
    """Errors as in Table 3 of the 2007 paper: root mean square and largest.

    Normals leave a constant free on each connected part, so the mean error of each part of the
    compared pixels is taken off before. Parts are connected by neighbours in rows and columns;
    with true normals, only by those between which true depth does not jump.

    Args:
        depth, true: (H,W) z to the camera, both in the same unit. Pixels where either is NaN are
            not compared.
        mask: (H,W) bool, the pixels to compare.
        normals: (H,W,3) true unit normals. Depth jumps where it differs by more than JUMP pixels
            from what they say of two neighbours.
        px: side of a pixel in the unit of depth.

    Raises:
        InputError: shapes or types other than these.
        DegenerateError: no pixel to compare.
    """
    if mask.dtype != np.bool_ or not depth.shape == true.shape == mask.shape or mask.ndim != 2:
        raise InputError(
            f"depth, truth and mask ({mask.dtype}) are of shapes {depth.shape}, {true.shape} and "
            f"{mask.shape}; one shape (rows, columns) and a bool mask are accepted"
        )
    error = depth.astype(np.float64) - true
    compared = mask & np.isfinite(error)
    if not compared.any():
        raise DegenerateError(
            "no pixel of the mask has both a depth and a true depth; at least one is needed"
        )
    part = find_parts(compared, true, normals, px)
    error = error[compared]
    count = np.bincount(part)
    order = np.lexsort((error, part))
    first = np.cumsum(count) - count
    middle = (error[order][first + (count - 1) // 2] + error[order][first + count // 2]) / 2
    off = error - (np.bincount(part, error) / count)[part]
    return DepthError(
        rms=float(np.sqrt(np.square(off).mean())),
        largest=float(np.abs(off).max()),
        pixels=len(error),
        parts=len(count),
        median=float(np.median(np.abs(error - middle[part]))),
    )


def find_parts(
    compared: NDArray[np.bool_],
    true: NDArray[np.floating],
    normals: NDArray[np.floating] | None,
    px: float,
) -> NDArray[np.intp]:
    """Number of the part, from 0, of each pixel that is compared, in raster order."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = int(compared.sum())
    rank = np.cumsum(compared).reshape(compared.shape) - 1
    one, other = [], []
    for axis, (a, b) in enumerate(((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:]))):
        joined = compared[a] & compared[b]
        if normals is not None:
            n = np.asarray(normals[a], np.float64) + normals[b]
            # the chord between neighbours is perpendicular to the sum of their unit normals
            slope = (-n[..., 0], n[..., 1])[axis] * px
            rise = (true[b] - true[a]).astype(np.float64)
            joined &= np.abs(rise * n[..., 2] - slope) <= JUMP * px * np.maximum(n[..., 2], GRAZING)
        one.append(rank[a][joined])
        other.append(rank[b][joined])
    pairs = np.concatenate(one), np.concatenate(other)
    links = coo_array((np.ones(len(pairs[0]), np.bool_), pairs), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], np.intp)
