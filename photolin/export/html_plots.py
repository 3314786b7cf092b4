"""Plots of a page as SVG text: lines and words in the page's colour, so light and dark both read.

All text in them is the program's own; nothing of the user's gets here.
"""

from collections.abc import Mapping, Sequence
from math import ceil, floor, log10

import numpy as np
from numpy.typing import NDArray

from ..factors import LETTERS, Factor, css_colour

WIDTH, HEIGHT, MARGIN, BELOW = 440, 150, 14, 36
"""Of the plot itself, and around it, in the units of the drawing (pixels at its natural size)."""


def plot_histogram(
    counts: NDArray[np.floating],
    low: float,
    high: float,
    lines: Mapping[str, float],
    axis: str,
    band: tuple[float, float] | None = None,
) -> str:
    """Counts as areas whose heights are their square roots, so that small ones show.

    Args:
        counts: (N,) of equal bins from `low` to `high`.
        lines: name and place of dashed lines; those outside stand at the border.
        axis: what x is, with its unit; plain text without < and &.
        band: where diffuse is, from and to.
    """
    tallest = max(float(np.sqrt(counts.max(initial=0))), 1.0)

    def x(value: float) -> float:
        share = (min(max(value, low), high) - low) / (high - low)
        return round(MARGIN + WIDTH * share, 2)

    width = WIDTH / len(counts)
    steps = [f"M{MARGIN} {HEIGHT}"]
    for n, count in enumerate(counts):
        y = HEIGHT - (HEIGHT - 16) * float(np.sqrt(count)) / tallest
        steps.append(f"V{y:.1f}H{MARGIN + (n + 1) * width:.1f}")
    parts = [f'<path d="{"".join(steps)}V{HEIGHT}Z" fill="currentColor" fill-opacity="0.45"/>']
    if band is not None:
        a, b = map(x, band)
        parts.append(
            f'<rect x="{a}" y="0" width="{b - a:.2f}" height="{HEIGHT}" '
            f'fill="{css_colour(Factor.DIFFUSE)}" fill-opacity="0.25"/>'
        )
    for name, value in lines.items():
        at = x(value)
        anchor = "start" if at < MARGIN + WIDTH / 2 else "end"
        parts.append(
            f'<line x1="{at}" y1="0" x2="{at}" y2="{HEIGHT}" stroke="currentColor" '
            f'stroke-dasharray="4 3"/><text x="{at + (4 if anchor == "start" else -4)}" y="11" '
            f'text-anchor="{anchor}">{name}</text>'
        )
    parts.append(
        f'<line x1="{MARGIN}" y1="{HEIGHT}" x2="{MARGIN + WIDTH}" y2="{HEIGHT}" '
        'stroke="currentColor"/>'
    )
    for tick in ticks(low, high):
        parts.append(f'<text x="{x(tick)}" y="{HEIGHT + 14}" text-anchor="middle">{tick:g}</text>')
    parts.append(
        f'<text x="{MARGIN + WIDTH / 2}" y="{HEIGHT + 31}" text-anchor="middle">{axis}</text>'
    )
    return _svg(WIDTH + 2 * MARGIN, HEIGHT + BELOW, axis, "".join(parts))


def plot_shares(percents: Sequence[float]) -> str:
    """One bar, divided as the classes are, in the order of the legend; 0 to 100 each."""
    at, parts = 0.0, []
    for factor, percent in zip(LETTERS, percents, strict=True):
        place = f'x="{at:.2f}" y="0" width="{percent:.2f}" height="10"'
        parts.append(f'<rect {place} fill="{css_colour(factor)}"/>')
        at += percent
    words = ", ".join(
        f"{letter} {percent:.1f} %"
        for letter, percent in zip(LETTERS.values(), percents, strict=True)
    )
    return _svg(100, 10, words, "".join(parts))


def ticks(low: float, high: float) -> list[float]:
    """Three to seven round numbers inside the range."""
    third = (high - low) / 3
    power = 10.0 ** floor(log10(third))
    step = max(s * power for s in (1, 2, 5) if s * power <= third)
    numbers = range(int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9)) + 1)
    return [float(f"{n * step:.6g}") for n in numbers]


def thin_ticks(numbers: list[float], gaps: float) -> list[float]:
    """Every so many of evenly spaced numbers, 0 among them, that they do not lie over each other.

    Args:
        gaps: how much room one takes, in gaps between two neighbours.
    """
    step, every = numbers[1] - numbers[0], max(1, ceil(gaps))
    return [value for value in numbers if round(value / step) % every == 0]


def _svg(width: float, height: float, words: str, inner: str) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" '
        f'aria-label="{words}" fill="currentColor" font-size="11" style="max-width:{width}px">'
        f"{inner}</svg>"
    )
