"""The lights of all images as found: directions, or coefficients where nothing more is known. Pure.

SVG text; text colour is inherited, so that it reads on a light and a dark page.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photolin.factors import Factor, css_colour

from .box_plot import View, choose_box, draw_box
from .readout import escape

AXES = ("c1", "c2", "c3")
"""Names of the coefficients: of the first, second and third base image."""
CIRCLE = 96
"""Radius of the disc of lights, drawing units."""


def plot_coefficients(
    coefficients: NDArray[np.float64], current: int, names: Sequence[str], view: View
) -> str:
    """Coefficients (K,3) of all images as points; the lights, up to a linear map of space.

    Args:
        current: image number, from 0, whose point is larger and ringed.
        names: K image names, for tooltips; any text.
    """
    important = np.concatenate([coefficients, np.zeros((1, 3))])
    box = choose_box(coefficients, important, coefficients.mean(axis=0), view)
    zero = box.place(np.zeros(3))
    rays, dots = [], []
    for k, place in enumerate(box.place(coefficients)):
        rays.append(f"M{zero[0]:.1f} {zero[1]:.1f}L{place[0]:.1f} {place[1]:.1f}")
        told = f"{names[k]}: c = {format_vector(coefficients[k])}"
        dots.append(_light(place, told, ringed=k == current))
    dots.append(dots.pop(current))  # on top
    lines = f'<path d="{"".join(rays)}" stroke="currentColor" stroke-opacity="0.2"/>'
    return draw_box(box, AXES, lines + "".join(dots), "coefficients of all images")


def plot_lights(lights: NDArray[np.float64], current: int, names: Sequence[str]) -> str:
    """Directions of lights (K,3) as the camera sees them: x right, y up; hollow from behind.

    Args:
        current: image number, from 0, whose point is larger and ringed.
        names: K image names, for tooltips; any text.
    """
    unit = lights / np.linalg.norm(lights, axis=1, keepdims=True)
    dots = []
    for k, (x, y, z) in enumerate(unit.tolist()):
        slant = np.degrees(np.arccos(np.clip(z, -1, 1)))
        told = f"{names[k]}: x {x:.2f}, y {y:.2f}, z {z:.2f}; {slant:.0f} degrees off the camera"
        place = np.array([CIRCLE * x, -CIRCLE * y])
        dots.append(_light(place, told, ringed=k == current, hollow=z < 0))
    dots.append(dots.pop(current))  # on top
    rings = "".join(
        f'<circle r="{CIRCLE * np.sin(np.radians(angle)):.1f}" stroke-opacity="{ink}"/>'
        for angle, ink in ((30, 0.2), (60, 0.2), (90, 0.7))
    )
    angles = "".join(
        f'<text x="0" y="{CIRCLE * np.sin(np.radians(angle)) - 3:.1f}" text-anchor="middle" '
        f'fill-opacity="0.7">{angle}°</text>'
        for angle in (30, 60)
    )
    a = CIRCLE
    cross = f'<path d="M{-a} 0H{a}M0 {-a}V{a}" stroke-opacity="0.2"/>'
    words = (
        f'<text x="{a + 6}" y="4" font-weight="600" font-size="12">x</text>'
        f'<text x="0" y="{-a - 7}" text-anchor="middle" font-weight="600" font-size="12">y</text>'
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-150 {-a - 20} 300 {2 * a + 30}" '
        'width="100%" role="img" aria-label="directions of the lights" fill="currentColor" '
        'font-family="system-ui,sans-serif" font-size="10" style="max-width:420px;display:block;'
        f'margin:0 auto"><g fill="none" stroke="currentColor">{rings}{cross}</g>'
        f"{words}{angles}{''.join(dots)}</svg>"
    )


def describe_coefficients(count: int, current: int) -> str:
    """What `plot_coefficients` shows, and what to do for more."""
    return (
        f"Coefficients of all {count} images; image {current} is ringed. Recover the shape (tab "
        "Shape) to see the directions of the lights."
    )


def describe_lights(count: int, current: int, *, recovered: bool) -> str:
    """What `plot_lights` shows: lights that were recovered with a shape, or given ones."""
    by = "as recovered" if recovered else "as given"
    return (
        f"Lights of all {count} images {by}, seen from the camera; rim: from the side. Image "
        f"{current} is ringed; hollow: from behind."
    )


def format_vector(vector: ArrayLike) -> str:
    """Three coefficients with three decimals, in parentheses."""
    return f"({', '.join(f'{value:z.3f}' for value in np.asarray(vector, float).tolist())})"


def _light(place: NDArray[np.float64], told: str, *, ringed: bool, hollow: bool = False) -> str:
    x, y = place
    spot = css_colour(Factor.SPECULAR)
    at = f'cx="{x:.1f}" cy="{y:.1f}"'
    ring = f'<circle {at} r="8" fill="none" stroke="currentColor" stroke-width="2"/>'
    return (
        f"<g><title>{escape(told)}</title>{ring if ringed else ''}"
        f'<circle {at} r="{4.5 if ringed else 3}" fill="{"none" if hollow else spot}" '
        f'stroke="{spot if hollow else "currentColor"}" stroke-width="{1.4 if hollow else 0.5}"/>'
        "</g>"
    )
