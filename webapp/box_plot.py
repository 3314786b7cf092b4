"""A cube of space drawn from any side: axes with ticks, points inside it. Pure; SVG text.

Orthographic, so that equal lengths along an axis look equal; text colour is inherited.
"""

from dataclasses import dataclass
from itertools import product
from math import ceil, cos, hypot, radians, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photolin.export.html_plots import thin_ticks, ticks

from .readout import escape

WIDTH, HEIGHT = 300, 250
"""Of the drawing, in its units (pixels at its natural size)."""
MIDST = (WIDTH / 2, 111)
"""Where the centre of the cube is; names and numbers stand below it."""
HALF = 62
"""Half a side of the cube, drawing units; its corners stay clear of the border by the labels."""
SHORT = 8
"""Length of an edge, drawing units, below which it is seen end-on."""
ROOM = (25, 11)
"""Width and height of a number, drawing units."""
MIDDLE = (0.1, 0.9)
"""Quantiles on each axis that a chosen cube holds at least; tails may reach a hundred times as
far."""
LEAST = 0.02
"""Half a side of a chosen cube at the least, relative to how far from 0 its focus is."""
SIDEWAYS = 0.4
"""How far an edge may face sideways for its numbers to stand below it."""


@dataclass(frozen=True)
class View:
    """Where the cube is seen from."""

    azimuth: float
    """Degrees around the third axis, from the first to the second."""
    elevation: float
    """Degrees above the plane of the first two, -90 to 90."""

    @property
    def rotation(self) -> NDArray[np.float64]:
        """(3,3): rows are right, up and towards the viewer."""
        a, e = radians(self.azimuth), radians(self.elevation)
        right = (-sin(a), cos(a), 0.0)
        up = (-sin(e) * cos(a), -sin(e) * sin(a), cos(e))
        return np.array([right, up, (cos(e) * cos(a), cos(e) * sin(a), sin(e))])


@dataclass(frozen=True, eq=False)
class Box:
    """A cube, and how it is seen."""

    centre: NDArray[np.float64]
    """(3,)"""
    half: float
    """Half a side, above 0, in the unit of the axes."""
    view: View

    def holds(self, points: ArrayLike) -> NDArray[np.bool_]:
        """(...) which of the points (...,3) lie inside."""
        away = np.abs(np.asarray(points, np.float64) - self.centre)
        return np.asarray((away <= self.half).all(axis=-1))

    def place(self, points: ArrayLike) -> NDArray[np.float64]:
        """(...,2) x and y in the drawing of points (...,3)."""
        unit = (np.asarray(points, np.float64) - self.centre) * (HALF / self.half)
        right, up = unit @ self.view.rotation[0], unit @ self.view.rotation[1]
        return np.stack([MIDST[0] + right, MIDST[1] - up], axis=-1)


def choose_box(
    points: ArrayLike, important: ArrayLike, focus: ArrayLike, view: View, zoom: float = 1.0
) -> Box:
    """A cube that holds the middle of the points on each axis, and all that is important.

    Args:
        points: (N,3) finite.
        important: (M,3) finite.
        focus: (3,) what is in the middle when `zoom` is great.
        zoom: 1 or more.
    """
    points, focus = np.asarray(points, np.float64), np.asarray(focus, np.float64)
    quantiles = np.quantile(points, MIDDLE, axis=0)
    ends = np.concatenate([quantiles, np.asarray(important, np.float64)])
    low, high = ends.min(axis=0), ends.max(axis=0)
    least = LEAST * max(float(np.linalg.norm(focus)), 0.1)
    half = max(1.15 * float((high - low).max()) / 2, least)
    return Box(focus + ((low + high) / 2 - focus) / zoom, half / zoom, view)


def draw_box(box: Box, names: tuple[str, str, str], inner: str, title: str) -> str:
    """The cube with what is in it.

    Args:
        names: of the axes; any text.
        inner: SVG text of what is in it, in the units of the drawing.
        title: what a screen reader says.

    Returns:
        One SVG.
    """
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="100%" '
        'role="img" fill="currentColor" font-family="system-ui,sans-serif" font-size="10" '
        f'aria-label="{escape(title)}" style="max-width:{1.4 * WIDTH:g}px;display:block;'
        f'margin:0 auto;user-select:none">{_walls(box)}{_axes(box, names)}{inner}</svg>'
    )


def _walls(box: Box) -> str:
    """The three faces behind, each with lines at the ticks."""
    behind = -_facing(box)
    lines = []
    for axis in range(3):
        first, second = (other for other in range(3) if other != axis)
        for along, across in ((first, second), (second, first)):
            low, high = box.centre[across] - box.half, box.centre[across] + box.half
            for value in [low, *_numbers(box, across), high]:
                ends = np.array([box.centre, box.centre])
                ends[:, axis] += behind[axis] * box.half
                ends[:, across] = value
                ends[:, along] += np.array([-box.half, box.half])
                lines.append(_stroke(box, ends))
    return f'<path d="{"".join(lines)}" fill="none" stroke="currentColor" stroke-opacity="0.14"/>'


def _axes(box: Box, names: tuple[str, str, str]) -> str:
    parts = []
    for axis in range(3):
        ends = _silhouette(box, axis)
        a, b = box.place(ends)
        out = _outwards(a, b)
        parts.append(f'<path d="{_stroke(box, ends)}" stroke="currentColor" stroke-opacity="0.7"/>')
        side = "start" if out[0] > SIDEWAYS else "end" if out[0] < -SIDEWAYS else "middle"
        away = 7 if abs(out[0]) > SIDEWAYS else 12
        for value in _spaced(_numbers(box, axis), (b - a) / (2 * box.half)):
            tick = a + (value - ends[0, axis]) / (2 * box.half) * (b - a)
            parts.append(
                f'<path d="M{_pair(tick)}L{_pair(tick + 4 * out)}" stroke="currentColor"/>'
            )
            parts.append(_text(tick + away * out, f"{value:g}", f'text-anchor="{side}"'))
        # numbers beside an upright edge take more room than those below a level one
        place = (a + b) / 2 + (27 + 19 * abs(out[0])) * out
        look = 'text-anchor="middle" font-weight="600" font-size="12"'
        parts.append(_text(place, escape(names[axis]), look))
    return "".join(parts)


def _spaced(numbers: list[float], unit: NDArray[np.float64]) -> list[float]:
    """Every so many of the numbers that they do not lie over each other; none where none fits.

    Args:
        unit: (2,) how far a step of 1 along their axis leads in the drawing.
    """
    step = numbers[1] - numbers[0]
    need = [room / max(abs(step * along), 1e-9) for room, along in zip(ROOM, unit, strict=True)]
    return thin_ticks(numbers, min(need)) if ceil(min(need)) < len(numbers) else []


def _outwards(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2,) unit, across the edge from a to b and away from the middle of the drawing."""
    away = (a + b) / 2 - MIDST
    along = b - a
    out = np.array([-along[1], along[0]]) if hypot(*along) >= SHORT else away
    out = out if out @ away >= 0 else -out
    length = hypot(*out)
    return out / length if length > 0 else np.array([0.0, 1.0])


def _silhouette(box: Box, axis: int) -> NDArray[np.float64]:
    """(2,3) ends of the edge along an axis that is lowest, or leftmost for the third axis.

    Only edges between a face in front and one behind have nothing of the cube beside them.
    """
    front = _facing(box)
    first, second = (other for other in range(3) if other != axis)
    best, found = -np.inf, np.empty((2, 3))
    for one, two in product((-1, 1), repeat=2):
        if (one == front[first]) == (two == front[second]):
            continue
        ends = np.array([box.centre, box.centre])
        ends[:, first] += one * box.half
        ends[:, second] += two * box.half
        ends[:, axis] += np.array([-box.half, box.half])
        x, y = box.place(ends).mean(axis=0)
        rank = -x if axis == 2 else y
        if rank > best + 1e-6:
            best, found = rank, ends
    return found


def _facing(box: Box) -> NDArray[np.float64]:
    """(3,) 1 where the upper face of an axis faces the viewer, -1 where the lower one does."""
    return np.where(box.view.rotation[2] >= 0, 1.0, -1.0)


def _numbers(box: Box, axis: int) -> list[float]:
    return ticks(float(box.centre[axis] - box.half), float(box.centre[axis] + box.half))


def _stroke(box: Box, ends: NDArray[np.float64]) -> str:
    a, b = box.place(ends)
    return f"M{_pair(a)}L{_pair(b)}"


def _pair(point: NDArray[np.float64]) -> str:
    return f"{point[0]:.1f} {point[1]:.1f}"


def _text(point: NDArray[np.float64], text: str, look: str) -> str:
    return (
        f'<text x="{point[0]:.1f}" y="{point[1]:.1f}" dominant-baseline="central" {look}>'
        f"{text}</text>"
    )
