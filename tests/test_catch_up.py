"""The run after the sliders: begun when they rest, stopped when they move, failing only once."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import pytest
from browser import wait_until
from lambert import lambertian

from photolin.analysis import Analysis, Cancel, Method, Options, Progress
from photolin.errors import Cancelled, DegenerateError
from photolin.factors import Thresholds
from photolin.pipeline import analyze
from webapp.catch_up import CatchUp
from webapp.state import ViewState

STACK = lambertian(8, (12, 14))[0]
NEAR = analyze(STACK, Options(T=0.05, Ts=0.02, samples=20))
AT_NEAR = ViewState(T=0.05, Ts=0.02)
MOVED, FURTHER = ViewState(T=0.1, Ts=0.02), ViewState(T=0.15, Ts=0.02)


@dataclass
class FakeRuns:
    """Runs that last until they are released or cancelled."""

    options: Options = field(default_factory=lambda: Options(samples=20, seed=7))
    began: list[Options] = field(default_factory=list)
    cancelled: list[Options] = field(default_factory=list)
    release: threading.Event = field(default_factory=threading.Event)
    fault: Exception | None = None
    looks: int = 0
    """How often a run has asked whether to stop."""

    def run(self, options: Options, progress: Progress, cancel: Cancel) -> Analysis:
        progress("linearize", 0.5)
        self.began.append(options)
        while not self.release.wait(0.005):
            self.looks += 1
            if cancel():
                self.cancelled.append(options)
                raise Cancelled("the run was cancelled")
        if self.fault is not None:
            raise self.fault
        assert options.T is not None
        assert options.Ts is not None
        return replace(NEAR, options=options, thresholds=Thresholds(options.T, options.Ts))


@dataclass
class Watched:
    """A CatchUp and what came of it."""

    runs: FakeRuns = field(default_factory=FakeRuns)
    delivered: list[tuple[Method, Analysis]] = field(default_factory=list)
    told: list[Exception] = field(default_factory=list)
    ends: list[None] = field(default_factory=list)
    deliver: Callable[[Method, Analysis], None] | None = None

    def __post_init__(self) -> None:
        runs: Any = self.runs
        deliver = self.deliver or (lambda method, result: self.delivered.append((method, result)))
        self.catch_up = CatchUp(runs, deliver, self.told.append, lambda: self.ends.append(None))

    def pursue(
        self, state: ViewState, *, rested: bool = True, near: Analysis | None = NEAR
    ) -> bool:
        return self.catch_up.pursue(state, near, rested)

    def wait_for_runs(self, began: int, ended: int) -> None:
        wait_until(lambda: (len(self.runs.began), len(self.ends)) == (began, ended))


def join_jobs() -> None:
    for thread in threading.enumerate():
        if thread.name == "job":
            thread.join(5)
            assert not thread.is_alive()


@pytest.fixture
def watched() -> Iterator[Watched]:
    one = Watched()
    yield one
    one.catch_up.close()
    join_jobs()


def test_a_run_starts_when_the_sliders_rest_and_is_delivered(watched: Watched) -> None:
    assert watched.pursue(MOVED, rested=False)
    join_jobs()
    assert watched.runs.began == []
    assert not watched.pursue(MOVED)
    watched.wait_for_runs(1, 0)
    assert watched.delivered == []
    watched.runs.release.set()
    watched.wait_for_runs(1, 1)
    [(method, result)] = watched.delivered
    assert method == "robust"
    assert result.thresholds == MOVED.thresholds
    assert watched.runs.began == [Options(T=0.1, Ts=0.02, samples=20, seed=7)]
    assert watched.told == []


@pytest.mark.parametrize(
    ("state", "near"),
    [
        (MOVED, None),
        (AT_NEAR, NEAR),
        (replace(MOVED, live=False), NEAR),
        (
            replace(MOVED, method="statistical"),
            replace(NEAR, options=Options(method="statistical", samples=20)),
        ),
    ],
)
def test_nothing_is_run_where_nothing_is_behind(
    watched: Watched, state: ViewState, near: Analysis | None
) -> None:
    for rested in (False, True):
        assert not watched.pursue(state, rested=rested, near=near)
    join_jobs()
    assert watched.runs.began == []
    assert watched.ends == []


def test_a_run_for_older_thresholds_is_stopped_without_a_word(watched: Watched) -> None:
    watched.pursue(MOVED)
    watched.wait_for_runs(1, 0)
    assert watched.pursue(FURTHER, rested=False)
    watched.wait_for_runs(1, 1)
    assert [options.T for options in watched.runs.cancelled] == [0.1]
    assert not watched.pursue(FURTHER)
    watched.wait_for_runs(2, 1)
    watched.runs.release.set()
    watched.wait_for_runs(2, 2)
    assert [result.thresholds.T for _, result in watched.delivered] == [0.15]
    assert watched.told == []


def test_a_run_goes_on_while_its_thresholds_are_still_wanted(watched: Watched) -> None:
    watched.pursue(MOVED)
    watched.wait_for_runs(1, 0)
    for state in (MOVED, replace(MOVED, image=3), replace(MOVED, layer="residual")):
        for rested in (False, True):
            watched.pursue(state, rested=rested)
    looks = watched.runs.looks
    wait_until(lambda: watched.runs.looks > looks + 1 or watched.ends != [])
    watched.runs.release.set()
    watched.wait_for_runs(1, 1)
    assert watched.runs.cancelled == []
    assert len(watched.delivered) == 1


@pytest.mark.parametrize("state", [AT_NEAR, replace(MOVED, live=False)])
def test_a_run_is_stopped_when_nothing_is_behind_any_more(
    watched: Watched, state: ViewState
) -> None:
    watched.pursue(MOVED)
    watched.wait_for_runs(1, 0)
    assert not watched.pursue(state)
    watched.wait_for_runs(1, 1)
    assert len(watched.runs.cancelled) == 1
    assert watched.told == []


def test_a_cancelled_run_is_tried_again_when_its_thresholds_come_back(watched: Watched) -> None:
    watched.pursue(MOVED)
    watched.wait_for_runs(1, 0)
    watched.pursue(AT_NEAR)
    watched.wait_for_runs(1, 1)
    watched.runs.release.set()
    watched.pursue(MOVED)
    watched.wait_for_runs(2, 2)
    assert [result.thresholds for _, result in watched.delivered] == [MOVED.thresholds]


@pytest.mark.parametrize("fault", [DegenerateError("nothing is lit"), ZeroDivisionError("bug")])
def test_a_failure_is_told_once_and_only_other_thresholds_are_tried(
    watched: Watched, fault: Exception
) -> None:
    watched.runs.fault = fault
    watched.runs.release.set()
    watched.pursue(MOVED)
    watched.wait_for_runs(1, 1)
    assert watched.told == [fault]
    for rested in (False, True):
        assert not watched.pursue(MOVED, rested=rested)
    join_jobs()
    assert len(watched.runs.began) == 1

    watched.runs.fault = None
    assert watched.pursue(FURTHER, rested=False)
    watched.pursue(FURTHER)
    watched.wait_for_runs(2, 2)
    assert watched.told == [fault]
    assert [result.thresholds for _, result in watched.delivered] == [FURTHER.thresholds]


def test_a_result_that_cannot_be_delivered_is_told_of() -> None:
    fault = ValueError("no place for it")

    def refuse(method: Method, result: Analysis) -> None:
        raise fault

    watched = Watched(deliver=refuse)
    watched.runs.release.set()
    watched.pursue(MOVED)
    watched.wait_for_runs(1, 1)
    assert watched.told == [fault]
    join_jobs()


def test_whoever_is_told_of_the_end_can_start_the_next_run() -> None:
    """As a tab does: it looks again at what its sliders say."""
    runs: Any = FakeRuns()
    wanted, again = [MOVED], threading.Event()
    delivered: list[Thresholds] = []

    def ended() -> None:
        catch_up.pursue(wanted[0], NEAR, not again.is_set())
        again.set()

    catch_up = CatchUp(runs, lambda _, result: delivered.append(result.thresholds), list, ended)
    catch_up.pursue(MOVED, NEAR, True)
    wait_until(lambda: len(runs.began) == 1)
    wanted[0] = FURTHER
    catch_up.pursue(FURTHER, NEAR, True)
    wait_until(lambda: len(runs.began) == 2)
    runs.release.set()
    wait_until(lambda: delivered == [FURTHER.thresholds])
    join_jobs()


def test_once_closed_it_stops_and_starts_nothing_any_more(watched: Watched) -> None:
    watched.pursue(MOVED)
    watched.wait_for_runs(1, 0)
    watched.catch_up.close()
    watched.wait_for_runs(1, 1)
    assert len(watched.runs.cancelled) == 1
    watched.pursue(FURTHER)
    join_jobs()
    assert (len(watched.runs.began), len(watched.ends)) == (1, 1)
    assert (watched.delivered, watched.told) == ([], [])
