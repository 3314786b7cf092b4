"""Plots as SVG text. Pure; text colour is inherited, so that they read on a light and a dark page.

SVG and not the built-in uPlot: Fig. 4 needs a square with one scale for both axes, filled
wedges, a vertical line and a ring, all of which uPlot has no word for.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from photolin.export.html_plots import thin_ticks, ticks
from photolin.factors import LETTERS, TITLES, Factor, Thresholds, css_colour

from .readout import escape

Point = tuple[float, float]

LEFT, TOP, RIGHT, BOTTOM = 62, 22, 16, 36
"""Margins around the plot, in the units of the drawing (pixels at its natural size)."""
DIGIT = 6.2
"""Width of a digit of the axes, drawing units."""
BELOW = 0.1
"""How far the axes go below zero at least, of how far they go above it."""


@dataclass(frozen=True, eq=False)
class PixelPanel:
    """The K observations of one pixel by one method."""

    title: str
    """Heading, as the method's name."""
    i: NDArray[np.float32]
    """(K,) input, fraction of full scale."""
    l: NDArray[np.float32]
    """(K,) linearized (signed), fraction of full scale; NaN is left out."""
    labels: NDArray[np.uint8]
    """(K,) Factor codes."""


@dataclass(frozen=True)
class _Axes:
    """One scale for both axes: i from `left`, l from `low`, both to `high`.

    A square, unless l goes farther below zero than i, which is never negative.
    """

    left: float
    low: float
    high: float
    unit: float
    """Drawing units for 1 of full scale."""

    @property
    def size(self) -> Point:
        """(width, height) of the plot, drawing units."""
        return self.at(self.high, self.low)

    def at(self, i: float, l: float) -> Point:
        """Drawing coordinates of (i, l) from the plot's upper left corner."""
        return round((i - self.left) * self.unit, 2), round((self.high - l) * self.unit, 2)


def plot_pixel(
    panels: Sequence[PixelPanel], thresholds: Thresholds, current: int, names: Sequence[str]
) -> str:
    """Input against linearized intensity of one pixel (Fig. 4), methods side by side (Fig. 9).

    Args:
        panels: one for each method; all share one range of the axes.
        thresholds: T and Ts, which draw the regions.
        current: image number, from 0, whose dot is larger and ringed.
        names: K image names, for the dots' tooltips; any text.

    Returns:
        HTML holding one SVG for each panel, without scripts, names escaped.
    """
    axes = _choose_axes(panels, thresholds.Ts)
    drawings = "".join(_draw(panel, axes, thresholds, current, names) for panel in panels)
    return (
        '<div style="display:grid;gap:4px;'
        f'grid-template-columns:repeat(auto-fit,minmax(150px,1fr))">{drawings}</div>'
    )


def _choose_axes(panels: Sequence[PixelPanel], Ts: float) -> _Axes:
    """Hold every dot, unless l is far outside the range of i: such dots go to the border."""
    i = np.concatenate([panel.i for panel in panels])
    l = np.concatenate([panel.l for panel in panels])
    bright = max(float(i.max()), 2 * Ts, 1e-3)
    l = l[np.isfinite(l)].clip(-bright, 1.5 * bright)
    high = 1.06 * max(bright, float(l.max(initial=0)))
    left = -BELOW * high
    low = min(float(l.min(initial=0)) - 0.05 * high, left)
    width, height = (200, 200) if len(panels) == 1 else (150, 200)
    return _Axes(left, low, high, min(width / (high - left), height / (high - low)))


def _draw(
    panel: PixelPanel, axes: _Axes, thresholds: Thresholds, current: int, names: Sequence[str]
) -> str:
    wide, high = axes.size
    width, height = LEFT + wide + RIGHT, TOP + high + BOTTOM
    inner = (
        _regions(axes, thresholds) + _lines(axes, thresholds) + _dots(panel, axes, current, names)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="100%" '
        'role="img" fill="currentColor" font-family="system-ui,sans-serif" font-size="11" '
        f'style="max-width:{width / 14.8:.1f}rem;display:block;margin:0 auto">'
        f'<text x="{LEFT}" y="14" font-weight="600">{escape(panel.title)}</text>'
        f'<svg x="{LEFT}" y="{TOP}" width="{wide}" height="{high}">{inner}</svg>'
        f"{_frame(axes)}</svg>"
    )


def _regions(axes: _Axes, thresholds: Thresholds) -> str:
    """The classes of Eq. (3) as areas, each with its letter; the plot clips what sticks out."""
    left, low, high, far = axes.left, axes.low, axes.high, 3 * axes.high
    T, Ts = thresholds.T, thresholds.Ts
    upper, lower = 1 + T, 1 - T
    wedge_end = [(high, lower * high), (Ts, lower * Ts)]
    areas: list[tuple[Factor, list[Point]]] = [
        (Factor.ATTACHED, [(left, low), (Ts, low), (Ts, 0), (left, 0)]),
        (Factor.CAST, [(left, 0), (Ts, 0), (Ts, far), (left, far)]),
        (Factor.DIFFUSE, [(Ts, upper * Ts), (high, upper * high), *wedge_end]),
        (Factor.SPECULAR, [(Ts, 0), (high, 0), *wedge_end]),
        (Factor.UNDEFINED, [(Ts, upper * Ts), (high, upper * high), (high, far), (Ts, far)]),
        (Factor.UNDEFINED, [(Ts, low), (high, low), (high, 0), (Ts, 0)]),
    ]
    middle, dark = (Ts + high) / 2, (left + Ts) / 2
    letters: list[tuple[Factor, Point]] = [
        (Factor.ATTACHED, (dark, low / 2)),
        (Factor.CAST, (dark, high / 2)),
        (Factor.SPECULAR, (0.75 * high, lower * 0.35 * high)),
        (Factor.UNDEFINED, (Ts + 0.2 * (high - Ts), 0.8 * high)),
        (Factor.UNDEFINED, (middle, low / 2)),
    ]
    fills = "".join(
        f'<polygon points="{_points(axes, area)}" fill="{css_colour(factor)}" fill-opacity="0.12"/>'
        for factor, area in areas
    )
    texts = "".join(
        '<text x="{}" y="{}" text-anchor="middle" dominant-baseline="central" font-weight="600" '
        'fill="{}">{}</text>'.format(*axes.at(*place), css_colour(factor), LETTERS[factor])
        for factor, place in letters
    )
    return fills + texts


def _lines(axes: _Axes, thresholds: Thresholds) -> str:
    left, low, high, T, Ts = axes.left, axes.low, axes.high, thresholds.T, thresholds.Ts
    lines: list[tuple[str, Point, Point]] = [
        ('stroke-opacity="0.35"', (left, left), (high, high)),
        ('stroke-opacity="0.5"', (left, 0), (high, 0)),
        ('stroke-dasharray="4 3"', (Ts, low), (Ts, high)),
        (f'stroke="{css_colour(Factor.DIFFUSE)}"', (Ts, (1 - T) * Ts), (high, (1 - T) * high)),
        (f'stroke="{css_colour(Factor.DIFFUSE)}"', (Ts, (1 + T) * Ts), (high, (1 + T) * high)),
    ]
    drawn = "".join(
        '<line x1="{}" y1="{}" x2="{}" y2="{}" {}/>'.format(*axes.at(*a), *axes.at(*b), look)
        for look, a, b in lines
    )
    return f'<g stroke="currentColor" stroke-width="1">{drawn}</g>'


def _dots(panel: PixelPanel, axes: _Axes, current: int, names: Sequence[str]) -> str:
    """One dot for each image, the current one last (on top), larger and ringed."""
    drawn = [k for k in range(len(panel.i)) if np.isfinite(panel.l[k])]
    drawn.sort(key=lambda k: k == current)
    return "".join(_dot(panel, k, axes, names[k], ringed=k == current) for k in drawn)


def _dot(panel: PixelPanel, k: int, axes: _Axes, name: str, *, ringed: bool) -> str:
    i, l, factor = float(panel.i[k]), float(panel.l[k]), Factor(int(panel.labels[k]))
    x, y = axes.at(i, min(max(l, axes.low), axes.high))
    ring = f'<circle cx="{x}" cy="{y}" r="9" fill="none" stroke="currentColor" stroke-width="2"/>'
    return (
        f"<g><title>{escape(f'{name}: i {i:.3f}, l {l:z.3f}, {TITLES[factor]}')}</title>"
        f"{ring if ringed else ''}"
        f'<circle cx="{x}" cy="{y}" r="{5 if ringed else 3.2}" fill="{css_colour(factor)}" '
        'stroke="currentColor" stroke-width="0.6"/></g>'
    )


def _frame(axes: _Axes) -> str:
    """Border, ticks and names of the axes, and the letter of the wedge, too thin to hold one."""
    wide, high = axes.size
    parts = [
        f'<rect x="{LEFT}" y="{TOP}" width="{wide}" height="{high}" fill="none" '
        'stroke="currentColor" stroke-opacity="0.5"/>'
        f'<text x="{LEFT + wide + 4:g}" y="{TOP + 9}" font-weight="600" '
        f'fill="{css_colour(Factor.DIFFUSE)}">{LETTERS[Factor.DIFFUSE]}</text>'
    ]
    numbers = ticks(axes.left, axes.high)
    room = DIGIT * (1 + max(len(f"{value:g}") for value in numbers))
    for value in thin_ticks(numbers, room / (axes.unit * (numbers[1] - numbers[0]))):
        x, _ = axes.at(value, 0)
        parts.append(
            f'<text x="{LEFT + x:g}" y="{TOP + high + 14:g}" text-anchor="middle">{value:g}</text>'
        )
    for value in ticks(axes.low, axes.high):
        _, y = axes.at(0, value)
        parts.append(f'<text x="{LEFT - 5}" y="{TOP + y + 4:g}" text-anchor="end">{value:g}</text>')
    parts.append(
        f'<text x="{LEFT + wide / 2:g}" y="{TOP + high + 30:g}" text-anchor="middle">'
        "input i (of full scale)</text>"
        f'<text transform="translate(10 {TOP + high / 2:g}) rotate(-90)" text-anchor="middle">'
        "linearized l (of full scale)</text>"
    )
    return "".join(parts)


def _points(axes: _Axes, corners: Sequence[Point]) -> str:
    return " ".join("{},{}".format(*axes.at(*corner)) for corner in corners)
