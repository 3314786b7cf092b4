"""Histograms behind T and Ts. Pure; SVG text that inherits the page's colour."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from photolin.export.html_plots import ticks
from photolin.factors import Factor, css_colour

from .readout import escape

WIDTH, HEIGHT = 300, 114
LEFT, TOP, BOTTOM = 8, 18, 30
BINS = 48
BEYOND = 0.01
"""Share of values beyond the axis from which it is told."""
SHADOW, LIT = Factor.CAST, Factor.DIFFUSE
"""Classes in whose colours the samples of both kinds are drawn."""


def plot_histogram(
    kinds: Sequence[tuple[NDArray[np.floating], str]],
    top: float,
    proposed: float,
    present: float,
    axis: str,
) -> str:
    """Samples of one or two kinds in bins from 0 to `top`, and a level that they stand for.

    Args:
        kinds: values and CSS colour of each; each kind is scaled to its own fullest bin.
        top: right end of the axis, above 0; the share of values beyond it is told.
        proposed: the level, a line.
        present: the level that is set, a dashed line.
        axis: name of the axis, with its unit.
    """
    wide, high = WIDTH - 2 * LEFT, HEIGHT - TOP - BOTTOM
    parts = []
    for order, (values, colour) in enumerate(kinds):
        parts.append(_tell_beyond(values, colour, top, WIDTH - LEFT - 90 * order))
        counts, _ = np.histogram(values, BINS, (0, top))
        if not counts.any():
            continue
        for n, share in enumerate((counts / counts.max()).tolist()):
            if share > 0:
                parts.append(
                    f'<rect x="{LEFT + n * wide / BINS:.2f}" width="{wide / BINS - 0.5:.2f}" '
                    f'y="{TOP + (1 - share) * high:.2f}" height="{share * high:.2f}" '
                    f'fill="{colour}" fill-opacity="0.6"/>'
                )
    for level, dash in ((present, ' stroke-dasharray="4 3"'), (proposed, "")):
        if 0 <= level <= top:
            x = LEFT + level / top * wide
            parts.append(
                f'<line x1="{x:.2f}" x2="{x:.2f}" y1="{TOP}" y2="{TOP + high}" '
                f'stroke="currentColor" stroke-width="1.5"{dash}/>'
            )
    parts.append(
        f'<line x1="{LEFT}" x2="{LEFT + wide}" y1="{TOP + high}" y2="{TOP + high}" '
        'stroke="currentColor" stroke-opacity="0.5"/>'
    )
    for value in ticks(0, top):
        x = LEFT + value / top * wide
        anchor = "end" if x > WIDTH - 2 * LEFT else "middle"
        parts.append(
            f'<text x="{min(x, WIDTH - 2):.2f}" y="{TOP + high + 12}" text-anchor="{anchor}">'
            f"{value:g}</text>"
        )
    parts.append(
        f'<text x="{WIDTH / 2:g}" y="{HEIGHT - 4}" text-anchor="middle">{escape(axis)}</text>'
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="100%" '
        'role="img" fill="currentColor" font-family="system-ui,sans-serif" font-size="10">'
        f"{''.join(parts)}</svg>"
    )


def _tell_beyond(values: NDArray[np.floating], colour: str, top: float, x: float) -> str:
    """The share of values that lie beyond the axis, above its bars, ending at `x`; none for few."""
    beyond = float((values > top).mean()) if values.size else 0.0
    if beyond < BEYOND:
        return ""
    return (
        f'<text x="{x:g}" y="{TOP - 7}" text-anchor="end">{beyond:.0%} beyond '
        f'\N{RIGHTWARDS ARROW}<tspan fill="{colour}"> \N{BLACK SQUARE}</tspan></text>'
    )


def plot_residuals(values: NDArray[np.float32], proposed: float, present: float) -> str:
    """The residuals below the fit, with a proposed T and the one that is set."""
    top = 2.5 * max(proposed, present)
    if values.size:
        top = max(top, min(float(np.quantile(values, 0.99)), 0.5))
    kinds = [(values, css_colour(Factor.DIFFUSE))]
    return plot_histogram(kinds, top, proposed, present, "(l - i)/i below the fit")


def plot_samples(
    shadows: NDArray[np.float32], lit: NDArray[np.float32], proposed: float, present: float
) -> str:
    """Sampled intensities of shadows and of lit pixels, with a proposed Ts and the one set."""
    top = max(2.5 * proposed, 1.2 * present, float(shadows.max(initial=0)) * 1.2, 1e-4)
    if lit.size:
        top = max(top, min(float(np.quantile(lit, 0.3)) * 1.2, 10 * top))
    kinds = [(shadows, css_colour(SHADOW)), (lit, css_colour(LIT))]
    return plot_histogram(kinds, top, proposed, present, "intensity (fraction of full scale)")
