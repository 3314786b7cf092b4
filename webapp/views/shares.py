"""How much of the image shown each class takes."""

import base64
import functools

import numpy as np
import viser
from numpy.typing import NDArray

from photolin.factors import Factor

from ..frame import Frame
from ..readout import escape, legend
from ..render import encode_labels
from . import ATTENTION, INDENT

SIDE = 12
"""Of a swatch, pixels."""
UNDEFINED, SHADOW = 3.0, 1.0
"""Percent of U from which, and of A and C up to which, Ts is doubted."""


@functools.cache
def swatch(factor: Factor, patterns: bool) -> str:
    """HTML of a small square in the colour of a class, with its pattern as the overlay draws it."""
    labels = np.full((SIDE, SIDE), factor, np.uint8)
    png = base64.b64encode(encode_labels(labels, solid=True, patterns=patterns)).decode("ascii")
    return (
        f'<img src="data:image/png;base64,{png}" width="{SIDE}" height="{SIDE}" alt="" '
        'style="border-radius:2px;vertical-align:-0.1em;image-rendering:pixelated">'
    )


class SharesView:
    """Colours, letters and percentages, a line for each method."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._strip = gui.add_html("")

    def draw(self, frame: Frame) -> None:
        """Shares of the image shown, inside the mask; a second line for the method beside it.

        Those of a preview of a part are told as about right.
        """
        rough = frame.preview is not None and frame.preview.whole is None
        rows = [
            (analysis.options.method, labels)
            for analysis, labels in (
                (frame.analysis, frame.labels),
                (frame.beside, frame.beside_labels),
            )
            if analysis is not None and labels is not None
        ]
        self._strip.content = "".join(
            _strip(
                labels,
                method if len(rows) > 1 else "",
                frame.state.patterns,
                "≈" if rough and n == 0 else "",
            )
            for n, (method, labels) in enumerate(rows)
        ) + _doubt(rows[0][1] if rows else None)


def _doubt(labels: NDArray[np.uint8] | None) -> str:
    """That Ts looks too low: what is dark then fits nothing, and hardly anything is shadow."""
    if labels is None:
        return ""
    percent = {row.factor: row.percent for row in legend(labels)}
    shadow = percent[Factor.ATTACHED] + percent[Factor.CAST]
    if percent[Factor.UNDEFINED] < UNDEFINED or shadow > SHADOW:
        return ""
    text = (
        "Hardly any shadow, and much that is undefined: Ts may be too low for this picture. Raise "
        "it, or sample shadows in the tab Samples."
    )
    return f'<div style="{INDENT};font-size:0.8em;{ATTENTION}">{escape(text)}</div>'


def _strip(labels: NDArray[np.uint8], method: str, patterns: bool, about: str) -> str:
    cells = [
        f'<span style="white-space:nowrap" title="{row.title}: {row.count} of the pixels inside '
        f'the mask, in the image shown">'
        f"{swatch(row.factor, patterns)} {row.letter} {about}{row.percent:.1f} %</span>"
        for row in legend(labels)
    ]
    name = f'<span style="width:100%">{escape(method)}</span>' if method else ""
    return (
        f'<div style="{INDENT};font-size:0.8em;display:flex;'
        'flex-wrap:wrap;gap:0 0.55em;font-variant-numeric:tabular-nums">'
        f"{name}{''.join(cells)}</div>"
    )
