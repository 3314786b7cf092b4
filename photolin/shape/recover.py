"""From a linearization to normals, albedo, lights and depth."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..analysis import Analysis, Cancel, Progress
from ..errors import OptionError
from ..stack import ImageStack
from .axes import doubt_axes
from .depth import integrate_normals
from .grazing import fit_grazing
from .normals import normals_from_bases
from .resolved import Resolved

LEAST_MM, MOST_MM = 1e-6, 1e6
"""Sides of a pixel that are accepted, mm."""
MOST_AWAY = 0.5
"""Share of normals that face away from the camera, which sees none of those, from which on it
is doubted."""


@dataclass(frozen=True, eq=False)
class Shape:
    """What a linearization says of surface and lights, read-only; x right, y up, z to camera."""

    normals: NDArray[np.float32]
    """(H,W,3) unit; NaN where undetermined, 0 outside the mask."""
    albedo: NDArray[np.float32]
    """(H,W) in the unit of the images over that of the lights; NaN and 0 as the normals."""
    depth: NDArray[np.float32] | None
    """(H,W) z in pixels, mean 0 over each connected part; NaN outside the mask and where
    undetermined. None where it was not asked for."""
    lights: NDArray[np.float64]
    """(K,3) direction towards the light times power."""
    resolved: Resolved
    """How the ambiguity of unknown lights was resolved."""
    px_mm: float | None = None
    """Side of a pixel, mm; None where unknown: lengths are then in pixels."""

    def __post_init__(self) -> None:
        for array in (self.normals, self.albedo, self.depth, self.lights):
            if array is not None:
                array.setflags(write=False)

    @property
    def unit(self) -> str:
        """Of `lengths`: mm, or px where the scale is unknown."""
        return "px" if self.px_mm is None else "mm"

    def lengths(self, pixels: NDArray[np.float32]) -> NDArray[np.float32]:
        """Pixels in `unit`."""
        return pixels if self.px_mm is None else pixels * np.float32(self.px_mm)


def recover_shape(
    stack: ImageStack,
    analysis: Analysis,
    resolved: Resolved,
    *,
    depth: bool = True,
    px_mm: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> Shape:
    """Normals, albedo and lights of a linearization, and the depth of its surface.

    Args:
        stack: what was analyzed.
        resolved: what `resolve_ambiguity` found.
        depth: whether to integrate normals to depth.
        px_mm: side of a pixel, mm.
        threads: processors to use; the result does not depend on it.

    Raises:
        OptionError: a scale that no pixel has.
        InputError: stack and analysis do not belong together.
        DegenerateError: no pixel has a normal.
        Cancelled: `cancel` said so.
    """
    check_scale(px_mm)
    lights = resolved.lights(analysis.coefficients)
    powers = np.linalg.norm(lights, axis=1)
    bases = fit_grazing(stack, analysis, powers, threads=threads, progress=progress, cancel=cancel)
    normals, albedo = normals_from_bases(bases, resolved.matrix)
    doubts = [doubt_axes(analysis.linearized_bases, analysis.mask, resolved.matrix)]
    away = (normals[..., 2] < 0).sum() / max(analysis.determined().sum(), 1)
    if away > MOST_AWAY:
        doubts.append(
            f"{100 * away:.0f} % of the normals face away from the camera, as when the lights "
            "are given with z away from it"
        )
    resolved = replace(resolved, doubts=(*resolved.doubts, *filter(None, doubts)))
    z = None
    if depth:
        z = integrate_normals(normals, analysis.mask, progress=progress, cancel=cancel)
    return Shape(normals, albedo, z, lights, resolved, px_mm)


def check_scale(px_mm: float | None) -> None:
    """Raise OptionError unless `px_mm` is None or a side that a pixel may have."""
    if px_mm is not None and not LEAST_MM <= px_mm <= MOST_MM:
        raise OptionError(f"px_mm is {px_mm:g}; accepted are mm from {LEAST_MM:g} to {MOST_MM:g}")
