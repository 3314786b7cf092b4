"""The 3x3 ambiguity from known lights of some images, or of all."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import DegenerateError, InputError
from .directions import FLAT, SINGULAR, angles_between, fit_directions, normalize
from .resolved import Kind, Resolved, set_scale

LEAST, MOST = 1e-9, 1e9
"""Lengths between which x y z are a light, those of `photolin.stack.check_lights`."""


def resolve_from_lights(
    coefficients: NDArray[np.floating],
    images: Sequence[int] | NDArray[np.integer],
    lights: NDArray[np.floating],
    *,
    powers: bool,
) -> Resolved:
    """The matrix M for which c_k M^-1 are the known lights, by least squares.

    With powers M^-1 is linear in three lights or more; with directions alone, s x (c M^-1) = 0
    asks for four. The kind is "lights" when all images are among them, else "some lights".

    Args:
        coefficients: (K,3) c_k of all images.
        images: N different image numbers, from 0.
        lights: (N,3) of those images, towards the light; x right, y up, z to the camera.
        powers: whether their lengths are the lights' powers, to a common unit; else any length.

    Returns:
        Residuals are angles between the given lights and those found, degrees; with absolute scale
        where powers are given.

    Raises:
        InputError: too few images, one that is not in the stack or given twice, a light that is
            zero or not finite.
        DegenerateError: the lights, or the images' coefficients, lie in a plane.
    """
    numbers, known = np.asarray(images), np.asarray(lights, float)
    check(numbers, known, len(coefficients), 3 if powers else 4)
    given = np.asarray(coefficients, float)[numbers]
    check_spread(known, FLAT, "lights")
    # the ambiguity may press these together
    check_spread(given, SINGULAR, "coefficients")
    # s = A^T c, A = M^-1: where only directions count, the same fit as that of normals
    inverse = np.linalg.pinv(given) @ known if powers else fit_directions(given, normalize(known)).T
    matrix = np.linalg.inv(inverse).astype(float)
    angles = angles_between((given @ inverse).astype(float), known)
    residual, worst = float(np.sqrt(np.square(angles).mean())), int(angles.argmax())
    kind: Kind = "lights" if len(numbers) == len(coefficients) else "some lights"
    note = (
        f"resolved by the {'lights' if powers else 'light directions'} of {len(numbers)} of "
        f"{len(coefficients)} images: they fit to {residual:.2f} degrees (rms), worst "
        f"{angles[worst]:.2f} degrees in image {numbers[worst]}"
    )
    if len(numbers) == (3 if powers else 4):
        note += "; so few are fitted exactly, one more would check them"
    return Resolved(matrix if powers else set_scale(matrix), kind, residual, powers, note, angles)


def check(
    numbers: NDArray[np.integer], lights: NDArray[np.float64], count: int, least: int
) -> None:
    """Raise InputError unless `numbers` (N,) and `lights` (N,3) are usable, N >= `least`."""
    if lights.shape != (len(numbers), 3):
        raise InputError(
            f"the known lights have shape {lights.shape} for {len(numbers)} images; one line of "
            "x y z for each image is accepted"
        )
    if len(numbers) < least:
        kind = "lights with power" if least == 3 else "light directions"
        raise InputError(f"{len(numbers)} known {kind}; at least {least} are needed")
    if not np.issubdtype(numbers.dtype, np.integer):
        raise InputError(f"known lights of images {numbers.tolist()}; whole numbers are accepted")
    outside = numbers[(numbers < 0) | (numbers >= count)]
    if len(outside) or len(np.unique(numbers)) < len(numbers):
        wrong = outside[0] if len(outside) else numbers[0]
        fault = f"{wrong} is not in the stack" if len(outside) else "one is given twice"
        raise InputError(
            f"known lights of images {numbers.tolist()}: {fault}; different numbers from 0 to "
            f"{count - 1} are accepted"
        )
    size = np.abs(lights).max(axis=1)
    bad = ~((size > LEAST) & (size < MOST))
    if bad.any():
        raise InputError(
            f"the known light of image {numbers[bad.argmax()]} is zero or not finite; x y z of a "
            f"length from {LEAST:g} to {MOST:g} is accepted"
        )


def check_spread(vectors: NDArray[np.float64], least: float, what: str) -> None:
    """Raise DegenerateError when `vectors` (N,3) lie nearly in a plane."""
    spread = np.linalg.svd(normalize(vectors), compute_uv=False)[2]
    if spread < least * np.sqrt(len(vectors)):
        raise DegenerateError(
            f"the {what} of the {len(vectors)} images of known light lie nearly in one plane; "
            "images lit from three sides or more are accepted"
        )
