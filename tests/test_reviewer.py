"""What the overview shows: one review at a time, the latest first, only while somebody looks."""

import threading
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from browser import wait_until

from photolin.analysis import Analysis, Options
from photolin.errors import Cancelled
from photolin.factors import Factor
from photolin.load.exclude import exclude_images
from photolin.overview import review_images
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp import reviewer as module
from webapp.frame import Frame, compose
from webapp.often import label_all
from webapp.reviewer import Reviewer
from webapp.runs import Runs
from webapp.state import ViewState

WHOLE = render_scene("sphere_cone", size=(24, 32), images=9).stack
OPTIONS = Options(T=0.05, Ts=0.02, samples=20)
RESULT = analyze(WHOLE, OPTIONS)
OTHER = replace(RESULT, title="other")
REVIEWS = review_images(WHOLE, RESULT)


def frame(result: Analysis | None = RESULT, T: float = 0.05, excluded: Any = ()) -> Frame:
    runs = Runs(exclude_images(WHOLE, excluded), Options(), excluded=excluded)
    return compose(runs, {} if result is None else {"robust": result}, ViewState(T=T, Ts=0.02))


@dataclass
class Bench:
    """A reviewer, reviews that last until they are released, and what came of it."""

    began: list[Analysis] = field(default_factory=list)
    cancelled: list[Analysis] = field(default_factory=list)
    told: list[Exception] = field(default_factory=list)
    changes: list[float | None] = field(default_factory=list)
    release: threading.Event = field(default_factory=threading.Event)
    fault: Exception | None = None

    def __post_init__(self) -> None:
        self.reviewer = Reviewer(WHOLE, self.note, self.told.append)

    def note(self) -> None:
        self.changes.append(self.reviewer.fraction)

    def make(self, stack: Any, analysis: Analysis, progress: Any, cancel: Any) -> Any:
        self.began.append(analysis)
        while not self.release.wait(0.005):
            progress("overview", 0.5)
            if cancel():
                self.cancelled.append(analysis)
                raise Cancelled("the overview was cancelled")
        if self.fault is not None:
            raise self.fault
        return review_images(stack, analysis)


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Any:
    made = Bench()
    monkeypatch.setattr(module, "review_images", made.make)
    yield made
    made.release.set()
    made.reviewer.close()


def reviewed(bench: Bench, shown: Frame) -> bool:
    return bench.reviewer.is_reviewed(shown) and bench.reviewer.fraction is None


def test_thumbnails_shares_and_reviews_are_made_once(bench: Bench) -> None:
    bench.release.set()
    shown = frame()
    bench.reviewer.look_at(shown)
    wait_until(lambda: reviewed(bench, shown))
    assert bench.reviewer.sheet is not None
    sheet = bench.reviewer.sheet
    assert set(bench.reviewer.health) == set(bench.reviewer.shares) == set(range(9))
    for k, share in bench.reviewer.shares.items():
        assert share.tolist() == REVIEWS[k].shares.tolist()
    for again in (frame(), frame(T=0.3), frame(OTHER), frame()):
        bench.reviewer.look_at(again)
        wait_until(lambda again=again: reviewed(bench, again))
    assert bench.began == [RESULT, OTHER]
    assert bench.reviewer.sheet is sheet


def test_without_a_result_there_are_thumbnails_alone(bench: Bench) -> None:
    bench.reviewer.look_at(frame(None))
    wait_until(lambda: bench.reviewer.sheet is not None and bool(bench.changes))
    assert bench.began == []
    assert bench.reviewer.shares == {}


def test_shares_follow_T_while_a_review_is_being_made(bench: Bench) -> None:
    bench.reviewer.look_at(frame())
    wait_until(lambda: bench.began == [RESULT])
    moved = frame(T=0.9)
    bench.reviewer.look_at(moved)
    labels = label_all(WHOLE, RESULT, moved.state.thresholds)
    expected = np.count_nonzero(labels[4] == Factor.DIFFUSE) / WHOLE.mask.sum()
    assert expected != REVIEWS[4].shares[Factor.DIFFUSE]
    wait_until(lambda: bench.reviewer.shares[4][Factor.DIFFUSE] == expected)
    assert bench.cancelled == []
    bench.release.set()
    wait_until(lambda: reviewed(bench, moved))
    assert bench.began == [RESULT]


def test_a_review_is_overtaken_by_the_latest_result_alone(bench: Bench) -> None:
    bench.reviewer.look_at(frame())
    wait_until(lambda: bench.began == [RESULT])
    third = replace(RESULT, title="third")
    bench.reviewer.look_at(frame(OTHER))
    bench.reviewer.look_at(frame(third))
    wait_until(lambda: bench.cancelled == [RESULT])
    bench.release.set()
    wait_until(lambda: reviewed(bench, frame(third)))
    assert bench.began[-1] is third
    assert not bench.reviewer.is_reviewed(frame())


def test_nobody_looking_stops_it_and_looking_again_begins_anew(bench: Bench) -> None:
    bench.reviewer.look_at(frame())
    wait_until(lambda: bench.began == [RESULT])
    bench.reviewer.look_at(None)
    wait_until(lambda: bench.cancelled == [RESULT])
    bench.release.set()
    bench.reviewer.look_at(frame())
    wait_until(lambda: reviewed(bench, frame()))


def test_progress_is_told_when_it_takes_long_and_ends(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "PATIENCE", 0.0)
    bench.reviewer.look_at(frame())
    wait_until(lambda: 0.5 in bench.changes)
    bench.release.set()
    wait_until(lambda: reviewed(bench, frame()) and bench.changes[-1] is None)
    assert bench.told == []


def test_what_was_cancelled_waits_until_it_is_asked_for_again(bench: Bench) -> None:
    bench.reviewer.look_at(frame())
    wait_until(lambda: bench.began == [RESULT])
    bench.reviewer.cancel()
    wait_until(lambda: bench.cancelled == [RESULT] and bench.reviewer.is_declined(frame()))
    bench.reviewer.look_at(frame(T=0.3))  # shares still follow
    wait_until(lambda: bench.reviewer.shares[4].tolist() != REVIEWS[4].shares.tolist())
    assert bench.began == [RESULT]
    bench.release.set()
    bench.reviewer.look_at(None)
    bench.reviewer.look_at(frame())
    wait_until(lambda: reviewed(bench, frame()))
    bench.reviewer.cancel()
    assert not bench.reviewer.is_declined(frame())


def test_a_failure_is_told_once(bench: Bench) -> None:
    bench.fault = ValueError("bug")
    bench.release.set()
    bench.reviewer.look_at(frame())
    wait_until(lambda: bench.told == [bench.fault])
    for T in (0.05, 0.06):
        bench.reviewer.look_at(frame(T=T))
    assert bench.began == [RESULT]
    assert bench.told == [bench.fault]


def test_a_closed_one_begins_nothing(bench: Bench) -> None:
    bench.reviewer.close()
    bench.reviewer.look_at(frame())
    assert bench.began == []
    assert bench.reviewer.sheet is None


def test_after_exclusion_all_goes_by_numbers_of_the_whole_stack(bench: Bench) -> None:
    bench.release.set()
    bench.reviewer.look_at(frame())
    wait_until(lambda: reviewed(bench, frame()))
    before, shares = dict(bench.reviewer.health), dict(bench.reviewer.shares)
    less = analyze(exclude_images(WHOLE, (2, 5)), OPTIONS)
    bench.reviewer.look_at(frame(less, excluded=(2, 5)))
    wait_until(lambda: reviewed(bench, frame(less, excluded=(2, 5))))
    wait_until(lambda: bench.reviewer.shares[3] is not shares[3])
    kept = [0, 1, 3, 4, 6, 7, 8]
    found = review_images(exclude_images(WHOLE, (2, 5)), less)
    for k, review in zip(kept, found, strict=True):
        assert bench.reviewer.shares[k].tolist() == review.shares.tolist()
    for k in (2, 5):  # as they were when they were there
        assert bench.reviewer.health[k] is before[k]
        assert bench.reviewer.shares[k] is shares[k]
