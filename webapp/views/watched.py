"""Panels that are costly to draw: made while they are in view, and only then."""

from threading import Lock

from ..clicks import Clicks
from ..frame import Frame


class Watched:
    """A view that keeps the latest frame, and draws it as long as someone looks at it.

    Tabs that are not open would else be drawn with every step of a slider, and sent to the page.
    What `_show` makes has to hold an element with the id `self._id`, from the beginning on.
    """

    def __init__(self, clicks: Clicks, name: str) -> None:
        """Watch the element; `name` as `Clicks.see` takes it."""
        self._lock = Lock()
        self._shown = False
        self._frame: Frame | None = None
        self._id = clicks.see(name, self._see)

    def draw(self, frame: Frame) -> None:
        """Take a new frame."""
        with self._lock:
            self._frame = frame
            if self._shown:
                self._show(frame)

    def _see(self, shown: bool) -> None:
        with self._lock:
            self._shown = shown
            if shown and self._frame is not None:
                self._show(self._frame)

    def _show(self, frame: Frame) -> None:
        """Draw a frame."""
        raise NotImplementedError
