"""Normals and albedo from linearized bases, once the 3x3 ambiguity is resolved."""

import numpy as np
from numpy.typing import NDArray

from ..errors import DegenerateError, InputError


def normals_from_bases(
    bases: NDArray[np.floating], matrix: NDArray[np.floating]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Unit normals and albedo by n = M b: the surface vector is the normal times the albedo.

    Args:
        bases: (3,H,W) linearized bases; NaN where undetermined, 0 outside the mask.
        matrix: (3,3) M; with known lights the inverse of those of the three base images.

    Returns:
        (H,W,3) unit normals, x right, y up, z to the camera, and (H,W) albedo, in the units of
        the bases over those of the lights. Both NaN where the bases are NaN, 0 where they are 0,
        as outside the mask. Normals that face away from the camera are left as they are.

    Raises:
        InputError: shapes other than these.
        DegenerateError: `matrix` is not finite or maps space onto a plane.
    """
    if bases.ndim != 3 or len(bases) != 3 or np.shape(matrix) != (3, 3):
        raise InputError(
            f"bases and matrix have shapes {bases.shape} and {np.shape(matrix)}; "
            "(3, rows, columns) and (3, 3) are accepted"
        )
    if not (np.isfinite(matrix).all() and np.linalg.cond(matrix) < 1e9):
        raise DegenerateError(
            "the matrix from bases to normals is not finite, or maps space onto a plane; "
            "a regular 3x3 matrix is accepted"
        )
    # double precision: the square of a dark pixel's length underflows in single
    vectors = np.einsum("jhw,ij->hwi", bases.astype(np.float64), matrix)
    albedo = np.linalg.norm(vectors, axis=2)
    length = np.where(albedo > 0, albedo, 1)[:, :, None]
    # NaN > 0 is false: NaN / 1 stays NaN
    return (vectors / length).astype(np.float32), albedo.astype(np.float32)
