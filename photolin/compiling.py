"""Says so while the loops are compiled: once on a machine, longer than most runs after it.

numba keeps what it compiled beside the sources, and tells of compiling only, not of reading that.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter

from numba.core import event

from .analysis import Progress

COMPILING = "compiling a loop at its first use, kept for later runs (half a minute for all)"
"""The stage that is told meanwhile."""
EXPECTED = 30.0
"""Seconds it may take; they make the fraction."""


@contextmanager
def tell_compiling(progress: Progress) -> Iterator[Progress]:
    """Wrap `progress`: while anything is compiled, in any thread, it is told COMPILING instead.

    Afterwards it is told the stage again that was interrupted.
    """
    teller = _Teller(progress)
    with event.install_listener("numba:compile", teller):
        yield teller.tell


class _Teller(event.Listener):
    """Compiling a loop begins and ends within that of its caller: `_depth` counts them."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._depth = 0
        self._began = self._seconds = 0.0
        self._stage: tuple[str, float] | None = None

    def tell(self, stage: str, fraction: float) -> None:
        self._stage = stage, fraction
        if self._depth == 0:
            self._progress(stage, fraction)

    def on_start(self, event: event.Event) -> None:
        if self._depth == 0:
            self._began = perf_counter()
        self._depth += 1
        self._progress(COMPILING, min((self._seconds + perf_counter() - self._began) / EXPECTED, 1))

    def on_end(self, event: event.Event) -> None:
        self._depth = max(self._depth - 1, 0)  # it may have begun before we listened
        if self._depth == 0:
            self._seconds += perf_counter() - self._began
            if self._stage is not None:
                self._progress(*self._stage)
