"""The 3x3 ambiguity where nothing is known but that normals belong to a surface."""

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ..errors import DegenerateError, InputError
from .bas_relief import choose_relief, weighted_median
from .derivatives import Derivatives, differentiate
from .directions import Floats
from .resolved import Resolved, set_scale

ROUNDS = 30
"""Of reweighting; the weights have settled long before."""
PULL = 2.0
"""Median residuals from which on a pixel loses weight."""
UNCLEAR = 0.2
"""Largest ratio of the least singular values squared: beyond it another solution fits as well."""
FLAT = 1e-4
"""Least ratio of the second least to the greatest: below it two solutions fit."""
DOUBTFUL = 0.1
"""Residual from which on the note warns."""


# a sum's last digits depend on how many threads of BLAS share it
@threadpool_limits.wrap(limits=1, user_api="blas")
def resolve_by_integrability(
    bases: NDArray[np.floating],
    mask: NDArray[np.bool_],
    coefficients: NDArray[np.floating] | None = None,
) -> Resolved:
    """The matrix M for which the normals M b are those of a surface, and a choice of the rest.

    With n = M b, p = -n1/n3 and q = -n2/n3, dp/dy = dq/dx is linear in six numbers,
    u.(b_y x b) = v.(b_x x b), u = m1 x m3 and v = m2 x m3 for the rows m of M (Yuille and Snow
    1997). They fix M up to a generalized bas-relief transformation: depth may be stretched and
    tilted. Of these, that is chosen for which albedo is most even, with the outline's normals
    pointing outward; `photolin.shape.bas_relief.choose_relief` says it in full. With coefficients,
    the lights are taken to be about equally strong, too: better where it is true.

    Args:
        bases: (3,H,W) linearized bases, NaN where undetermined, 0 outside the mask.
        mask: (H,W) the object.
        coefficients: (K,3) of lights that have about the same power; None where they have not.

    Returns:
        The residual is the rms of dp/dy - dq/dx relative to that of the derivatives of p and q,
        over smooth parts; without absolute scale.

    Raises:
        InputError: the mask does not fit.
        DegenerateError: too few smooth pixels, or a surface that is flat, bent one way only, or
            hidden in noise.
    """
    if mask.shape != bases.shape[1:]:
        raise InputError(
            f"the mask has shape {mask.shape}, the bases {bases.shape[1:]}; equal ones are accepted"
        )
    known = mask & np.isfinite(bases).all(axis=0) & bases.any(axis=0)
    smooth = differentiate(bases, known)
    system = conditions(smooth)
    u, v, trust, weights = solve_robustly(system)
    # M^-1 has the columns m2 x m3, m3 x m1, m1 x m2 over det M; the third is free
    third = np.cross(u, v)
    matrix = np.linalg.inv(np.stack([v, -u, third / np.linalg.norm(third)], axis=1))
    if np.median(smooth.values @ matrix[2]) < 0:
        matrix = np.diag([1.0, 1.0, -1.0]) @ matrix
    matrix = matrix @ smooth.whitening
    lights = None if coefficients is None else coefficients @ np.linalg.inv(matrix)
    vectors = bases[:, smooth.used].T @ matrix.T
    matrix = choose_relief(vectors, weights, lights, smooth.used, known) @ matrix
    residual = measure_residual(smooth, matrix @ np.linalg.inv(smooth.whitening), trust)
    note = (
        f"resolved by integrability alone: dp/dy and dq/dx differ by {100 * residual:.1f} % of the "
        "slopes' changes; assumed are an albedo as even as possible"
        f"{', lights of about equal power' if coefficients is not None else ''} and an outline "
        "that bends away from the camera; depth may still be stretched or tilted"
    )
    if residual > DOUBTFUL:
        note += "; they differ by so much that the lights are doubtful"
    return Resolved(set_scale(matrix), "integrability", residual, False, note)


def conditions(smooth: Derivatives) -> Floats:
    """(N,6) rows r with r.(u, v) = 0, whatever the albedo."""
    values = smooth.values
    rows = np.hstack([np.cross(smooth.by_y, values), -np.cross(smooth.by_x, values)])
    return rows / np.square(values).sum(axis=1, keepdims=True)


def solve_robustly(system: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """u (3,), v (3,), how much each row is trusted (N,), and how curved the surface is there (N,).

    A row's length is the curvature; where that is much smaller than is typical, as in a plane,
    a pixel says little of the surface's shape and counts less.

    Raises:
        DegenerateError: the rows do not determine u and v.
    """
    length = np.linalg.norm(system, axis=1)
    if not length.any():
        raise DegenerateError(FLAT_MESSAGE)
    typical = np.sqrt(weighted_median(length**2, length**2))
    weights = length / np.hypot(length, typical)
    trust = np.ones(len(system))
    values, vectors = np.linalg.eigh(system.T @ system)
    for _ in range(ROUNDS):
        misfit = np.abs(system @ vectors[:, 0])
        scale = max(weighted_median(misfit, weights**2), 1e-6)
        trust = 1 / (1 + (misfit / (PULL * scale)) ** 2) ** 2
        values, vectors = np.linalg.eigh((system * trust[:, None]).T @ system)
    if values[0] > UNCLEAR * values[1] or values[1] < FLAT * values[5]:
        raise DegenerateError(FLAT_MESSAGE)
    return vectors[:3, 0], vectors[3:, 0], trust, weights


FLAT_MESSAGE = (
    "integrability does not determine the lights: the surface is flat, bent one way only, or "
    "hidden in noise; accepted are surfaces curved to all sides, or points of known normal, "
    "a sphere, or lights of some images"
)


def measure_residual(smooth: Derivatives, matrix: Floats, trust: Floats) -> float:
    """rms of dp/dy - dq/dx by that of the derivatives of p and q, each times n3^2 / |W b|^2."""
    n = smooth.values @ matrix.T
    size = np.square(smooth.values).sum(axis=1, keepdims=True)
    (px, qx), (py, qy) = (
        ((n[:, :2] * d[:, 2:] - d[:, :2] * n[:, 2:]) / size).T
        for d in (smooth.by_x @ matrix.T, smooth.by_y @ matrix.T)
    )
    total = trust @ (px**2 + py**2 + qx**2 + qy**2) / 2
    return float(np.sqrt(trust @ np.square(py - qx) / total))
