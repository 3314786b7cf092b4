"""Work in the background goes last where processors are short, and nothing else does."""

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Event, get_native_id

import pytest

from photolin.blocks import in_background, run_blocks
from photolin.priority import LOWER, lower_priority
from webapp.job import Job

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="no priorities of threads here")


def niceness() -> int:
    """Of the thread that asks."""
    return os.getpriority(os.PRIO_PROCESS, get_native_id())


USUAL = niceness()


def test_a_thread_goes_last_and_the_others_do_not() -> None:
    with ThreadPoolExecutor(1, initializer=lower_priority) as pool:
        assert pool.submit(niceness).result() == min(USUAL + LOWER, 19)
    assert niceness() == USUAL
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(niceness).result() == USUAL


def test_whoever_is_started_by_a_thread_that_goes_last_goes_no_further_back() -> None:
    def start_another() -> int:
        with ThreadPoolExecutor(1, initializer=lower_priority) as pool:
            return pool.submit(niceness).result()

    with ThreadPoolExecutor(1, initializer=lower_priority) as pool:
        assert pool.submit(start_another).result() == min(USUAL + LOWER, 19)


def test_where_it_is_forbidden_nothing_happens(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: int) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "setpriority", refuse)
    lower_priority()
    assert niceness() == USUAL
    ended, again = Event(), Event()
    job = Job(lambda work: work(), again.set)
    assert job.start(ended.set)
    assert ended.wait(5)
    assert again.wait(5)


def test_a_thread_that_goes_last_already_goes_no_further_forward(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As when somebody gave the first thread alone another priority."""
    asked: list[int] = []
    first = os.getpid()
    monkeypatch.setattr(os, "getpriority", lambda _, thread: -15 if thread == first else 0)
    monkeypatch.setattr(os, "setpriority", lambda _, thread, value: asked.append(value))
    with ThreadPoolExecutor(1, initializer=lower_priority) as pool:
        pool.submit(int).result()
    assert asked == [0]


def test_blocks_in_the_background_go_last() -> None:
    found: list[int] = []

    def work(start: int, stop: int) -> None:
        found.append(niceness())

    run_blocks(work, 8, 1)
    assert found == [USUAL] * 8
    with in_background():
        run_blocks(work, 8, 1)
    assert found[8:] == [min(USUAL + LOWER, 19)] * 8
    run_blocks(work, 8, 1)
    assert found[16:] == [USUAL] * 8


def test_a_job_goes_last_and_whoever_starts_it_does_not() -> None:
    found: list[int] = []
    ended = Event()
    Job(lambda work: work(), ended.set).start(lambda: found.append(niceness()))
    assert ended.wait(5)
    assert found == [min(USUAL + LOWER, 19)]
    assert niceness() == USUAL
