"""The T-Ts landscape as a picture. Pure; text colour is inherited."""

import base64
from math import ceil, floor, log10
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from photolin.factors import TITLES, Thresholds
from photolin.landscape import Landscape

from .readout import escape
from .render import encode_png

Quantity = Literal[
    "change",
    "undefined",
    "diffuse",
    "specular",
    "attached shadow",
    "cast shadow",
    "macro accuracy",
]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)

SIDE, LEFT, TOP, RIGHT, BOTTOM = 200, 60, 12, 58, 38
"""Width and height of the map, and what is around it, in the units of the drawing."""
BAR = 10
"""Width of the legend's colours."""
ANCHORS = (
    (0x44, 0x01, 0x54),
    (0x48, 0x28, 0x78),
    (0x3E, 0x4A, 0x89),
    (0x31, 0x68, 0x8E),
    (0x26, 0x82, 0x8E),
    (0x1F, 0x9E, 0x89),
    (0x35, 0xB7, 0x79),
    (0x6D, 0xCD, 0x59),
    (0xB4, 0xDE, 0x2C),
    (0xFD, 0xE7, 0x25),
)
"""sRGB from least to greatest: even steps of viridis (S. van der Walt, N. Smith, CC0), whose
lightness rises evenly for every kind of colour vision."""


def plot_landscape(
    landscape: Landscape,
    quantity: Quantity,
    present: Thresholds,
    suggested: tuple[int, int],
    element_id: str,
) -> str:
    """The map of one quantity over T (to the right) and Ts (upwards), both on log scales.

    Args:
        present: where the crosshair is; at the border where the map does not reach.
        suggested: (row, column) of the cell with a ring.
        element_id: of the part that shows the map alone, for clicks.

    Returns:
        HTML holding one SVG, without scripts.
    """
    values = quantity_values(landscape, quantity)
    low, high = _range(values)
    scaled = np.nan_to_num((values - low) / (high - low))
    png = base64.b64encode(encode_png(colour(scaled)[::-1])).decode("ascii")
    width, height = LEFT + SIDE + RIGHT, TOP + SIDE + BOTTOM
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="100%" '
        'role="img" fill="currentColor" font-family="system-ui,sans-serif" font-size="11" '
        f'style="max-width:{width / 10:.1f}rem;display:block;margin:0 auto">'
        f"<title>{escape(quantity)} over T and Ts</title>"
        f'<svg x="{LEFT}" y="{TOP}" width="{SIDE}" height="{SIDE}" style="cursor:crosshair">'
        f'<g id="{escape(element_id)}"><image href="data:image/png;base64,{png}" '
        f'width="{SIDE}" height="{SIDE}" preserveAspectRatio="none" '
        f'style="image-rendering:pixelated"/></g>{_marks(landscape, present, suggested)}</svg>'
        f"{_axes(landscape)}{_legend(low, high)}</svg>"
    )


def thresholds_at(landscape: Landscape, x: float, y: float) -> Thresholds:
    """T and Ts of the cell at fractions of the map from its upper left corner, 0 to 1."""
    n = len(landscape.T)
    column, row = (min(max(int(place * n), 0), n - 1) for place in (x, 1 - y))
    return Thresholds(float(landscape.T[column]), float(landscape.Ts[row]))


def quantity_values(landscape: Landscape, quantity: Quantity) -> NDArray[np.float64]:
    """(n,n) percent; NaN where a map has no accuracy."""
    if quantity == "change":
        return 100 * landscape.change
    if quantity == "macro accuracy":
        nothing = np.full(landscape.change.shape, np.nan)
        return nothing if landscape.accuracy is None else landscape.accuracy
    factor = next(factor for factor, title in TITLES.items() if title == quantity)
    return 100 * landscape.shares[factor]


def describe_cell(
    landscape: Landscape, quantity: Quantity, present: Thresholds, suggested: tuple[int, int]
) -> str:
    """The quantity at the present thresholds and at the suggested cell, in words with numbers."""
    values = quantity_values(landscape, quantity)
    here, there = landscape.cell(present.T, present.Ts), suggested

    def tell(cell: tuple[int, int]) -> str:
        row, column = cell
        return (
            f"T {landscape.T[column]:.3g}, Ts {landscape.Ts[row]:.3g}: {values[cell]:.2f} % {what}"
        )

    what = {
        "change": "of the labels change from this cell to the next",
        "macro accuracy": "macro accuracy",
    }.get(quantity, f"{quantity} of all observations")
    beyond = "" if _inside(landscape, present) else " (the border of the map; T or Ts lie beyond)"
    if here == there:
        return f"At {tell(here)}{beyond}; labels change least around there."
    least = "labels change least around it, the best T is often smaller"
    return f"At {tell(here)}{beyond}. Ring: {tell(there)}; {least}."


def colour(scaled: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Colours (...,3) sRGB of values 0 to 1."""
    table = np.array(ANCHORS, float)
    at = np.linspace(0, 1, len(table))
    channels = [np.interp(scaled, at, table[:, channel]) for channel in range(3)]
    return np.rint(np.stack(channels, axis=-1)).astype(np.uint8)


def _range(values: NDArray[np.float64]) -> tuple[float, float]:
    """What the colours span: at least a tenth of a percent, for less is nothing to look at."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    return low, max(high, low + 0.1)


def _ends(axis: NDArray[np.float64]) -> tuple[float, float]:
    """log10 of the borders: half a cell beyond the first and last middle."""
    first, last = log10(axis[0]), log10(axis[-1])
    half = (last - first) / (2 * (len(axis) - 1))
    return first - half, last + half


def _inside(landscape: Landscape, present: Thresholds) -> bool:
    pairs = ((landscape.T, present.T), (landscape.Ts, present.Ts))
    return all(v > 0 and 0 <= _place(axis, v) <= 1 for axis, v in pairs)


def _place(axis: NDArray[np.float64], value: float) -> float:
    """Where a value above 0 is: 0 at the first border of the map, 1 at the last."""
    low, high = _ends(axis)
    return (log10(value) - low) / (high - low)


def _marks(landscape: Landscape, present: Thresholds, suggested: tuple[int, int]) -> str:
    """Crosshair and ring, white on black so that they show on every colour; clicks go through."""
    across, up = (
        min(max(_place(axis, v), 0), 1) if v > 0 else 0.0
        for axis, v in ((landscape.T, present.T), (landscape.Ts, present.Ts))
    )
    x, y = round(SIDE * across, 1), round(SIDE * (1 - up), 1)
    cell = SIDE / len(landscape.T)
    row, column = suggested
    ring = f'cx="{(column + 0.5) * cell:.1f}" cy="{SIDE - (row + 0.5) * cell:.1f}"'
    drawn = "".join(
        f'<path d="M{x} 0V{SIDE}M0 {y}H{SIDE}" stroke="{ink}" stroke-width="{wide / 2}"/>'
        f'<circle {ring} r="{max(cell * 0.7, 5):.1f}" stroke="{ink}" stroke-width="{wide}"/>'
        for ink, wide in (("#000", 4), ("#fff", 2))
    )
    return f'<g fill="none" pointer-events="none">{drawn}</g>'


def _axes(landscape: Landscape) -> str:
    parts = []
    for value in _ticks(*_ends(landscape.T)):
        x = LEFT + SIDE * _place(landscape.T, value)
        parts.append(
            f'<path d="M{x:.1f} {TOP + SIDE}v4" stroke="currentColor"/>'
            f'<text x="{x:.1f}" y="{TOP + SIDE + 15}" text-anchor="middle">{value:g}</text>'
        )
    for value in _ticks(*_ends(landscape.Ts)):
        y = TOP + SIDE * (1 - _place(landscape.Ts, value))
        parts.append(
            f'<path d="M{LEFT} {y:.1f}h-4" stroke="currentColor"/>'
            f'<text x="{LEFT - 6}" y="{y:.1f}" text-anchor="end" dominant-baseline="central">'
            f"{value:g}</text>"
        )
    middle = TOP + SIDE / 2
    return (
        f"{''.join(parts)}"
        f'<text x="{LEFT + SIDE / 2}" y="{TOP + SIDE + 31}" text-anchor="middle">'
        "T, relative tolerance</text>"
        f'<text x="0" y="0" transform="translate(9 {middle}) rotate(-90)" text-anchor="middle">'
        "Ts, shadow level (fraction of full scale)</text>"
    )


def _ticks(low: float, high: float) -> list[float]:
    """1, 2 and 5 times powers of ten between powers of ten; without 2 and 5 over two decades."""
    steps = (1, 2, 5) if high - low < 2 else (1, 3) if high - low < 3 else (1,)
    powers = range(floor(low), ceil(high) + 1)
    values = [float(f"{step}e{power}") for power in powers for step in steps]
    return [value for value in values if low <= log10(value) <= high]


def _legend(low: float, high: float) -> str:
    """Colours with their numbers, percent, least below."""
    png = base64.b64encode(encode_png(colour(np.linspace(1, 0, 64)[:, None]))).decode("ascii")
    x = LEFT + SIDE + 8
    decimals = max(0, 1 - floor(log10(high - low)))
    numbers = "".join(
        f'<text x="{x + BAR + 3}" y="{TOP + SIDE * (1 - at):.1f}" dominant-baseline="central">'
        f"{low + at * (high - low):.{decimals}f}{' %' if at == 1 else ''}</text>"
        for at in (0, 0.25, 0.5, 0.75, 1)
    )
    return (
        f'<image x="{x}" y="{TOP}" width="{BAR}" height="{SIDE}" preserveAspectRatio="none" '
        f'href="data:image/png;base64,{png}"/>{numbers}'
    )
