"""Lights as files that RTI tools and readers of DiLiGenT take."""

import re

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..stack import check_lights

BREAKING = re.compile(r"[\x00-\x1f\x7f-\xa0\u2028\u2029\ud800-\udfff]+|^[#\s]+")
"""What would end a line, make it a comment, or be no text."""


def lights_lp(lights: NDArray[np.floating], names: tuple[str, ...]) -> bytes:
    """Encode directions as `.lp`: a line with their count, then ``name x y z`` for each image.

    x right, y up, z to the camera, of length 1: the format knows no powers and no comments. Line
    breaks in names become _; an image without a name is called by its number.

    Args:
        lights: (K,3) direction towards the light times power.
        names: K image names.

    Raises:
        InputError: another shape or number of names, or a light that is zero or not finite.
        DegenerateError: the lights lie in one plane.
    """
    check_lights(lights, len(names), "lights")
    lines = [str(len(names))]
    for k, (name, direction) in enumerate(zip(names, _directions(lights), strict=True)):
        lines.append(f"{BREAKING.sub('_', name).strip() or f'{k:03d}'} {_numbers(direction)}")
    return ("\n".join(lines) + "\n").encode()


def lights_diligent(
    lights: NDArray[np.floating], intensities: NDArray[np.floating] | None = None
) -> dict[str, bytes]:
    """Encode lights as DiLiGenT has them: a line for each image, in their order.

    Args:
        lights: (K,3) direction towards the light times power; x right, y up, z to the camera.
        intensities: (K,3) red, green, blue power; that of `lights`, three times, when left out.

    Returns:
        light_directions.txt, ``x y z`` of length 1, and light_intensities.txt, ``r g b``.

    Raises:
        InputError: other shapes, or a light or an intensity that is not above zero or not finite.
        DegenerateError: the lights lie in one plane.
    """
    check_lights(lights, len(lights), "lights")
    power = np.linalg.norm(lights, axis=1, keepdims=True).repeat(3, axis=1)
    power = power if intensities is None else intensities
    if power.shape != lights.shape or not ((power > 0) & np.isfinite(power)).all():
        raise InputError(
            f"intensities of shape {power.shape} do not fit, or hold 0, less or NaN; finite "
            f"numbers above 0 of shape {lights.shape} are accepted"
        )
    return {
        "light_directions.txt": _lines(_directions(lights)),
        "light_intensities.txt": _lines(power),
    }


def _directions(lights: NDArray[np.floating]) -> NDArray[np.float64]:
    exact = lights.astype(np.float64)
    return exact / np.linalg.norm(exact, axis=1, keepdims=True)


def _lines(rows: NDArray[np.floating]) -> bytes:
    return "".join(f"{_numbers(row)}\n" for row in rows).encode()


def _numbers(row: NDArray[np.floating]) -> str:
    return " ".join(f"{value:.10g}" for value in row.tolist())
