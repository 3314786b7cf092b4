"""The outline of a sphere from points clicked on its rim."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import DegenerateError, InputError


def fit_circle(
    rows: Sequence[float] | NDArray[np.floating], columns: Sequence[float] | NDArray[np.floating]
) -> tuple[tuple[float, float], float]:
    """The circle with the least sum of squared distances from N >= 3 points.

    Args:
        rows, columns: of the points, pixels; a pixel's own centre is at whole numbers.

    Returns:
        Centre (row, column) and radius, pixels.

    Raises:
        InputError: fewer than three points, or not finite.
        DegenerateError: the points lie on a line.
    """
    from scipy.optimize import least_squares  # takes a quarter of a second to import

    points = np.array([rows, columns], float).T
    if len(points) < 3 or not np.isfinite(points).all():
        raise InputError(
            f"{len(points)} points on the rim; at least three with finite row and column are "
            "accepted"
        )
    middle = points.mean(axis=0)
    spread = np.linalg.svd(points - middle, compute_uv=False)
    if spread[1] < 1e-3 * max(spread[0], 1e-9):
        raise DegenerateError(
            "the points on the rim lie on a line; points spread along the circle are accepted"
        )
    # |x - c|^2 = r^2 is linear in c and r^2 - |c|^2 (Kasa 1976): exact for three points
    local = points - middle
    system = np.column_stack([2 * local, np.ones(len(local))])
    a, b, d = np.linalg.lstsq(system, np.square(local).sum(axis=1), rcond=None)[0]
    start = np.array([a, b, np.sqrt(d + a**2 + b**2)])

    def distances(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.linalg.norm(local - x[:2], axis=1) - x[2]

    a, b, radius = least_squares(distances, start, x_scale="jac").x
    return (float(middle[0] + a), float(middle[1] + b)), float(abs(radius))
