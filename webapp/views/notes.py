"""What is kept of a session beside the view: the user's own words, and the command to copy."""

from collections.abc import Callable

import viser

from ..values import MAX_TEXT


class NotesView:
    """Notes, and a button that copies the command line."""

    def __init__(
        self, gui: viser.GuiApi, changed: Callable[[], None], copy: Callable[[], None]
    ) -> None:
        self._notes = gui.add_text(
            "Notes",
            "",
            multiline=True,
            hint="Your own words; kept with thresholds, view, pins and left-out images in a "
            "session file, and part of the report",
        )
        self._copy = gui.add_button(
            "Copy command",
            icon=viser.Icon.COPY,
            hint="To the clipboard: the command line that makes what is shown (key: C)",
        )

        @self._notes.on_update
        async def _(_: viser.GuiEvent) -> None:
            changed()

        @self._copy.on_click
        async def _(_: viser.GuiEvent) -> None:
            copy()

    def restore(self, notes: str) -> None:
        """Show notes that were kept."""
        self._notes.value = notes

    def read(self) -> str:
        """The notes as they stand."""
        return str(self._notes.value)[:MAX_TEXT]
