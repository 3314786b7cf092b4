"""The 3x3 ambiguity from whatever is known of a scene."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..analysis import Analysis
from ..errors import DegenerateError, InputError
from .directions import normalize
from .known import Known
from .resolved import Resolved
from .some_lights import resolve_from_lights
from .sphere import resolve_from_sphere, sphere_normals

NOTHING = Known()
PLANE = 1e-3
"""Root mean square distance of unit vectors from a plane, as in `photolin.stack.check_lights`."""


def resolve_ambiguity(analysis: Analysis, known: Known = NOTHING) -> Resolved:
    """The matrix M with n = M b, by what is known.

    Nothing known: by the lights of the analysis, where it has them; else by integrability. What is
    known wins over those lights.

    Args:
        analysis: linearized bases and coefficients.

    Raises:
        InputError: a point outside the sphere, or as the functions that resolve.
        DegenerateError: what is known does not determine the matrix.
    """
    if known != NOTHING:
        found = _from_known(analysis, known)
        check_lights_found(found.lights(analysis.coefficients))
        unused = "; the lights given with the stack served the linearization alone"
        return found if analysis.lights is None else replace(found, note=found.note + unused)
    if analysis.lights is None:
        # what it needs of scipy takes a third of a second to import
        from .integrability import resolve_by_integrability

        return resolve_by_integrability(
            analysis.linearized_bases, analysis.mask, analysis.coefficients
        )
    # linearization took the coefficients from these lights: there is nothing to fit
    matrix = np.linalg.inv(analysis.lights[list(analysis.base_images)]).astype(float)
    return Resolved(matrix, "lights", 0.0, True, "resolved by the lights given with the stack")


def check_lights_found(lights: NDArray[np.float64]) -> None:
    """Raise DegenerateError where what is known of the scene makes all lights (K,3) one plane's.

    The images are not those of such lights: what is known is not true of them.
    """
    if np.linalg.svd(normalize(lights), compute_uv=False)[2] < PLANE * np.sqrt(len(lights)):
        raise DegenerateError(
            "what is known of the scene does not fit the images: all lights that follow from it "
            "lie in one plane; accepted are rows, columns, normals or lights that belong to these "
            "images"
        )


def _from_known(analysis: Analysis, known: Known) -> Resolved:
    bases, mask = analysis.linearized_bases, analysis.mask
    if known.lights:
        lights = np.array(known.lights)
        return resolve_from_lights(analysis.coefficients, known.images, lights, powers=known.powers)
    if known.points:
        rows, columns = np.array(known.points).T
        normals = np.array(known.normals) if known.normals else _on_sphere(known, mask.shape)
        # what it needs of scipy takes a third of a second to import
        from .surface_points import resolve_from_surface_points

        return resolve_from_surface_points(bases, mask, rows, columns, normals)
    assert known.sphere is not None
    row, column, radius = known.sphere
    return resolve_from_sphere(bases, mask, (row, column), radius)


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
