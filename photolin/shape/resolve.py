"""The 3x3 ambiguity from whatever is known of a scene."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..analysis import Analysis
from ..errors import InputError, OptionError
from .integrability import resolve_by_integrability
from .points import resolve_from_points
from .resolved import Resolved
from .some_lights import resolve_from_lights
from .sphere import resolve_from_sphere, sphere_normals

Sphere = tuple[float, float, float]
"""Row and column of the centre and radius of an outline, pixels; whole at pixel centres."""
Point = tuple[int, int]
"""(row, column)"""
Vector = tuple[float, float, float]
"""x right, y up, z to the camera."""


@dataclass(frozen=True)
class Known:
    """What someone knows of a scene besides its images; one kind of it is used."""

    sphere: Sphere | None = None
    """A sphere in the scene: all its pixels are used, or only `points` where some are given."""
    points: tuple[Point, ...] = ()
    """Pixels of known normal: those of `normals`, or of the sphere."""
    normals: tuple[Vector, ...] = ()
    """Unit normals of the points."""
    images: tuple[int, ...] = ()
    """Numbers of the images whose lights are known, from 0."""
    lights: tuple[Vector, ...] = ()
    """Their lights, towards the light."""
    powers: bool = False
    """Whether the lengths of `lights` are their powers, to a common unit."""

    def __post_init__(self) -> None:
        if self.lights and (self.points or self.sphere):
            raise OptionError(
                "lights and points or a sphere are known; one of them is accepted, to resolve "
                "the ambiguity of unknown lights"
            )
        if self.normals and len(self.normals) != len(self.points):
            raise OptionError(
                f"{len(self.points)} points and {len(self.normals)} normals; "
                "one normal for each point is accepted"
            )
        if self.normals and self.sphere:
            raise OptionError("points have normals and a sphere; one of them is accepted")
        if len(self.images) != len(self.lights):
            raise OptionError(
                f"{len(self.images)} images and {len(self.lights)} lights of them; "
                "equal numbers are accepted"
            )
        if self.points and not (self.normals or self.sphere):
            raise OptionError("points without normals; accepted with the sphere they lie on")


NOTHING = Known()


def resolve_ambiguity(analysis: Analysis, known: Known = NOTHING) -> Resolved:
    """The matrix M with n = M b, by what is known.

    Nothing known: by the lights of the analysis, where it has them; else by integrability.

    Args:
        analysis: linearized bases and coefficients.

    Raises:
        InputError: a point outside the sphere, or as the functions that resolve.
        DegenerateError: what is known does not determine the matrix.
    """
    bases, mask = analysis.linearized_bases, analysis.mask
    if known.lights:
        lights = np.array(known.lights)
        return resolve_from_lights(analysis.coefficients, known.images, lights, powers=known.powers)
    if known.points:
        rows, columns = np.array(known.points).T
        normals = np.array(known.normals) if known.normals else _on_sphere(known, mask.shape)
        return resolve_from_points(bases, rows, columns, normals)
    if known.sphere is not None:
        *centre, radius = known.sphere
        return resolve_from_sphere(bases, mask, (centre[0], centre[1]), radius)
    if analysis.lights is not None:
        every = np.arange(len(analysis.lights))
        return resolve_from_lights(analysis.coefficients, every, analysis.lights, powers=True)
    return resolve_by_integrability(bases, mask)


def _on_sphere(known: Known, shape: tuple[int, int]) -> NDArray[np.float64]:
    """(N,3) normals of the points, from the sphere they lie on."""
    assert known.sphere is not None
    row, column, radius = known.sphere
    normals, inside = sphere_normals(shape, (row, column), radius)
    for r, c in known.points:
        if not (0 <= r < shape[0] and 0 <= c < shape[1] and inside[r, c]):
            raise InputError(
                f"the point at row {r}, column {c} is outside the sphere of centre row {row:g}, "
                f"column {column:g} and radius {radius:g}; points inside are accepted"
            )
    rows, columns = np.array(known.points).T
    return normals[rows, columns]
