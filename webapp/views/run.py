"""Which method, and how far a run has come."""

from collections.abc import Callable
from dataclasses import replace
from itertools import chain

import viser

from photolin.analysis import METHODS, Method

from ..readout import escape
from ..state import ViewState
from ..values import choose_option
from . import INDENT


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
        self._bars: list[tuple[viser.GuiHtmlHandle, viser.GuiProgressBarHandle]] = []
        self._cancels: list[viser.GuiButtonHandle] = []
        self._stop = cancel
        self.add_progress(gui)

        @self._method.on_update
        async def _(_: viser.GuiEvent) -> None:
            changed()

    def add_progress(self, gui: viser.GuiApi) -> None:
        """Add a progress bar and Cancel where long work is begun."""
        self._bars.append(
            (
                gui.add_html("", visible=False),
                gui.add_progress_bar(0, visible=False, animated=True),
            )
        )
        button = gui.add_button(
            "Cancel", visible=False, icon=viser.Icon.X, hint="Stop what is running (key: Esc)"
        )
        self._cancels.append(button)

        @button.on_click
        async def _(_: viser.GuiEvent) -> None:
            self._stop()

    def turn(self) -> None:
        """Go to the next method."""
        at = METHODS.index(choose_option(self._method.value, METHODS, self._fallback))
        self._method.value = METHODS[(at + 1) % len(METHODS)]

    def busy(self, running: bool) -> None:
        """Show or hide the progress bars and Cancel."""
        for handle in (*chain(*self._bars), *self._cancels):
            handle.visible = running
        self.progress("", 0)

    def progress(self, stage: str, fraction: float) -> None:
        """Show how far a run has come; the bar is never empty, so that it is seen to move."""
        for text, bar in self._bars:
            text.content = f'<div style="{INDENT};font-size:0.8em">{escape(stage)}</div>'
            bar.value = round(100 * min(max(fraction, 0.04), 1))

    def read(self, state: ViewState) -> ViewState:
        """The state with the method as set here."""
        return replace(state, method=choose_option(self._method.value, METHODS, self._fallback))
