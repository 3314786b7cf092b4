"""Long work of one tab: one piece at a time, in a thread of its own."""

from collections.abc import Callable
from threading import Event, Lock, Thread


class Job:
    """Runs one piece of work; more that is asked for meanwhile is refused."""

    def __init__(self, around: Callable[[Callable[[], None]], None]) -> None:
        """`around(work)` is called in the thread, calls `work`, and must not raise."""
        self._around = around
        self._lock = Lock()
        self._stop = Event()
        self._running = False

    def start(self, work: Callable[[], None]) -> bool:
        """Start `work` unless some is running; whether it was started."""
        with self._lock:
            if self._running:
                return False
            self._running = True
            self._stop.clear()
        Thread(target=self._run, args=(work,), name="job", daemon=True).start()
        return True

    def stop(self) -> None:
        """Ask what is running to stop."""
        self._stop.set()

    def stopping(self) -> bool:
        """Whether it has been asked to."""
        return self._stop.is_set()

    def _run(self, work: Callable[[], None]) -> None:
        try:
            self._around(work)
        finally:
            self._running = False
