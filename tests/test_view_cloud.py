"""The view of the cloud: drawn in a thread, only while in view, the last one wanted wins."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from html import unescape
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from browser import wait_until

from photolin.analysis import Analysis, Method, Options
from photolin.candidates import draw_candidates
from photolin.errors import Cancelled, DegenerateError
from photolin.load.exclude import exclude_images
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp.frame import Frame, compose
from webapp.lights_plot import format_vector
from webapp.runs import Runs
from webapp.state import ViewState
from webapp.views import cloud as module
from webapp.views.cloud import CloudView

SCENE = render_scene("sphere_cone", size=(24, 32), images=8)
STACK = SCENE.stack
RESULT = analyze(STACK, Options(T=0.05, Ts=0.02, samples=20))
BASE = RESULT.base_images[0]
ONE, OTHER, *_ = (k for k in range(8) if k not in RESULT.base_images)


class Handle:
    """A widget without a page; tells of a value once it is assigned."""

    def __init__(self, value: Any = None, content: str = "") -> None:
        self._value, self.content = value, content
        self.updated: Callable[[Any], Any] | None = None

    @property
    def value(self) -> Any:
        return self._value

    @value.setter
    def value(self, value: Any) -> None:
        self._value = value
        assert self.updated is not None
        with pytest.raises(StopIteration):
            self.updated(None).send(None)

    def on_update(self, callback: Any) -> Any:
        self.updated = callback
        return callback


class FakeGui:
    """Makes widgets that only remember."""

    def add_html(self, content: str) -> Handle:
        return Handle(content=content)

    add_markdown = add_html

    def add_dropdown(self, _: str, options: Any, initial_value: str, hint: str) -> Handle:
        return Handle(initial_value)

    def add_slider(self, *numbers: Any, hint: str) -> Handle:
        return Handle(numbers[-1])


class FakeClicks:
    """Remembers what is watched."""

    def __init__(self) -> None:
        self.seen: Any = None
        self.dragged: Any = None

    def see(self, name: str, seen: Any) -> str:
        self.seen = seen
        return f"photolin-{name}"

    def drag(self, name: str, dragged: Any) -> str:
        self.dragged = dragged
        return f"photolin-{name}"


@dataclass
class Seen:
    """A view, clouds that last until they are released, and what came of it."""

    began: list[Any] = field(default_factory=list)
    cancelled: list[int] = field(default_factory=list)
    told: list[Exception] = field(default_factory=list)
    release: threading.Event = field(default_factory=threading.Event)
    fault: Exception | None = None

    def __post_init__(self) -> None:
        gui, self.clicks = FakeGui(), FakeClicks()
        given: tuple[Any, Any] = (gui, self.clicks)
        self.view = CloudView(*given, self.told.append)

    def make(self, stack: Any, analysis: Any, image: int, *, cancel: Any, **asked: Any) -> Any:
        self.began.append((image, asked["source"], asked["count"], asked["thresholds"].T))
        while not self.release.wait(0.005):
            if cancel():
                self.cancelled.append(image)
                raise Cancelled("candidates was cancelled")
        if self.fault is not None:
            raise self.fault
        return draw_candidates(stack, analysis, image, **asked)

    @property
    def images(self) -> list[int]:
        return [image for image, *_ in self.began]

    @property
    def html(self) -> str:
        return unescape(self.view._html.content)

    @property
    def lights(self) -> str:
        return unescape(self.view._lights.content)

    def wait_for(self, words: str) -> None:
        wait_until(lambda: words in self.html)


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> Iterator[Seen]:
    one = Seen()
    monkeypatch.setattr(module, "draw_candidates", one.make)
    yield one
    one.view.close()
    for thread in threading.enumerate():
        if thread.name == "job":
            thread.join(5)
            assert not thread.is_alive()


def frame(image: int = ONE, analysis: Analysis | None = RESULT, T: float = 0.05) -> Frame:
    results: dict[Method, Analysis] = {}
    if analysis is not None:
        results[analysis.options.method] = analysis
    return compose(Runs(STACK, Options()), results, ViewState(image=image, T=T, Ts=0.02))


def test_a_cloud_is_drawn_once_when_its_place_comes_into_view(seen: Seen) -> None:
    seen.release.set()
    seen.view.draw(frame())
    assert seen.began == []
    assert seen.html == '<div id="photolin-cloud"></div>'
    seen.clicks.seen(True)
    seen.wait_for(f"Image {ONE}: ")
    assert 'id="photolin-cloud"' in seen.html
    seen.clicks.seen(False)
    seen.clicks.seen(True)
    seen.view.draw(frame())
    assert seen.began == [(ONE, "base images", 2000, 0.05)]


def test_without_a_result_it_says_so(seen: Seen) -> None:
    seen.clicks.seen(True)
    seen.view.draw(frame(analysis=None))
    assert "There is no result yet" in seen.html
    assert seen.began == []


def test_stepping_back_draws_nothing_again_and_T_counts_support_anew(seen: Seen) -> None:
    seen.release.set()
    seen.clicks.seen(True)
    for image, T in ((ONE, 0.05), (OTHER, 0.05), (ONE, 0.05), (ONE, 0.1)):
        seen.view.draw(frame(image, T=T))
        seen.wait_for(f"Image {image}: ")
        seen.wait_for(f"within T = {100 * T:g} %")
    assert [(image, T) for image, _, _, T in seen.began] == [
        (ONE, 0.05),
        (OTHER, 0.05),
        (ONE, 0.1),
    ]


def test_another_result_draws_anew_only_where_it_is_what_is_solved(seen: Seen) -> None:
    seen.release.set()
    seen.clicks.seen(True)
    other = replace(RESULT, coefficients=RESULT.coefficients * 1.5)
    for analysis in (RESULT, other):
        seen.view.draw(frame(analysis=analysis))
        seen.wait_for(f"Result: c = {format_vector(analysis.coefficients[ONE])}")
    assert len(seen.began) == 1
    seen.view._source.value = "linearized bases"
    seen.wait_for("D + A + C - U")
    seen.view.draw(frame())
    wait_until(lambda: len(seen.began) == 3)


def test_a_stack_with_fewer_images_gets_a_cloud_of_its_own(seen: Seen) -> None:
    seen.release.set()
    seen.clicks.seen(True)
    seen.view.draw(frame(7))
    seen.wait_for("Image 7")
    few = replace(STACK, images=STACK.images[:7], names=STACK.names[:7], lights=None)
    shown = replace(RESULT, coefficients=RESULT.coefficients[:7], labels=RESULT.labels[:7])
    seen.release.clear()
    seen.view.draw(replace(frame(ONE, analysis=shown), stack=few))
    assert f"Candidates for image {ONE} are being drawn." in seen.html
    assert "<svg" not in seen.html
    seen.release.set()
    seen.wait_for(f"Image {ONE}")
    assert "Coefficients of all 7 images" in seen.lights
    seen.view.draw(frame(ONE))  # the same number, yet another stack
    seen.wait_for("2000 candidates")
    wait_until(lambda: seen.images == [7, ONE, ONE])


def test_drawing_comes_to_rest(seen: Seen) -> None:
    seen.release.set()
    seen.clicks.seen(True)
    seen.view.draw(frame())
    seen.wait_for(f"Image {ONE}: ")
    seen.view._turn.value = 70
    wait_until(lambda: not any(thread.name == "job" for thread in threading.enumerate()))


def test_while_one_is_drawn_the_last_is_faint_and_only_the_newest_follows(seen: Seen) -> None:
    seen.release.set()
    seen.clicks.seen(True)
    seen.view.draw(frame(ONE))
    seen.wait_for(f"Image {ONE}: ")
    seen.release.clear()
    for image in (OTHER, BASE):
        seen.view.draw(frame(image))
        seen.wait_for(f"Candidates for image {image} are being drawn; those of image {ONE}")
    assert "opacity:0.4" in seen.html
    seen.release.set()
    seen.wait_for(f"Image {BASE} is a base image: all candidates are its unit vector.")
    assert "opacity:0.4" not in seen.html
    assert seen.images[-1] == BASE


def test_one_that_takes_long_gives_way(seen: Seen, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PATIENCE", 0.0)
    seen.clicks.seen(True)
    seen.view.draw(frame(ONE))
    wait_until(lambda: seen.images == [ONE])
    seen.view.draw(frame(OTHER))
    wait_until(lambda: seen.cancelled == [ONE] and seen.images == [ONE, OTHER])
    seen.clicks.seen(False)
    wait_until(lambda: seen.cancelled == [ONE, OTHER])
    seen.release.set()
    seen.clicks.seen(True)
    seen.wait_for(f"Image {OTHER}: ")


def test_choices_and_the_view_are_those_of_the_widgets(seen: Seen) -> None:
    seen.release.set()
    seen.clicks.seen(True)
    seen.view.draw(frame())
    seen.wait_for("of 2000 candidates")
    seen.view._count.value = "500"
    seen.wait_for("of 500 candidates")
    seen.view._source.value = "linearized bases"
    seen.wait_for("D + A + C - U")
    assert [(source, count) for _, source, count, _ in seen.began] == [
        ("base images", 2000),
        ("base images", 500),
        ("linearized bases", 500),
    ]
    for handle, value in ((seen.view._turn, 90), (seen.view._tilt, -10), (seen.view._zoom, 5.0)):
        before = seen.html
        handle.value = value
        wait_until(lambda before=before: seen.html != before)
    assert len(seen.began) == 3


@pytest.mark.parametrize("value", [float("nan"), None, "x", 1e300])
def test_impossible_values_are_put_right(seen: Seen, value: Any) -> None:
    seen.release.set()
    for handle in (seen.view._turn, seen.view._tilt, seen.view._zoom, seen.view._count):
        handle.value = value
    seen.view._source.value = value
    seen.clicks.seen(True)
    seen.view.draw(frame())
    seen.wait_for("of 2000 candidates")


def test_a_drag_turns_the_cube_around_and_over_up_to_its_poles(seen: Seen) -> None:
    turn, tilt = seen.view._turn, seen.view._tilt
    first = turn.value, tilt.value
    for _ in range(100):  # less than a degree each
        seen.clicks.dragged(0.001, 0.001)
    assert turn.value == first[0] - 24
    assert tilt.value == first[1] + 18
    for _ in range(9):
        seen.clicks.dragged(1.0, 1.0)
        assert -180 <= turn.value <= 180
    assert tilt.value == 90
    seen.clicks.dragged(0.0, -1.0)
    assert tilt.value == -90


def test_an_image_too_dark_gets_a_sentence_and_is_not_tried_again(seen: Seen) -> None:
    seen.release.set()
    seen.fault = DegenerateError("image 3 is lit in fewer than three pixels; lower Ts")
    seen.clicks.seen(True)
    seen.view.draw(frame())
    seen.wait_for("There is no cloud: image 3 is lit in fewer than three pixels; lower Ts.")
    seen.view.draw(frame())
    assert len(seen.began) == 1
    assert seen.told == []


def test_a_fault_is_told_once(seen: Seen) -> None:
    seen.release.set()
    seen.fault = ValueError("bug")
    seen.clicks.seen(True)
    seen.view.draw(frame())
    seen.wait_for("photolin made a mistake")
    seen.view.draw(frame())
    assert seen.told == [seen.fault]
    assert len(seen.began) == 1


def test_clouds_of_results_long_gone_are_let_go(seen: Seen) -> None:
    seen.release.set()
    seen.clicks.seen(True)
    for step in range(module.KEPT + 3):
        T = 0.05 + 0.001 * step
        seen.view.draw(frame(T=T))
        seen.wait_for(f"within T = {100 * T:g} %")
    assert len(seen.view._clouds) == module.KEPT


def test_lights_are_directions_where_known_and_coefficients_elsewhere(seen: Seen) -> None:
    seen.release.set()
    seen.clicks.seen(True)
    seen.view.draw(frame())
    seen.wait_for("Image")
    assert f"Coefficients of all 8 images; image {ONE} is ringed." in seen.lights
    assert "tab Shape" in seen.lights
    given = replace(RESULT, lights=np.array(SCENE.truth.lights, float))
    seen.view.draw(frame(analysis=given))
    assert "Lights of all 8 images as given" in seen.lights
    recovered: Any = SimpleNamespace(shape=SimpleNamespace(lights=-given.lights), analysis=RESULT)
    seen.view.draw(replace(frame(), recovered=recovered))
    assert "Lights of all 8 images as recovered" in seen.lights


def test_clouds_keep_no_stack_and_no_result_that_others_have_followed(seen: Seen) -> None:
    seen.release.set()
    seen.clicks.seen(True)
    seen.view._source.value = "linearized bases"
    gone = replace(RESULT)
    seen.view.draw(frame(analysis=gone))
    seen.wait_for(f"Image {ONE}: ")
    seen.view.draw(frame(OTHER))
    seen.wait_for(f"Image {OTHER}: ")
    wait_until(lambda: all(wanted.analysis is not gone for wanted in seen.view._clouds))
    assert len(seen.view._clouds) == 1
    left = exclude_images(STACK, [7])
    few = analyze(left, Options(T=0.05, Ts=0.02, samples=20))
    seen.view.draw(compose(Runs(left, Options()), {"robust": few}, ViewState(Ts=0.02)))
    wait_until(lambda: all(wanted.stack is left for wanted in seen.view._clouds))
