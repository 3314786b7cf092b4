"""Which picture is laid beside the one shown."""

from collections.abc import Callable
from dataclasses import replace

import viser

from ..frame import Frame
from ..readout import escape
from ..state import LAYERS, ViewState
from ..values import clamp_number
from . import INDENT

NONE = "nothing"


class CompareView:
    """The second picture, the line between both, and their difference."""

    def __init__(self, gui: viser.GuiApi, changed: Callable[[], None]) -> None:
        self._against = gui.add_dropdown(
            "With",
            (NONE, *LAYERS),
            initial_value=NONE,
            hint="The picture right of the line: this layer, by the method chosen under Compare "
            "with in the tab Tune, if any. Left of it is what View and Method say",
        )
        self._divider = gui.add_slider(
            "Divider",
            0.0,
            1.0,
            0.005,
            0.5,
            marks=(),
            hint="Where the line is, share of the picture's width (key B: all of one, all of the "
            "other)",
        )
        self._difference = gui.add_checkbox(
            "difference", False, hint="Show how much both pictures differ: black is equal"
        )
        self._told = gui.add_html("")
        for handle in (self._against, self._divider, self._difference):

            @handle.on_update
            async def _(_: viser.GuiEvent) -> None:
                changed()

    def flicker(self) -> None:
        """All of one picture, then all of the other."""
        self._divider.value = 0.0 if self._divider.value > 0.5 else 1.0

    def restore(self, state: ViewState) -> None:
        """Set the comparison of a state."""
        self._against.value = NONE if state.against is None else state.against
        self._divider.value, self._difference.value = state.divider, state.difference

    def read(self, state: ViewState) -> ViewState:
        """The state with the comparison as set here."""
        return replace(
            state,
            against=next((layer for layer in LAYERS if layer == self._against.value), None),
            divider=clamp_number(self._divider.value, 0, 1, 0.5),
            difference=self._difference.value is True,
        )

    def draw(self, frame: Frame) -> None:
        """Name both pictures."""
        state = frame.state
        if state.against is None:
            text = "Choose a picture to lay beside the one shown."
        else:
            by = state.beside if frame.beside is not None else state.method
            text = f"Left: {state.layer} by {state.method}. Right: {state.against} by {by}."
        self._told.content = f'<div style="{INDENT};font-size:0.8em">{escape(text)}</div>'
