"""Work on ranges of rows over a thread pool, with progress and cancellation between blocks."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed

from .analysis import Cancel, Progress
from .errors import Cancelled


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

    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        for done, future in enumerate(as_completed([pool.submit(run, r) for r in ranges]), 1):
            future.result()
            if progress is not None:
                progress(stage, done / len(ranges))
    if cancel is not None and cancel():
        raise Cancelled(f"{stage or 'the run'} was cancelled")
