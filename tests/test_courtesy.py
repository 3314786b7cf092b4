"""Work in the background rests while a tab draws, and does not stand in its way."""

import threading
from collections.abc import Callable
from threading import Event

import pytest

from photolin.blocks import in_background, run_blocks
from webapp import courtesy as module
from webapp import job as jobs
from webapp.courtesy import give_way, urgent
from webapp.job import Job


def test_work_goes_on_at_once_where_nobody_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LONGEST", 60.0)
    give_way()  # would hang
    with urgent():
        pass
    give_way()


def test_a_job_rests_until_the_last_of_all_rounds_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LONGEST", 60.0)
    job, asking, went_on = Job(lambda work: work(), lambda: None), Event(), Event()

    def work() -> None:
        asking.set()
        assert not job.stopping()
        went_on.set()

    with urgent():
        with urgent():
            job.start(work)
            assert asking.wait(5)
            assert not went_on.wait(0.1)
        assert not went_on.wait(0.1)
    assert went_on.wait(5)


def test_a_job_that_is_told_to_stop_does_not_rest_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LONGEST", 60.0)
    job, found = Job(lambda work: work(), lambda: None), []
    with urgent():
        job.stop()
        found.append(job.stopping())
    assert found == [True]


@pytest.mark.parametrize("end", [Job.stop, Job.close])
def test_a_job_that_rests_ends_its_rest_when_told_to_stop(
    end: Callable[[Job], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "LONGEST", 60.0)
    job, asking, stopped = Job(lambda work: work(), lambda: None), Event(), Event()

    def work() -> None:
        asking.set()
        assert job.stopping()
        stopped.set()

    with urgent():
        job.start(work)
        assert asking.wait(5)
        assert not stopped.wait(0.1)
        end(job)
        assert stopped.wait(5)


def test_a_tab_that_never_rests_does_not_stop_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LONGEST", 0.05)
    with urgent():
        assert not give_way()
    assert give_way()


def test_work_that_always_has_to_rest_takes_three_times_as_long_at_most() -> None:
    assert (module.LONGEST + module.TURN) / module.TURN == 3


def test_a_job_that_rested_in_vain_does_not_rest_again_at_each_block(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rests = []

    def rest(ended: Callable[[], bool]) -> bool:
        assert not ended()
        rests.append(time)
        return time >= 8  # the tab has rested

    time = 0.0
    monkeypatch.setattr(jobs, "give_way", rest)
    monkeypatch.setattr(jobs, "monotonic", lambda: time)
    monkeypatch.setattr(jobs, "TURN", 3.0)
    job = Job(lambda work: work(), lambda: None)
    for _ in range(10):
        assert not job.stopping()
        time += 1
    assert rests == [0, 3, 6, 9]


def test_a_round_that_fails_is_over_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LONGEST", 60.0)
    with pytest.raises(ValueError, match="failed"), urgent():
        raise ValueError("failed")
    give_way()


def test_blocks_of_a_resting_job_do_not_hold_up_those_of_others() -> None:
    """Both would else share two threads, and the second wait for the first."""
    held, release, done = Event(), Event(), []

    def rest() -> bool:
        held.set()
        return not release.wait(30)

    def work() -> None:
        with in_background():
            run_blocks(lambda start, stop: done.append(("late", start)), 4, 1, cancel=rest)

    thread = threading.Thread(target=work)
    thread.start()
    assert held.wait(5)
    try:
        run_blocks(lambda start, stop: done.append(("soon", start)), 4, 1, threads=None)
        assert sorted(done) == [("soon", n) for n in range(4)]
    finally:
        release.set()
        thread.join(5)
    assert sorted(done) == [(name, n) for name in ("late", "soon") for n in range(4)]


def test_work_in_the_background_gives_the_same() -> None:
    squares = [0] * 100

    def work(start: int, stop: int) -> None:
        squares[start:stop] = [n * n for n in range(start, stop)]

    with in_background():
        run_blocks(work, 100, 7)
    assert squares == [n * n for n in range(100)]


def test_a_job_that_rests_between_blocks_does_not_hold_up_a_tab(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its blocks rest in threads of its own, while those of the tab are done."""
    monkeypatch.setattr(module, "LONGEST", 60.0)
    job, began, done = Job(lambda work: work(), lambda: None), Event(), []

    def work() -> None:
        began.set()
        run_blocks(lambda start, stop: done.append("job"), 8, 1, cancel=job.stopping)

    with urgent():
        job.start(work)
        assert began.wait(5)
        tab = threading.Thread(
            target=run_blocks, args=(lambda start, stop: done.append("tab"), 8, 1), daemon=True
        )
        tab.start()
        tab.join(5)
        assert done == ["tab"] * 8
    for thread in threading.enumerate():
        if thread.name == "job":
            thread.join(5)
    assert done == ["tab"] * 8 + ["job"] * 8
