"""What a tab says beside the picture: short notes, and none of them once it is closed."""

import traceback
from threading import Event
from typing import Literal

import viser

from photolin.errors import Cancelled, PhotolinError

SECONDS = 6.0
"""How long a grey note stays; red ones stay until they are dismissed."""


class Notices:
    """Notes of one client; may be called from any thread."""

    def __init__(self, client: viser.ClientHandle, closed: Event) -> None:
        """Be silent once `closed` is set."""
        self._client, self._closed = client, closed
        self._failed: list[viser.NotificationHandle] = []

    def say(
        self, title: str, body: str, color: Literal["red", "gray"] = "gray"
    ) -> viser.NotificationHandle | None:
        """Show a note."""
        if self._closed.is_set():
            return None
        seconds = None if color == "red" else SECONDS
        return self._client.add_notification(title, body, auto_close_seconds=seconds, color=color)

    def retract(self) -> None:
        """Take back the notes of what did not work: their cause is gone."""
        failed, self._failed = self._failed, []
        for note in failed:
            if not self._closed.is_set():
                note.remove()

    def refuse(self) -> None:
        """Say that something is running still."""
        self.say("Still running", "wait until it ends, or cancel it, and try again")

    def tell(self, error: Exception) -> None:
        """Say what went wrong; a fault of the program leaves its trace in the terminal."""
        if isinstance(error, Cancelled):
            self.say("Cancelled", str(error))
        elif isinstance(error, PhotolinError):
            note = self.say("This did not work", str(error), "red")
            self._failed += [] if note is None else [note]
        elif not self._closed.is_set():
            traceback.print_exception(error)
            self.say("photolin made a mistake", f"{type(error).__name__}: {error}", "red")
