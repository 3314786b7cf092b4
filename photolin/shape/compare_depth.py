"""Depth against the truth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import DegenerateError, InputError


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


def compare_depth(
    depth: NDArray[np.floating], true: NDArray[np.floating], mask: NDArray[np.bool_]
) -> DepthError:
    """Errors as in Table 3 of the 2007 paper: root mean square and largest.

    Normals leave a constant free on each connected part, so the mean error of each part of the
    compared pixels (connected by neighbours in rows and columns) is taken off before.

    Args:
        depth, true: (H,W) z to the camera, both in the same unit. Pixels where either is NaN are
            not compared.
        mask: (H,W) bool, the pixels to compare.

    Raises:
        InputError: shapes or types other than these.
        DegenerateError: no pixel to compare.
    """
    from scipy.ndimage import label

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
    parts = np.zeros(mask.shape, np.int32)
    label(compared, output=parts)
    part = parts[compared] - 1
    error = error[compared]
    count = np.bincount(part)
    error -= (np.bincount(part, error) / count)[part]
    return DepthError(
        rms=float(np.sqrt(np.square(error).mean())),
        largest=float(np.abs(error).max()),
        pixels=len(error),
        parts=len(count),
    )
