"""Long work of one tab: one piece at a time, in a thread of its own."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Lock, Thread
from time import monotonic

from photolin.blocks import in_background
from photolin.errors import Cancelled
from photolin.priority import lower_priority

from .courtesy import TURN, end_rests, give_way


class Job:
    """Runs one piece of work; more that is asked for meanwhile is refused."""

    def __init__(
        self, around: Callable[[Callable[[], None]], None], ended: Callable[[], None]
    ) -> None:
        """Tell how to run work.

        Args:
            around: called in the thread with the work; calls it and must not raise.
            ended: called in the thread when the next piece can be started.
        """
        self._around, self._ended = around, ended
        self._lock = Lock()
        self._stop = Event()
        self._running = self._closed = False
        self._working_until = 0.0
        """Until then it does not rest, as it has rested in vain."""

    def start(self, work: Callable[[], None]) -> bool:
        """Start `work` unless some is running; whether it was started."""
        with self._lock:
            if self._running or self._closed:
                return False
            self._running = True
            self._stop.clear()
        Thread(target=self._run, args=(work,), name="job", daemon=True).start()
        return True

    def stop(self) -> None:
        """Ask what is running to stop."""
        self._stop.set()
        end_rests()

    def close(self) -> None:
        """Ask what is running to stop, and start nothing any more."""
        with self._lock:
            self._closed = True
        self.stop()

    @property
    def closed(self) -> bool:
        """Whether nothing is started any more."""
        return self._closed

    def stopping(self) -> bool:
        """Whether what is running has been asked to stop. Work that asks gives way here."""
        if monotonic() >= self._working_until and not give_way(self._stop.is_set):
            self._working_until = monotonic() + TURN
        return self._stop.is_set()

    def _run(self, work: Callable[[], None]) -> None:
        try:
            lower_priority()
            with in_background():
                self._around(work)
        finally:
            with self._lock:
                self._running = False
            self._ended()


@contextmanager
def cancelling(what: str, then: str) -> Iterator[None]:
    """Say in a `Cancelled` what was cancelled and what follows, instead of at which stage."""
    try:
        yield
    except Cancelled as error:
        raise Cancelled(f"{what} cancelled; {then}") from error
