"""The 3x3 ambiguity from a sphere whose outline is known."""

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ..errors import DegenerateError, InputError
from .directions import (
    Floats,
    angles_between,
    fit_directions,
    normalize,
)
from .resolved import Resolved, set_scale

FAR = 1e9
"""Pixels: largest radius and farthest centre; 1 / FAR is the least radius. No square overflows."""
RIM = 0.95
"""Share of the radius that is used: beyond it a pixel spans many normals."""
MIN_PIXELS = 30
PIXELS = 3000
"""Most pixels of the sphere that are used, spread evenly."""
DRAWS = 300
"""Random fours of pixels: one of all good pixels is among them if a third of all are good."""
TOLERANCE = 6.0
"""Degrees off the sphere's normal up to which a pixel agrees with a fit."""
REGULAR = 1e-4
"""Least volume that any three of four unit vectors must span."""
ODD = 0.15
"""Share of the pixels, off by more than TOLERANCE, from which on the sphere is doubted: up to
0.09 on right outlines with 3 % noise in 8 images, 0.2 and more on wrong ones."""
AGREEING = 0.2
"""Least share of the pixels that must, for a sphere to be seen."""
TRIM, ROUNDS = 4.0, 10
"""Pixels off by more than TRIM times the median are left out of the fit, in each of ROUNDS."""
EXACT = 0.05
"""Degrees; the least median that is told from rounding."""


def sphere_normals(
    shape: tuple[int, int], centre: tuple[float, float], radius: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Normals of a sphere under an orthographic camera.

    Args:
        shape: H and W of the image.
        centre: (row, column) of its outline, pixels; a pixel's own centre is at whole numbers.
        radius: of its outline, pixels.

    Returns:
        (H,W,3) unit normals, x right, y up, z to the camera, 0 outside; (H,W) true inside.

    Raises:
        InputError: the radius is not above 0, or anything is not finite or beyond FAR.
    """
    if not (np.abs([*centre, radius]).max() <= FAR and radius >= 1 / FAR):
        raise InputError(
            f"the sphere's outline is centre {centre} and radius {radius}; accepted are a finite "
            f"(row, column), and a radius above 0 pixels, of {FAR:g} at most"
        )
    row, column = np.mgrid[: shape[0], : shape[1]]
    x, y = (column - centre[1]) / radius, (centre[0] - row) / radius
    inside = x**2 + y**2 < 1
    z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
    return np.stack([x, y, z], axis=-1) * inside[..., None], inside


# a sum's last digits depend on how many threads of BLAS share it
@threadpool_limits.wrap(limits=1, user_api="blas")
def resolve_from_sphere(
    bases: NDArray[np.floating],
    mask: NDArray[np.bool_],
    centre: tuple[float, float],
    radius: float,
) -> Resolved:
    """The matrix M with M b along the sphere's normal, whatever its albedo.

    From the best of many exact fits to four pixels, least squares of the angles over the pixels
    within RIM of the outline, without those that are far off: what stands before the sphere.

    Args:
        bases: (3,H,W) linearized bases, NaN where undetermined, 0 outside the mask.
        mask: (H,W) pixels that may be used.
        centre: (row, column) of the sphere's outline, pixels; a pixel's own centre is at whole
            numbers.
        radius: of its outline, pixels.

    Returns:
        The residual is the median angle between the sphere's normals and those found, degrees;
        without absolute scale.

    Raises:
        InputError: the mask does not fit, or the sphere has fewer than 30 determined pixels.
        DegenerateError: they do not determine M.
    """
    if mask.shape != bases.shape[1:]:
        raise InputError(
            f"the mask has shape {mask.shape}, the bases {bases.shape[1:]}; equal ones are accepted"
        )
    normals, _ = sphere_normals(bases.shape[1:], centre, radius)
    _, inner = sphere_normals(bases.shape[1:], centre, RIM * radius)
    used = inner & mask & np.isfinite(bases).all(axis=0) & bases.any(axis=0)
    count = int(used.sum())
    if count < MIN_PIXELS:
        raise InputError(
            f"the sphere at row {centre[0]:g}, column {centre[1]:g} of radius {radius:g} pixels "
            f"has {count} pixels with linearized bases; at least {MIN_PIXELS} are needed"
        )
    step = -(-count // PIXELS)
    given, known = bases[:, used].T[::step].astype(float), normals[used][::step]
    matrix = trim(find_start(given, known), given, known)
    angles = angles_between(bases[:, used].T @ matrix.T, normals[used])
    off = (angles > TOLERANCE).mean()
    doubt = (
        f"{100 * off:.0f} % of the sphere's pixels are off by more than {TOLERANCE:g} degrees: its "
        "outline is another one, it is no sphere, or something hides it"
    )
    note = (
        f"resolved by a sphere at row {centre[0]:g}, column {centre[1]:g}, radius {radius:g} "
        f"pixels: half of its {count} pixels fit within {np.median(angles):.2f} degrees, "
        f"{100 * off:.0f} % are off by more than {TOLERANCE:g}"
    )
    doubts = (doubt,) if off > ODD else ()
    residual = float(np.median(angles))
    return Resolved(set_scale(matrix), "sphere", residual, False, note, doubts=doubts)


def trim(matrix: Floats, given: Floats, known: Floats) -> Floats:
    """M fitted again and again to the pixels that it fits."""
    kept = np.zeros(len(given), bool)
    for _ in range(ROUNDS):
        angles = angles_between(given @ matrix.T, known)
        before, kept = kept, angles <= TRIM * max(np.median(angles), EXACT)
        if (kept == before).all():
            break
        matrix = fit_directions(given[kept], known[kept])
    return matrix


def find_start(given: Floats, known: Floats) -> Floats:
    """M of the exact fit to four pixels that most others agree with, and best (MSAC)."""
    drawn = np.random.default_rng(0).integers(0, len(given), (DRAWS, 4))
    unit = normalize(given)
    g, k = unit[drawn].swapaxes(1, 2), known[drawn].swapaxes(1, 2)  # (DRAWS,3,4), columns
    regular = np.minimum(least_volume(g), least_volume(k)) > REGULAR
    g, k = g[regular], k[regular]
    # both fourths in terms of the first three: M = K diag(those of k / those of g) G^-1
    ratio = np.linalg.solve(k[..., :3], k[..., 3:]) / np.linalg.solve(g[..., :3], g[..., 3:])
    best, most, agreeing = np.eye(3), 0.0, 0.0
    for matrix in (k[..., :3] * ratio.swapaxes(1, 2)) @ np.linalg.inv(g[..., :3]):
        chord = np.square(normalize(unit @ matrix.T) - known).sum(axis=1)
        credit = np.maximum(1 - chord / np.radians(TOLERANCE) ** 2, 0)
        if credit.sum() > most:
            best, most, agreeing = matrix, credit.sum(), (credit > 0).mean()
    if agreeing < AGREEING:
        raise DegenerateError(
            "the linearized values inside the outline are not those of a sphere; accepted is a "
            "matte sphere, with the row, column and radius of its outline"
        )
    return best


def least_volume(vectors: Floats) -> Floats:
    """(N,) the least volume that three of four unit vectors, columns of (N,3,4), span."""
    threes = ([0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3])
    return np.min([np.abs(np.linalg.det(vectors[..., three])) for three in threes], axis=0)
