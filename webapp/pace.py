"""When a tab draws, and what it calls a rest."""

from threading import Event
from time import monotonic

from photolin.allocator import give_back

from .courtesy import end_rests, give_way

REST = 0.3
"""Seconds without a change after which a rough picture is drawn again without loss."""
STEP = 1.0
"""Seconds without a change after which what follows is another step to undo. A slider does not rest
while it is held."""
LULL = 5.0
"""Seconds without work after which memory that is free is given back."""


class Pace:
    """Wakes the worker of a tab when there is something to draw."""

    def __init__(self) -> None:
        """Begin with a change."""
        self._wake = Event()
        self._changed = monotonic()

    def wake(self) -> None:
        """Something may have changed; from any thread."""
        self._wake.set()
        end_rests()

    def touch(self) -> None:
        """Something has changed just now."""
        self._changed = monotonic()

    def rested(self, seconds: float) -> bool:
        """Whether nothing has changed for so long."""
        return monotonic() - self._changed >= seconds

    def wait(self, *, rough: bool) -> None:
        """Wait until something may have changed; where something better is to come, until then."""
        if rough:
            rest = next((rest for rest in (REST, STEP) if not self.rested(rest)), 0.0)
            self._wake.wait(max(self._changed + rest - monotonic(), 0.01))
        elif not self._wake.wait(LULL):
            give_way(self._wake.is_set)  # other tabs may be busy
            if not self._wake.is_set():
                give_back()
            self._wake.wait()
        self._wake.clear()
