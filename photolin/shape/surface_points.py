"""The 3x3 ambiguity from points of known normal and from what all normals have in common.

Points alone determine eight numbers of M. That the normals are those of a surface determines all
but three of them, from thousands of pixels: where points do not contradict it, only those three
are left to them, and errors of single pixels matter less.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ..errors import DegenerateError
from .bas_relief import relief
from .directions import Floats, angles_between, normalize
from .integrability import DOUBTFUL, resolve_by_integrability
from .points import keep_points, read_points, resolve_from_points
from .resolved import Resolved, set_scale

FREE, LEFT = 8, 3
"""Numbers of M, up to scale, without and with the surface."""
CHANCE = 0.1
"""Least probability that errors of the points alone explain how much worse they fit a surface. On
real and rendered stacks, from 0.01 to 0.2 make no more than a tenth of a degree of difference."""
CONTRADICTED = 8.0
"""Degrees, rms, beyond which points contradict a surface, however few they are."""


# a sum's last digits depend on how many threads of BLAS share it
@threadpool_limits.wrap(limits=1, user_api="blas")
def resolve_from_surface_points(
    bases: NDArray[np.floating],
    mask: NDArray[np.bool_],
    rows: Sequence[int] | NDArray[np.integer],
    columns: Sequence[int] | NDArray[np.integer],
    normals: NDArray[np.floating],
) -> Resolved:
    """The matrix M of `resolve_from_points`, or one that makes the normals those of a surface.

    The latter where an F test does not tell the fits of the points apart: integrability gives M up
    to a generalized bas-relief transformation, and least squares of the angles at the points give
    that. The former with four points, which nothing tests, and where integrability is doubtful.

    Args:
        bases: (3,H,W) linearized bases, NaN where undetermined, 0 outside the mask.
        mask: (H,W) the object.
        rows, columns, normals: as for `resolve_from_points`.

    Raises:
        InputError, DegenerateError: as `resolve_from_points`.
    """
    alone = resolve_from_points(bases, rows, columns, normals)
    given, known = read_points(bases, np.asarray(rows), np.asarray(columns), normals)
    kept = keep_points(given, known)
    spare = 2 * int(kept.sum()) - FREE
    if spare <= 0:
        return alone
    try:
        surface = resolve_by_integrability(bases, mask)
    except DegenerateError:
        return alone
    if surface.residual > DOUBTFUL:
        return alone
    matrix, angles = fit_relief(surface.matrix, given, known, kept)
    rms = float(np.sqrt(np.square(angles[kept]).mean()))
    if rms > CONTRADICTED or probability(alone.residual, rms, spare) < CHANCE:
        return alone
    note = (
        f"{alone.note}; taken together with what makes the normals those of a surface, to "
        f"{rms:.2f} degrees"
    )
    return Resolved(set_scale(matrix), "points", rms, False, note, angles)


def fit_relief(
    matrix: Floats, given: Floats, known: Floats, kept: NDArray[np.bool_]
) -> tuple[Floats, Floats]:
    """G M of the bas-relief transformation G that fits the kept points best, and (N,) angles.

    Args:
        matrix: (3,3) M, true up to G; hollow and convex are both tried.
        given: (N,3) linearized values of the points.
        known: (N,3) their unit normals.
    """
    from scipy.optimize import least_squares  # takes a quarter of a second to import

    fits = []
    for side in (1.0, -1.0):
        start = np.diag([side, side, 1.0]) @ matrix
        vectors, wanted = given[kept] @ start.T, known[kept]

        def differences(g: Floats, v: Floats = vectors, n: Floats = wanted) -> Floats:
            return (normalize(v @ relief(*g).T) - n).ravel()

        found = least_squares(differences, np.zeros(3))
        fits.append((float(found.cost), relief(*found.x) @ start))
    best = min(fits, key=lambda fit: fit[0])[1]
    return best, angles_between(given @ best.T, known)


def probability(alone: float, together: float, spare: int) -> float:
    """That errors of the points alone make them fit so much worse (F test).

    Args:
        alone: rms angle of the fit of all numbers of M.
        together: rms angle of the fit of those that the surface leaves.
        spare: equations of the points that the former leaves.
    """
    from scipy.special import fdtrc

    worse = max(together**2 - alone**2, 0.0) / (FREE - LEFT)
    return float(fdtrc(FREE - LEFT, spare, worse * spare / max(alone**2, np.finfo(float).tiny)))
