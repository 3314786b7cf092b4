"""Whether normals belong to a surface as they are, or only with an axis turned round.

Lights or points given with y downwards fit the images as well as right ones: the whole scene is
mirrored, and nothing that is linear can tell. But mirrored normals are those of no surface.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ..errors import DegenerateError
from .directions import Floats

Y = "y turned round"
CHANGES: Mapping[str, tuple[tuple[float, float, float], ...]] = MappingProxyType(
    {
        Y: ((1, 0, 0), (0, -1, 0), (0, 0, 1)),
        "x and y exchanged": ((0, 1, 0), (1, 0, 0), (0, 0, 1)),
        "x and y exchanged and y turned round": ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
    }
)
"""What may have been done to vectors, and the matrix that mends it. Of each, the opposite of both
x and y would mend it as well: hollow for convex."""
BETTER = 0.7
"""Part of the misfit, at most, that a change must leave. On right normals the best one leaves 1.5
times as much in the noisiest scenes, and 3 to 100 times as much in others."""
FITTING = 0.5
"""Greatest misfit of a surface; about 1 for normals at random."""


@threadpool_limits.wrap(limits=1, user_api="blas")
def doubt_axes(
    bases: NDArray[np.floating], mask: NDArray[np.bool_], matrix: NDArray[np.floating]
) -> str:
    """A sentence where normals M b are no surface's as they are, and are with axes changed.

    The normals of a surface have dp/dy = dq/dx, p = -n1/n3 and q = -n2/n3. The misfit is the sum of
    |dp/dy - dq/dx| relative to that of the derivatives of p and q, over smooth parts.

    Args:
        bases: (3,H,W) linearized bases, NaN where undetermined, 0 outside the mask.
        mask: (H,W) the object.
        matrix: (3,3) M.

    Returns:
        Empty where nothing is wrong, or where the surface is too flat or small to tell.
    """
    # what these need of scipy takes a third of a second to import
    from .bas_relief import points_inward
    from .derivatives import differentiate

    known = mask & np.isfinite(bases).all(axis=0) & bases.any(axis=0)
    try:
        smooth = differentiate(bases, known)
    except DegenerateError:
        return ""
    to_normal = matrix @ np.linalg.inv(smooth.whitening)
    n, by_x, by_y = (v @ to_normal.T for v in (smooth.values, smooth.by_x, smooth.by_y))
    size = np.square(smooth.values).sum(axis=1)
    misfit = measure_misfit(n, by_x, by_y, size)
    each: dict[str, float] = {}
    for change, mend in CHANGES.items():
        turn = np.array(mend).T
        each[change] = measure_misfit(n @ turn, by_x @ turn, by_y @ turn, size)
    best = min(each, key=lambda change: each[change])
    if not (each[best] < BETTER * misfit and each[best] < FITTING):
        return ""
    change = best
    if best == Y and mask.all():
        # the picture's own border is no outline that would tell
        change = "y (or x) turned round"
    elif best == Y and points_inward(n * (1, -1, 1), smooth.used, known):
        change = "x turned round (or y, where the object is hollow)"
    return (
        "the normals belong to no surface as they are (dp/dy and dq/dx differ by "
        f"{100 * misfit:.0f} % of the slopes' changes), and with {change} they do "
        f"({100 * each[best]:.0f} %): lights and normals are accepted as x right, y up, z to the "
        "camera"
    )


def measure_misfit(n: Floats, by_x: Floats, by_y: Floats, size: Floats) -> float:
    """Of N surface vectors (N,3) and their derivatives, each pixel weighted with n3^2 / `size`."""
    px, qx = ((n[:, :2] * by_x[:, 2:] - by_x[:, :2] * n[:, 2:]) / size[:, None]).T
    py, qy = ((n[:, :2] * by_y[:, 2:] - by_y[:, :2] * n[:, 2:]) / size[:, None]).T
    total = np.sqrt((px**2 + py**2 + qx**2 + qy**2) / 2).sum()
    return float(np.abs(py - qx).sum() / total) if total > 0 else 0.0
