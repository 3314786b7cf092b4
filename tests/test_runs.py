"""Runs shared by tabs: computed once, one at a time, each tab free to leave."""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest
from browser import wait_until
from lambert import lambertian, wrap
from numba import njit

from photolin.analysis import Analysis, Cancel, Options, Progress
from photolin.compiling import COMPILING
from photolin.errors import Cancelled, DegenerateError
from photolin.pipeline import analyze
from photolin.stack import ImageStack
from webapp import runs as module
from webapp.runs import KEPT, Runs

STACK = lambertian(8, (12, 14))[0]
OPTIONS = Options(T=0.05, Ts=0.02, samples=20)


def never() -> bool:
    return False


def silent(stage: str, fraction: float) -> None:
    """No progress is shown."""


class Slow:
    """`analyze`, held up until it is released or cancelled."""

    def __init__(self) -> None:
        self.began: list[Options] = []
        self.release = threading.Event()

    def __call__(
        self, stack: ImageStack, options: Options, *, progress: Progress, cancel: Cancel
    ) -> Analysis:
        self.began.append(options)
        while not self.release.wait(0.01):
            if cancel():
                raise Cancelled("the run was cancelled")
        return analyze(stack, options, progress=progress, cancel=cancel)


@pytest.fixture
def slow(monkeypatch: pytest.MonkeyPatch) -> Slow:
    replacement = Slow()
    monkeypatch.setattr(module, "analyze", replacement)
    return replacement


def test_a_run_is_the_analysis_of_its_options() -> None:
    done = Runs(STACK, OPTIONS).run(OPTIONS, silent, never)
    assert (done.labels == analyze(STACK, OPTIONS).labels).all()
    assert done.options == OPTIONS


def test_two_tabs_that_ask_the_same_compute_once(slow: Slow) -> None:
    runs = Runs(STACK, OPTIONS)
    waiting: list[str] = []
    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(runs.run, OPTIONS, silent, never)
        wait_until(lambda: len(slow.began) == 1)
        second = pool.submit(runs.run, OPTIONS, lambda stage, _: waiting.append(stage), never)
        wait_until(lambda: waiting != [])
        slow.release.set()
        assert first.result(10) is second.result(10)
    assert slow.began == [OPTIONS]
    assert set(waiting) == {"waiting for another tab"}
    assert runs.run(OPTIONS, silent, never) is first.result()


def test_a_cancelled_run_cancels_no_other_tab(slow: Slow) -> None:
    runs = Runs(STACK, OPTIONS)
    gone = threading.Event()
    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(runs.run, OPTIONS, silent, gone.is_set)
        wait_until(lambda: len(slow.began) == 1)
        second = pool.submit(runs.run, OPTIONS, silent, never)
        gone.set()
        assert isinstance(first.exception(10), Cancelled)
        wait_until(lambda: len(slow.began) == 2)
        slow.release.set()
        assert second.result(10).options == OPTIONS


def test_a_tab_that_waits_for_its_turn_can_leave(slow: Slow) -> None:
    runs = Runs(STACK, OPTIONS)
    with ThreadPoolExecutor(1) as pool:
        first = pool.submit(runs.run, OPTIONS, silent, never)
        wait_until(lambda: len(slow.began) == 1)
        with pytest.raises(Cancelled, match="the run was cancelled before it began"):
            runs.run(Options(seed=9), silent, lambda: True)
        slow.release.set()
        assert first.result(10).options == OPTIONS
    assert slow.began == [OPTIONS]


def test_the_oldest_result_is_let_go(slow: Slow) -> None:
    slow.release.set()
    runs = Runs(STACK, OPTIONS)
    asked = [Options(T=0.05, Ts=0.02, samples=20, seed=seed) for seed in range(KEPT + 1)]
    first, *_, last = [runs.run(options, silent, never) for options in asked]
    assert runs.run(asked[-1], silent, never) is last
    assert runs.run(asked[0], silent, never) is not first
    assert len(slow.began) == KEPT + 2


def test_what_cannot_be_solved_is_told_and_leaves_the_turn_to_the_next() -> None:
    flat = lambertian(8, (12, 14), flat=True)[0]
    runs = Runs(flat, OPTIONS)
    for _ in range(2):
        with pytest.raises(DegenerateError):
            runs.run(OPTIONS, silent, never)


@pytest.mark.parametrize("given", [Options(), Options(T=0.3, Ts=0.3)])
def test_suggested_thresholds_are_those_of_a_run_that_was_given_none(given: Options) -> None:
    stack = wrap(STACK.images)
    assert Runs(stack, given).suggest(silent, never) == analyze(stack, Options()).thresholds


def test_compiling_is_told_for_as_long_as_it_lasts(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []

    def compile_first(*_: object, progress: Progress, cancel: Cancel) -> Analysis:
        progress("coefficients", 0.0)
        njit(lambda x: x + 1)(1)
        return analyze(STACK, OPTIONS)

    monkeypatch.setattr(module, "analyze", compile_first)
    Runs(STACK, OPTIONS).run(OPTIONS, lambda stage, _: told.append(stage), never)
    assert told[0] == told[-1] == "coefficients"
    assert set(told[1:-1]) == {COMPILING}


def test_a_suggestion_can_be_cancelled() -> None:
    stopping: Callable[[], bool] = lambda: True  # noqa: E731
    with pytest.raises(Cancelled):
        Runs(STACK, Options()).suggest(silent, stopping)
