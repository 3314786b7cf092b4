"""What was read, what was decided, what is doubtful."""

import viser

from ..frame import Frame
from ..readout import escape, summarize
from . import ATTENTION, INDENT


class SummaryView:
    """Sentences on the stack and on the result shown."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._text = gui.add_html("")

    def draw(self, frame: Frame) -> None:
        """Warnings first, then the run, then how the stack was read."""
        result = frame.analysis
        told = frame.stack if result is None else result
        warnings = "".join(
            f'<li style="{ATTENTION}">{escape(warning)}</li>' for warning in told.warnings
        )
        facts = ([summarize(result)] if result else []) + list(told.notes)
        self._text.content = (
            f'<ul style="{INDENT} 0 2em;margin:0;font-size:0.8em">'
            f"{warnings}{''.join(f'<li>{escape(fact)}</li>' for fact in facts)}</ul>"
        )
