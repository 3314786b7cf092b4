"""Long work: one piece at a time, ended before the next begins."""

import threading
from collections.abc import Callable

from webapp.job import Job


def call(work: Callable[[], None]) -> None:
    work()


def join_jobs() -> None:
    for thread in threading.enumerate():
        if thread.name == "job":
            thread.join(5)
            assert not thread.is_alive()


def test_work_asked_for_while_some_runs_is_refused() -> None:
    release = threading.Event()
    ran: list[str] = []
    job = Job(call, lambda: None)
    assert job.start(lambda: ran.append(str(release.wait(5))))
    assert not job.start(lambda: ran.append("second"))
    release.set()
    join_jobs()
    assert ran == ["True"]
    assert job.start(lambda: ran.append("third"))
    join_jobs()
    assert ran == ["True", "third"]


def test_whoever_is_told_of_the_end_can_start_the_next_piece() -> None:
    started: list[bool] = []
    second = threading.Event()

    def ended() -> None:
        if not second.is_set():
            started.append(job.start(second.set))

    job = Job(call, ended)
    job.start(lambda: None)
    assert second.wait(5)
    join_jobs()
    assert started == [True]


def test_stop_reaches_what_runs_and_not_what_comes_after() -> None:
    seen: list[bool] = []
    asked, stopped = threading.Event(), threading.Event()

    def work() -> None:
        seen.append(job.stopping())
        asked.set()
        stopped.wait(5)
        seen.append(job.stopping())

    job = Job(call, lambda: None)
    job.start(work)
    assert asked.wait(5)
    job.stop()
    stopped.set()
    join_jobs()
    job.start(lambda: seen.append(job.stopping()))
    join_jobs()
    assert seen == [False, True, False]


def test_a_closed_job_stops_and_starts_nothing_any_more() -> None:
    asked = threading.Event()
    job = Job(call, lambda: None)

    def work() -> None:
        while not job.stopping():
            asked.set()

    job.start(work)
    assert asked.wait(5)
    job.close()
    join_jobs()
    assert not job.start(asked.clear)
    assert asked.is_set()
    assert job.stopping()
