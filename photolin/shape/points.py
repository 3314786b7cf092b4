"""The 3x3 ambiguity from points of known normal."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import DegenerateError, InputError
from .directions import angles_between, fit_directions
from .resolved import Resolved, set_scale

MIN_POINTS = 4
WRONG = 5.0
"""Degrees by which a point must miss the fit of the others to be left out."""
CHANCE = 0.01
"""Greatest probability that errors alike in all points would make one stand out as much."""


def resolve_from_points(
    bases: NDArray[np.floating],
    rows: Sequence[int] | NDArray[np.integer],
    columns: Sequence[int] | NDArray[np.integer],
    normals: NDArray[np.floating],
) -> Resolved:
    """The matrix M with M b along the normal n, by least squares over N points.

    Albedo is unknown and may differ: a point gives two equations for eight unknowns (Mukaigawa et
    al. 2007, section 4.C, with five points). Of six points or more, one that contradicts all
    others, more than their own errors explain, is left out and named in the note.

    Args:
        bases: (3,H,W) linearized bases, NaN where undetermined, 0 outside the mask.
        rows, columns: N >= 4 pixels.
        normals: (N,3) their unit normals; x right, y up, z to the camera.

    Returns:
        Residuals are angles between given and found normals, degrees; without absolute scale.

    Raises:
        InputError: fewer than four points, a pixel outside the image or without linearized bases,
            a normal that is not of length 1 or does not face the camera.
        DegenerateError: the points do not determine M: three of four in a plane.
    """
    given, known = read_points(bases, np.asarray(rows), np.asarray(columns), normals)
    try:
        matrix = fit_directions(given, known)
    except DegenerateError as error:
        raise DegenerateError(
            f"the {len(known)} points do not determine the ambiguity: their normals, or their "
            "linearized values, lie nearly in one plane; points whose normals spread to all "
            "sides are accepted"
        ) from error
    kept = keep_points(given, known)
    if not kept.all():
        matrix = fit_directions(given[kept], known[kept])
    angles = angles_between(given @ matrix.T, known)
    residual = float(np.sqrt(np.square(angles[kept]).mean()))
    worst = int(np.argmax(np.where(kept, angles, -1)))
    note = (
        f"resolved by {kept.sum()} points of known normal: they fit to {residual:.2f} degrees "
        f"(rms), worst {angles[worst]:.2f} degrees at row {rows[worst]}, column {columns[worst]}"
    )
    if kept.sum() == MIN_POINTS:
        note += "; four points are fitted exactly, a fifth would check them"
    if not kept.all():
        wrong = int(kept.argmin())
        note += (
            f"; the point at row {rows[wrong]}, column {columns[wrong]} was left out, it "
            f"contradicts all others by {angles[wrong]:.1f} degrees"
        )
    return Resolved(set_scale(matrix), "points", residual, False, note, angles)


def read_points(
    bases: NDArray, rows: NDArray, columns: NDArray, normals: NDArray
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(N,3) linearized values and (N,3) normals of the points, checked."""
    known = np.asarray(normals, float)
    if rows.ndim != 1 or rows.shape != columns.shape or known.shape != (len(rows), 3):
        raise InputError(
            f"rows, columns and normals of the points have shapes {rows.shape}, {columns.shape} "
            f"and {known.shape}; (N,), (N,) and (N,3) are accepted"
        )
    if len(rows) and not all(np.issubdtype(a.dtype, np.integer) for a in (rows, columns)):
        raise InputError("rows and columns of the points are not whole; pixels are accepted")
    if len(rows) < MIN_POINTS:
        raise InputError(
            f"{len(rows)} points of known normal; at least {MIN_POINTS} are needed, "
            "and five or more show their own errors"
        )
    H, W = bases.shape[1:]
    for row, column, normal in zip(rows, columns, known, strict=True):
        where = f"the point at row {row}, column {column}"
        if not (0 <= row < H and 0 <= column < W):
            raise InputError(f"{where} is outside the image of {H} rows and {W} columns")
        value = bases[:, row, column]
        if not (np.isfinite(value).all() and value.any()):
            raise InputError(
                f"{where} has no linearized bases (outside the mask, or lit in too few images); "
                "choose a pixel that has"
            )
        length = np.linalg.norm(normal)
        if not abs(length - 1) < 0.01:
            raise InputError(
                f"the normal of {where} has length {length:g}; unit vectors x y z are accepted"
            )
        if normal[2] <= 0:
            raise InputError(
                f"the normal of {where} has z = {normal[2]:g} and faces away from the camera; "
                "z above 0 is accepted"
            )
    known = known / np.linalg.norm(known, axis=1, keepdims=True)
    return bases[:, rows, columns].T.astype(float), known


def keep_points(given: NDArray[np.float64], known: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(N,) all of the points, or all but one that contradicts the others."""
    wrong = find_wrong(given, known) if len(known) > MIN_POINTS + 1 else None
    return np.arange(len(known)) != (-1 if wrong is None else wrong)


def find_wrong(given: NDArray[np.float64], known: NDArray[np.float64]) -> int | None:
    """Number of the point without which the others fit so much better that it must be wrong.

    An F test of a point's two equations against the m - 8 spare ones of the others, for the worst
    of N points (Bonferroni); with two degrees of freedom its probability is a mere power.
    """
    squares = fit(given, known, np.ones(len(known), bool))[1]
    best, least, miss = None, squares, 0.0
    for k in range(len(known)):
        others = np.arange(len(known)) != k
        try:
            matrix, rest = fit(given, known, others)
        except DegenerateError:
            continue
        if rest < least:
            best, least = k, rest
            miss = angles_between(given[[k]] @ matrix.T, known[[k]])[0]
    spare = len(known) - 1 - MIN_POINTS
    chance = len(known) * (least / max(squares, np.finfo(float).tiny)) ** spare
    return best if miss > WRONG and chance < CHANCE else None


def fit(
    given: NDArray[np.float64], known: NDArray[np.float64], kept: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], float]:
    """M for the points that are kept, and the sum of their squared angles."""
    matrix = fit_directions(given[kept], known[kept])
    return matrix, float(np.square(angles_between(given[kept] @ matrix.T, known[kept])).sum())
