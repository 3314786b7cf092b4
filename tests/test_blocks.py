"""Blocks: every row once, progress to 1, cancellation, and errors that come through."""

import threading

import pytest

from photolin.blocks import run_blocks
from photolin.errors import Cancelled


@pytest.mark.parametrize("threads", [1, 4, None])
@pytest.mark.parametrize("block", [1, 7, 99, 100, 10**9])
def test_every_row_is_worked_on_exactly_once(block: int, threads: int | None) -> None:
    seen: list[int] = []
    lock = threading.Lock()

    def work(start: int, stop: int) -> None:
        assert 0 < stop - start <= block
        with lock:
            seen.extend(range(start, stop))

    run_blocks(work, 100, block, threads=threads)
    assert sorted(seen) == list(range(100))


def test_progress_rises_by_blocks_to_exactly_one() -> None:
    told: list[tuple[str, float]] = []
    run_blocks(
        lambda _a, _b: None,
        10,
        3,
        stage="linearize",
        progress=lambda stage, done: told.append((stage, done)),
    )
    assert told == [("linearize", k / 4) for k in (1, 2, 3, 4)]


def test_no_rows_are_no_work() -> None:
    run_blocks(lambda _a, _b: pytest.fail("there is nothing to do"), 0, 10, cancel=lambda: False)


def test_cancelled_before_it_starts_nothing_is_done() -> None:
    with pytest.raises(Cancelled, match=r"^linearize was cancelled$"):
        run_blocks(
            lambda _a, _b: pytest.fail("was cancelled"),
            10,
            1,
            stage="linearize",
            cancel=lambda: True,
        )


def test_cancelled_midway_no_further_block_begins() -> None:
    done: list[int] = []
    with pytest.raises(Cancelled, match="the run was cancelled"):
        run_blocks(
            lambda start, _stop: done.append(start),
            100,
            1,
            threads=1,
            cancel=lambda: len(done) >= 5,
        )
    assert done == [0, 1, 2, 3, 4]


def test_a_run_that_is_not_cancelled_says_nothing() -> None:
    run_blocks(lambda _a, _b: None, 10, 1, cancel=lambda: False)


@pytest.mark.parametrize("threads", [1, 3])
def test_an_error_in_a_block_comes_through(threads: int) -> None:
    def work(start: int, _stop: int) -> None:
        if start == 6:
            raise ZeroDivisionError("row 6")

    with pytest.raises(ZeroDivisionError, match="row 6"):
        run_blocks(work, 10, 2, threads=threads)
