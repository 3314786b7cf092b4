"""Work on ranges of rows over a thread pool, with progress and cancellation between blocks."""

import functools
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed, wait
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

from .analysis import Cancel, Progress
from .errors import Cancelled
from .priority import lower_priority

_background: ContextVar[bool] = ContextVar("background", default=False)


@contextmanager
def in_background() -> Iterator[None]:
    """Work begun in this thread meanwhile does not stand in the way of that of other threads.

    Its blocks are done by threads of their own, which let others go first, and may also wait in
    `cancel`.
    """
    token = _background.set(True)
    try:
        yield
    finally:
        _background.reset(token)


class Talk(NamedTuple):
    """How work is done and watched; nothing of it changes the result."""

    threads: int | None = None
    progress: Progress | None = None
    cancel: Cancel | None = None

    def part(self, start: float, stop: float) -> "Talk":
        """The same for a part of the stage that goes from `start` to `stop` of it."""
        tell = self.progress
        if tell is None:
            return self
        length = stop - start
        return self._replace(progress=lambda stage, f: tell(stage, start + f * length))


def run_blocks(
    work: Callable[[int, int], None],
    count: int,
    block: int,
    *,
    threads: int | None = None,
    stage: str = "",
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> None:
    """Call ``work(start, stop)`` for consecutive ranges that cover 0..count.

    Args:
        work: must release the interpreter lock and write to disjoint places.
        count: rows in all.
        block: rows in one call.
        threads: how many at once; all processors when left out.
        stage: the name `progress` is told.

    Raises:
        Cancelled: `cancel` returned true; blocks already begun are finished first.
    """
    ranges = [(start, min(start + block, count)) for start in range(0, count, block)]

    def run(span: tuple[int, int]) -> None:
        if cancel is None or not cancel():
            work(*span)

    if len(ranges) <= 1:
        for span in ranges:
            run(span)
        if progress is not None:
            progress(stage, 1.0)
    else:
        pool = _pool(threads or os.cpu_count() or 1, _background.get())
        futures = [pool.submit(run, span) for span in ranges]
        try:
            for done, future in enumerate(as_completed(futures), 1):
                future.result()
                if progress is not None:
                    progress(stage, done / len(ranges))
        finally:
            for future in futures:
                future.cancel()
            wait(futures)
    if cancel is not None and cancel():
        raise Cancelled(f"{stage or 'the run'} was cancelled")


@functools.cache
def _pool(threads: int, background: bool) -> ThreadPoolExecutor:
    """Threads shared by callers of a kind: starting them takes longer than a block of work."""
    return ThreadPoolExecutor(threads, "block", lower_priority if background else None)
