"""Normals, depth and lights against the truth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import DegenerateError, InputError
from .compare_depth import DepthError, compare_depth
from .directions import angles_between
from .true_surface import TrueSurface


@dataclass(frozen=True)
class SurfaceErrors:
    """How far a surface is from the truth."""

    mean: float
    """Mean angle between normals and true normals, degrees; NaN where none is determined."""
    median: float
    """Median of the same."""
    pixels: int
    """How many normals were compared."""
    undetermined: int
    """Pixels of the truth without a normal; they are in no other number."""
    depth: DepthError | None = None
    """In mm; None where there is no depth, or no true one."""
    light: float | None = None
    """Mean angle between lights and true lights as they are, degrees; None where not known."""


def compare_surface(
    normals: NDArray[np.floating],
    true: TrueSurface,
    *,
    depth: NDArray[np.floating] | None = None,
    lights: NDArray[np.floating] | None = None,
    where: NDArray[np.bool_] | None = None,
) -> SurfaceErrors:
    """Errors over the mask of the truth.

    Args:
        normals: (H,W,3) unit; NaN or 0 where undetermined.
        depth: (H,W) in pixels, NaN where undetermined; `true.px_mm` makes it mm.
        lights: (K,3) towards the light, of any length.
        where: (H,W) the pixels to compare, within the mask; all of it when left out.

    Raises:
        InputError: another size or number of lights than the truth has.
    """
    if normals.shape != true.normals.shape:
        H, W, _ = true.normals.shape
        raise InputError(
            f"the normals have shape {normals.shape}, the truth is of {H} x {W} pixels; "
            "a result of the truth's own stack is accepted"
        )
    if lights is not None and true.lights is not None and lights.shape != true.lights.shape:
        raise InputError(
            f"the result has {len(lights)} lights, the truth {len(true.lights)}; "
            "a result of the truth's own stack is accepted"
        )
    there = true.mask if where is None else true.mask & where
    known = there & np.isfinite(normals).all(axis=2) & normals.any(axis=2)
    angles = angles_between(normals[known].astype(float), true.normals[known])
    light = None
    if lights is not None and true.lights is not None:
        light = float(angles_between(lights.astype(float), true.lights).mean())
    return SurfaceErrors(
        mean=float(angles.mean()) if len(angles) else float("nan"),
        median=float(np.median(angles)) if len(angles) else float("nan"),
        pixels=len(angles),
        undetermined=int(there.sum()) - len(angles),
        depth=None if depth is None else _compare_depth(depth, true, there),
        light=light,
    )


def _compare_depth(
    depth: NDArray[np.floating], true: TrueSurface, there: NDArray[np.bool_]
) -> DepthError | None:
    if true.depth is None or true.px_mm is None:
        return None
    try:
        scaled = depth.astype(np.float64) * true.px_mm
        return compare_depth(scaled, true.depth, there, true.normals, true.px_mm)
    except DegenerateError:  # no pixel has both
        return None


def describe_errors(errors: SurfaceErrors) -> list[str]:
    """Lines of aligned text."""
    lines = [
        f"normals             mean {errors.mean:.3f}, median {errors.median:.3f} degrees over "
        f"{errors.pixels} pixels; {errors.undetermined} undetermined"
    ]
    if errors.depth is not None:
        lines.append(
            f"depth               rms {errors.depth.rms:.4f}, median {errors.depth.median:.4f}, "
            f"largest {errors.depth.largest:.4f} mm over {errors.depth.pixels} pixels in "
            f"{errors.depth.parts} parts"
        )
    if errors.light is not None:
        lines.append(f"lights as found     {errors.light:.3f} degrees")
    return lines
