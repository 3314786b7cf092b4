"""Which picture is compared with the one shown, and how both are laid out."""

from collections.abc import Callable
from dataclasses import replace

import viser

from ..agreement import agreement_html, measure_agreement
from ..clicks import Clicks
from ..compare import other_frame
from ..frame import Frame
from ..readout import escape
from ..state import AGAINST, ARRANGEMENTS, SURFACE, TRUTH, Arrangement, ViewState
from ..values import choose_option, clamp_number
from . import INDENT
from .watched import Watched

NONE = "nothing"


class CompareView(Watched):
    """The right picture, how both are laid out, and how far their labels agree."""

    def __init__(
        self,
        gui: viser.GuiApi,
        clicks: Clicks,
        changed: Callable[[], None],
        add_choice: Callable[[viser.GuiApi], None],
        *,
        known: bool,
    ) -> None:
        """Build it.

        Args:
            changed: asks that all is read and `redraw` is called soon, by the thread that draws.
            add_choice: adds the choice of the compared method.
            known: whether frames come with the truth.
        """
        self._changed, self._stale = changed, False
        super().__init__(clicks, "compare")
        self._offered = tuple(one for one in AGAINST if known or one != TRUTH)
        self._against = gui.add_dropdown(
            "Right picture",
            (NONE, *self._offered),
            initial_value=NONE,
            hint="The left picture is what View and Method say. The right one is this layer, or "
            "the true labels, where they are known",
        )
        add_choice(gui)
        self._arrangement = gui.add_dropdown(
            "Show",
            ARRANGEMENTS,
            hint="split: drag the line on the picture. side by side: both move and zoom together. "
            "difference: labels where they differ, or left minus right. left, right: one alone "
            "(keys: B shows one and the other in turn, Shift-B both again)",
        )
        self._divider = gui.add_slider(
            "Divider",
            0.0,
            1.0,
            0.001,
            0.5,
            marks=(),
            hint="Where the line is when split, share of the picture's width; it can be dragged "
            "on the picture too",
        )
        self._both: Arrangement = ARRANGEMENTS[0]
        self._told = gui.add_html(f'<div id="{self._id}"></div>')
        for handle in (self._against, self._arrangement, self._divider):

            @handle.on_update
            async def _(_: viser.GuiEvent) -> None:
                changed()

    def flicker(self) -> None:
        """One picture alone, then the other; nothing where none is compared."""
        now = self._read_arrangement()
        if self._against.value == NONE:
            return
        if now not in ("left", "right"):
            self._both = now
        self._arrangement.value = "right" if now == "left" else "left"

    def show_both(self) -> None:
        """Both pictures again, as they were before one was alone."""
        if self._read_arrangement() in ("left", "right"):
            self._arrangement.value = self._both

    def divide(self, divider: float) -> None:
        """Put the line at a share of the width, 0 to 1."""
        self._divider.value = divider

    def restore(self, state: ViewState) -> None:
        """Set the comparison of a state, as far as it is offered."""
        self._against.value = state.against if state.against in self._offered else NONE
        self._arrangement.value, self._divider.value = state.arrangement, state.divider

    def read(self, state: ViewState) -> ViewState:
        """The state with the comparison as set here."""
        return replace(
            state,
            against=next((one for one in self._offered if one == self._against.value), None),
            arrangement=self._read_arrangement(),
            divider=clamp_number(self._divider.value, 0, 1, 0.5),
        )

    def _read_arrangement(self) -> Arrangement:
        return choose_option(self._arrangement.value, ARRANGEMENTS, ARRANGEMENTS[0])

    def redraw(self) -> None:
        """Show what is lacking since it came into view; from the thread that draws."""
        if self._stale and self._frame is not None:
            self._stale = False
            self.draw(self._frame)

    def _see(self, shown: bool) -> None:
        # counting labels takes long, and this is called on the one loop of all tabs
        self._shown = self._stale = shown
        self._changed()

    def _show(self, frame: Frame) -> None:
        """Name both pictures, and tell how far their labels agree."""
        state, other = frame.state, other_frame(frame)
        table = ""
        if other is None:
            text = _invite(state)
        else:
            text = f"Left: {state.layer} by {state.method}. Right: {_name(frame, other)}."
            if state.beside is not None and frame.beside is None:
                text += f" There is no result by {state.beside} yet."
            table = agreement_html(measure_agreement(frame, other))
        self._told.content = (
            f'<div id="{self._id}" style="{INDENT};font-size:0.8em">{escape(text)}{table}</div>'
        )


def _invite(state: ViewState) -> str:
    if state.against in SURFACE:
        return f"There is no shape yet for {state.against}; recover one in the tab Shape first."
    if state.beside is not None:
        return (
            f"Choose a right picture, labels for instance, to see what {state.beside} makes of it."
        )
    return "Choose a right picture to compare with the one shown."


def _name(frame: Frame, other: Frame) -> str:
    if frame.state.against == TRUTH:
        return "the true labels"
    by = frame.state.method if other.analysis is None else other.analysis.options.method
    return f"{frame.state.against} by {by}"
