"""Histograms behind T and Ts. Pure; SVG text that inherits the page's colour."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from photolin.analysis import Analysis
from photolin.export.html_plots import ticks
from photolin.factors import Factor, Thresholds, css_colour
from photolin.stack import ImageStack

from .readout import escape

WIDTH, HEIGHT = 300, 110
LEFT, TOP, BOTTOM = 8, 8, 30
BINS = 48
RESIDUALS = 200_000
"""Observations, about, that the histogram of residuals is of."""


def plot_histogram(
    kinds: Sequence[tuple[NDArray[np.floating], str]], top: float, line: float, axis: str
) -> str:
    """Samples of one or two kinds in bins from 0 to `top`, and a line.

    Args:
        kinds: values and CSS colour of each; each kind is scaled to its own fullest bin.
        top: right end of the axis, above 0; values beyond it are left out.
        line: where the line is.
        axis: name of the axis, with its unit.
    """
    wide, high = WIDTH - 2 * LEFT, HEIGHT - TOP - BOTTOM
    parts = []
    for values, colour in kinds:
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
    if 0 <= line <= top:
        x = LEFT + line / top * wide
        parts.append(
            f'<line x1="{x:.2f}" x2="{x:.2f}" y1="{TOP}" y2="{TOP + high}" stroke="currentColor" '
            'stroke-width="1.5" stroke-dasharray="4 3"/>'
        )
    parts.append(
        f'<line x1="{LEFT}" x2="{LEFT + wide}" y1="{TOP + high}" y2="{TOP + high}" '
        'stroke="currentColor" stroke-opacity="0.5"/>'
    )
    for value in ticks(0, top):
        x = LEFT + value / top * wide
        anchor = "middle" if x < WIDTH - 2 * LEFT else "end"  # else it would be cut off
        parts.append(
            f'<text x="{x:.2f}" y="{TOP + high + 12}" text-anchor="{anchor}">{value:g}</text>'
        )
    parts.append(
        f'<text x="{WIDTH / 2:g}" y="{HEIGHT - 4}" text-anchor="middle">{escape(axis)}</text>'
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="100%" '
        'role="img" fill="currentColor" font-family="system-ui,sans-serif" font-size="10">'
        f"{''.join(parts)}</svg>"
    )


def residuals_below(
    stack: ImageStack, analysis: Analysis, Ts: float, most: int = RESIDUALS
) -> NDArray[np.float32]:
    """(l - i)/i of lit observations darker than the fit, where no highlight can be: the noise.

    Args:
        most: about as many observations are looked at.
    """
    pixels = np.flatnonzero(analysis.determined())
    pixels = pixels[:: max(1, len(pixels) * len(stack.images) // most)]
    i = stack.images.reshape(len(stack.images), -1)[:, pixels]
    bases = analysis.linearized_bases.reshape(3, -1)[:, pixels]
    l = analysis.coefficients.astype(np.float32) @ bases
    below = (i >= max(Ts, 1e-9)) & (l > i)
    return (l[below] - i[below]) / i[below]


def plot_residuals(values: NDArray[np.float32], thresholds: Thresholds) -> str:
    """The residuals below the fit with T."""
    top = 2.5 * thresholds.T
    if values.size:
        top = max(top, min(float(np.quantile(values, 0.99)), 0.5))
    return plot_histogram(
        [(values, css_colour(Factor.DIFFUSE))],
        top,
        thresholds.T,
        "(l - i)/i below the fit; line: T",
    )


def plot_samples(shadows: NDArray[np.float32], lit: NDArray[np.float32], Ts: float) -> str:
    """Sampled intensities of shadows and of lit pixels with a Ts."""
    top = max(2.5 * Ts, float(shadows.max(initial=0)) * 1.2, 1e-4)
    if lit.size:
        top = max(top, min(float(np.quantile(lit, 0.3)) * 1.2, 10 * top))
    kinds = [(shadows, css_colour(Factor.CAST)), (lit, css_colour(Factor.DIFFUSE))]
    return plot_histogram(kinds, top, Ts, "intensity (fraction of full scale); line: Ts")
