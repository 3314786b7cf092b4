"""The linear map that turns given vectors into known directions; their lengths are free."""

import numpy as np
from numpy.typing import NDArray

from ..errors import DegenerateError

Floats = NDArray[np.float64]

FLAT = 0.02
"""Least singular value of known directions, divided by the root of their number: below it they lie
nearly in a plane."""
SINGULAR = 1e-5
"""The same of given vectors, which the ambiguity may press together: below it, of rounding."""
GENERAL = 0.01
"""Singular value that tells how well N directions determine the map, relative to the largest."""


def fit_directions(given: Floats, known: Floats) -> Floats:
    """M (3,3), up to scale, for which M g_i points along k_i, by least squares of the angles.

    The start is linear: k_i x M g_i = 0 is two equations for each vector, so that four determine
    M, no three of them in a plane (Hartley and Zisserman, Multiple View Geometry, 4.1). Both sides
    are first mapped to vectors that spread evenly, so that shapes of the ambiguity do not matter.

    Args:
        given: (N,3) vectors g, not zero.
        known: (N,3) unit vectors k.

    Raises:
        DegenerateError: fewer than four of them, no three in a plane, on either side.
    """
    unit = given / np.linalg.norm(given, axis=1, keepdims=True)
    before, after = spread_evenly(unit, SINGULAR), spread_evenly(known, FLAT)
    even = normalize(unit @ before.T)
    matrix = np.linalg.inv(after) @ solve_linear(even, normalize(known @ after.T))
    if (known * (even @ matrix.T)).sum() < 0:
        matrix = -matrix
    return refine_directions(matrix, even, known) @ before


def spread_evenly(vectors: Floats, least: float) -> Floats:
    """(3,3) map after which unit vectors (N,3) have the second moments of evenly spread ones.

    Raises:
        DegenerateError: they lie in one plane but for `least`, the root mean square from it.
    """
    _, s, vt = np.linalg.svd(vectors, full_matrices=False)
    if len(s) < 3 or s[2] < least * np.sqrt(len(vectors)):
        raise DegenerateError(
            f"the {len(vectors)} directions lie nearly in one plane and leave the ambiguity open; "
            "directions that spread to all sides are accepted"
        )
    return np.sqrt(len(vectors) / 3) / s[:, None] * vt


def solve_linear(given: Floats, known: Floats) -> Floats:
    """M (3,3) of length 1 with the least sum of squares of k x M g, of either sign."""
    cross = np.cross(np.eye(3), known[:, None, :])  # (N,3,3): rows e_a x k
    system = np.einsum("naj,nb->njab", cross, given).reshape(-1, 9)
    _, s, vt = np.linalg.svd(system, full_matrices=False)
    if s[7] < GENERAL * s[0]:
        raise DegenerateError(
            f"the {len(given)} directions do not determine the ambiguity; accepted are at least "
            "four, of which no three lie in one plane with the origin"
        )
    return vt[8].reshape(3, 3)


def refine_directions(matrix: Floats, given: Floats, known: Floats) -> Floats:
    """The M near `matrix` with the least sum of squared angles."""
    from scipy.optimize import least_squares  # takes a quarter of a second to import

    scale = np.linalg.norm(matrix)

    def differences(x: Floats) -> Floats:
        return (normalize(given @ x.reshape(3, 3).T) - known).ravel()

    def slopes(x: Floats) -> Floats:
        mapped = given @ x.reshape(3, 3).T
        unit = normalize(mapped)
        across = np.eye(3) - unit[:, :, None] * unit[:, None, :]
        across /= np.linalg.norm(mapped, axis=1)[:, None, None]
        return (across[..., None] * given[:, None, None, :]).reshape(-1, 9)

    # the length of M is free: it is taken from where it started
    found = least_squares(differences, matrix.ravel() / scale, slopes, method="lm").x  # type: ignore[arg-type]
    return found.reshape(3, 3) * scale / np.linalg.norm(found)


def angles_between(a: Floats, b: Floats) -> Floats:
    """(N,) angles between vectors (N,3) of any lengths, degrees, 0 to 180."""
    sine = np.linalg.norm(np.cross(a, b), axis=1)
    return np.degrees(np.arctan2(sine, (a * b).sum(axis=1)))


def normalize(vectors: Floats) -> Floats:
    """Unit vectors (N,3); zero stays zero."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.maximum(lengths, np.finfo(float).tiny)
