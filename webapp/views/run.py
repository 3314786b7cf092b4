"""Which method, and how far a run has come."""

from collections.abc import Callable
from dataclasses import replace

import viser

from photolin.analysis import METHODS, Method

from ..readout import escape
from ..state import ViewState
from ..values import choose_option
from . import INDENT


class Progress:
    """What is done, a bar and Cancel; hidden while nothing runs."""

    def __init__(self, gui: viser.GuiApi, cancel: Callable[[], None]) -> None:
        self._stage = gui.add_html("", visible=False)
        self._bar = gui.add_progress_bar(0, visible=False, animated=True)
        self._cancel = gui.add_button(
            "Cancel", visible=False, icon=viser.Icon.X, hint="Stop what is running (key: Esc)"
        )

        @self._cancel.on_click
        async def _(_: viser.GuiEvent) -> None:
            cancel()

    def busy(self, running: bool) -> None:
        """Show or hide all of it."""
        for handle in (self._stage, self._bar, self._cancel):
            handle.visible = running

    def show(self, stage: str, fraction: float) -> None:
        """Name the stage and fill the bar; it is never empty, so that it is seen to move."""
        self._stage.content = f'<div style="{INDENT};font-size:0.8em">{escape(stage)}</div>'
        self._bar.value = round(100 * min(max(fraction, 0.04), 1))


class RunView:
    """Method switch, progress and cancel."""

    def __init__(
        self,
        gui: viser.GuiApi,
        method: Method,
        changed: Callable[[], None],
        cancel: Callable[[], None],
    ) -> None:
        self._fallback = method
        self._method = gui.add_dropdown(
            "Method",
            METHODS,
            initial_value=method,
            hint="robust: photolin's own. classification: the 2007 paper to the letter. "
            "statistical: its predecessor (key: M)",
        )
        self._stop = cancel
        self._bars = [Progress(gui, cancel)]

        @self._method.on_update
        async def _(_: viser.GuiEvent) -> None:
            changed()

    def add_progress(self, gui: viser.GuiApi) -> None:
        """Add a progress bar and Cancel where long work is begun."""
        self._bars.append(Progress(gui, self._stop))

    def turn(self) -> None:
        """Go to the next method."""
        at = METHODS.index(choose_option(self._method.value, METHODS, self._fallback))
        self._method.value = METHODS[(at + 1) % len(METHODS)]

    def busy(self, running: bool) -> None:
        """Show or hide the progress bars and Cancel."""
        for bar in self._bars:
            bar.busy(running)
        self.progress("", 0)

    def progress(self, stage: str, fraction: float) -> None:
        """Show how far a run has come."""
        for bar in self._bars:
            bar.show(stage, fraction)

    def restore(self, state: ViewState) -> None:
        """Set the method of a state."""
        self._method.value = state.method

    def read(self, state: ViewState) -> ViewState:
        """The state with the method as set here."""
        return replace(state, method=choose_option(self._method.value, METHODS, self._fallback))
