"""The view of the landscape: one map for each result, the latest first, only while in view."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from html import unescape
from types import SimpleNamespace
from typing import Any

import pytest
from browser import wait_until

from photolin.analysis import Analysis, Method, Options
from photolin.errors import Cancelled
from photolin.factors import Thresholds
from photolin.landscape import Landscape, map_landscape
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp.access import open_server
from webapp.clicks import Clicks
from webapp.frame import Frame, compose
from webapp.runs import Runs
from webapp.state import ViewState
from webapp.views import landscape as module
from webapp.views.landscape import LandscapeView

SCENE = render_scene("sphere_cone", size=(24, 32), images=8)
STACK = SCENE.stack
RESULT = analyze(STACK, Options(T=0.05, Ts=0.02, samples=20))
OTHER = replace(RESULT, title="other")
LAND = map_landscape(STACK, RESULT)


class Handle(SimpleNamespace):
    """A widget without a page."""

    def on_update(self, callback: Any) -> Any:
        self.updated = callback
        return callback

    on_click = on_update


class FakeGui:
    """Makes widgets that only remember."""

    def add_html(self, content: str) -> Handle:
        return Handle(content=content)

    def add_dropdown(self, _: str, options: Any, initial_value: str, hint: str) -> Handle:
        return Handle(value=initial_value, options=options, hint=hint)

    def add_progress_bar(self, value: int, **look: Any) -> Handle:
        return Handle(value=value, **look)

    def add_button(self, _: str, **look: Any) -> Handle:
        return Handle(**look)


class FakeClicks:
    """Remembers what is watched."""

    def __init__(self) -> None:
        self.clicked: dict[str, Callable[[float, float], None]] = {}
        self.seen: dict[str, Callable[[bool], None]] = {}

    def watch(self, name: str, clicked: Any, seen: Any) -> str:
        self.clicked[name], self.seen[name] = clicked, seen
        return f"photolin-{name}"

    def see(self, name: str, seen: Any) -> str:
        return self.watch(name, lambda x, y: None, seen)


@dataclass
class Watched:
    """A view, maps that last until they are released, and what came of it."""

    began: list[Analysis] = field(default_factory=list)
    cancelled: list[Analysis] = field(default_factory=list)
    moved: list[Thresholds] = field(default_factory=list)
    told: list[Exception] = field(default_factory=list)
    release: threading.Event = field(default_factory=threading.Event)
    fault: Exception | None = None

    def __post_init__(self) -> None:
        gui, self.clicks = FakeGui(), FakeClicks()
        given: tuple[Any, Any] = (gui, self.clicks)
        self.view = LandscapeView(*given, self.moved.append, self.told.append)

    def make(self, _: Any, analysis: Analysis, progress: Any, cancel: Any, **__: Any) -> Landscape:
        self.began.append(analysis)
        while not self.release.wait(0.005):
            progress("landscape", 0.5)
            if cancel():
                self.cancelled.append(analysis)
                raise Cancelled("landscape was cancelled")
        if self.fault is not None:
            raise self.fault
        return LAND

    def see(self, shown: bool) -> None:
        self.clicks.seen["landscape-view"](shown)

    @property
    def html(self) -> str:
        return unescape(self.view._picture.content)


@pytest.fixture
def watched(monkeypatch: pytest.MonkeyPatch) -> Iterator[Watched]:
    one = Watched()
    monkeypatch.setattr(module, "map_landscape", one.make)
    yield one
    one.view.close()
    for thread in threading.enumerate():
        if thread.name == "job":
            thread.join(5)
            assert not thread.is_alive()


def frame(analysis: Analysis | None = RESULT, T: float = 0.05, preview: Any = None) -> Frame:
    results: dict[Method, Analysis] = {}
    if analysis is not None:
        results[analysis.options.method] = analysis
    return replace(
        compose(Runs(STACK, Options()), results, ViewState(T=T, Ts=0.02)), preview=preview
    )


def drawn(watched: Watched) -> bool:
    return "<svg" in watched.html


def test_a_map_is_made_once_when_its_place_comes_into_view(watched: Watched) -> None:
    watched.release.set()
    watched.view.draw(frame(None))
    assert "There is no result yet" in watched.html
    watched.view.draw(frame())
    assert watched.began == []
    watched.see(True)
    wait_until(lambda: drawn(watched))
    assert 'id="photolin-landscape"' in watched.html
    watched.see(False)
    watched.see(True)
    before = watched.html
    watched.view.draw(frame(T=0.1))
    assert watched.html != before
    assert watched.began == [RESULT]


def test_only_the_latest_result_gets_a_map(watched: Watched) -> None:
    watched.see(True)
    watched.view.draw(frame())
    wait_until(lambda: watched.began == [RESULT])
    third = replace(RESULT, title="third")
    watched.view.draw(frame(OTHER))
    watched.view.draw(frame(third))
    watched.release.set()
    wait_until(lambda: drawn(watched))
    assert watched.began[0] is RESULT
    assert watched.began[-1] is third
    assert len(watched.view._maps) <= 2
    assert watched.view._maps[0][0] is third
    assert watched.told == []


def test_an_earlier_result_still_has_its_map(watched: Watched) -> None:
    watched.release.set()
    watched.see(True)
    for result in (RESULT, OTHER, RESULT):
        watched.view.draw(frame(result))
        wait_until(lambda: drawn(watched))
    assert [a is RESULT for a in watched.began] == [True, False]


def test_a_preview_shows_the_map_of_the_run_it_is_made_from(watched: Watched) -> None:
    watched.release.set()
    watched.see(True)
    watched.view.draw(frame(OTHER, preview=SimpleNamespace(near=RESULT)))
    wait_until(lambda: drawn(watched))
    assert [a is RESULT for a in watched.began] == [True]
    assert "last final result" in watched.html


def test_progress_shows_and_a_cancelled_map_is_made_when_opened_again(
    watched: Watched, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "PATIENCE", 0.0)
    watched.see(True)
    watched.view.draw(frame())
    wait_until(lambda: watched.view._cancel.visible and watched.view._bar.value == 50)
    watched.view.cancel()
    wait_until(lambda: not watched.view._cancel.visible and "open this part again" in watched.html)
    watched.view.draw(frame(T=0.1))
    assert len(watched.began) == 1
    watched.release.set()
    watched.see(True)
    wait_until(lambda: drawn(watched))
    assert watched.told == []


def test_going_out_of_view_stops_the_work(watched: Watched) -> None:
    watched.see(True)
    watched.view.draw(frame())
    wait_until(lambda: len(watched.began) == 1)
    watched.see(False)
    wait_until(lambda: watched.cancelled == [RESULT])
    watched.release.set()
    watched.see(True)
    wait_until(lambda: drawn(watched))


@pytest.mark.parametrize("fault", [ValueError("bug")])
def test_a_failure_is_told_once(watched: Watched, fault: Exception) -> None:
    watched.fault = fault
    watched.release.set()
    watched.see(True)
    for T in (0.05, 0.06, 0.07):
        watched.view.draw(frame(T=T))
    wait_until(lambda: watched.told == [fault] and "no map" in watched.html)
    watched.view.draw(frame())
    assert len(watched.began) == 1


def test_a_click_sets_the_thresholds_of_its_cell(watched: Watched) -> None:
    watched.clicks.clicked["landscape"](0.5, 0.5)
    assert watched.moved == []
    watched.release.set()
    watched.see(True)
    watched.view.draw(frame())
    wait_until(lambda: drawn(watched))
    watched.clicks.clicked["landscape"](0.999, 0.999)
    assert watched.moved == [Thresholds(float(LAND.T[-1]), float(LAND.Ts[0]))]


def test_quantities_are_those_the_map_has_and_hostile_ones_are_none(watched: Watched) -> None:
    assert "macro accuracy" not in watched.view._quantity.options
    watched.release.set()
    watched.see(True)
    watched.view.draw(frame())
    wait_until(lambda: drawn(watched))
    change = watched.html
    for value in ("macro accuracy", "<b>", 7, None):
        watched.view._quantity.value = value  # pyright: ignore
        watched.view._show()
        assert watched.html == change
    watched.view._quantity.value = "undefined"
    watched.view._show()
    assert watched.html != change


@pytest.mark.browser
def test_a_person_opens_the_map_and_clicks_into_it(page: Any) -> None:
    """With its real parts: colours on screen, a click, and T and Ts of the cell under it."""
    server, moved, views = open_server(port=0), [], []
    told: list[Exception] = []

    def connect(client: Any) -> None:
        tabs = client.gui.add_tab_group()
        with tabs.add_tab("One"):
            client.gui.add_html("first")
        with tabs.add_tab("Map"):
            view = LandscapeView(client.gui, Clicks(client), moved.append, told.append, known=True)
        view.draw(replace(frame(), truth=SCENE.truth.labels))
        views.append(view)

    server.server.on_client_connect(connect)
    try:
        page.goto(server.url)
        page.get_by_role("tab", name="Map").click()
        page.wait_for_selector("#photolin-landscape image")
        box = page.locator("#photolin-landscape").bounding_box()
        for at in (0.3, 0.9):
            page.mouse.click(box["x"] + at * box["width"], box["y"] + 0.2 * box["height"])
            count = 1 if at == 0.3 else 2
            wait_until(lambda count=count: len(moved) == count)
        land = map_landscape(STACK, RESULT)
        expected = [Thresholds(float(land.T[c]), float(land.Ts[19])) for c in (7, 21)]
        assert moved == expected
        assert views[0]._quantity.options[-1] == "macro accuracy"
        assert told == []
    finally:
        for view in views:
            view.close()
        server.stop()
