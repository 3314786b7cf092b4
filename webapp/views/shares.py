"""How much of the image shown each class takes."""

import viser

from photolin.factors import PALETTE

from ..frame import Frame
from ..readout import legend


class SharesView:
    """One line of colours, letters and percentages."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._strip = gui.add_html("")

    def draw(self, frame: Frame) -> None:
        """Counts and shares of the image shown, inside the mask."""
        if frame.labels is None:
            self._strip.content = ""
            return
        cells = [
            f'<span style="white-space:nowrap" title="{row.title}: {row.count} pixels">'
            f'<span style="display:inline-block;width:0.7em;height:0.7em;border-radius:2px;'
            f'background:rgb{PALETTE[row.factor]}"></span> {row.letter} {row.percent:.1f} %</span>'
            for row in legend(frame.labels)
        ]
        self._strip.content = (
            '<div style="padding:0 1em;font-size:0.85em;display:flex;flex-wrap:wrap;gap:0 0.8em;'
            f'font-variant-numeric:tabular-nums">{"".join(cells)}</div>'
        )
