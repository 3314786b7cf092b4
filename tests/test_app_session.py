"""In a real browser: nothing that was set is lost, and the command gives what was on screen."""

import json
import shlex
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pytest
from browser import click_pixel, open_canvas, press, wait_until

from photolin.analysis import Options
from photolin.cli import main
from photolin.export import load_result
from photolin.factors import Thresholds
from photolin.load import load_stack
from photolin.load.exclude import exclude_images
from photolin.pipeline import analyze
from photolin.synthetic import render_scene, write_scene
from webapp.app import App
from webapp.courtesy import give_way
from webapp.frame import Frame
from webapp.keeper import NAME, saved_place
from webapp.session import Session
from webapp.source import Source

pytestmark = [
    pytest.mark.browser,
    # a tab may close while its worker draws
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

SCENE = render_scene("sphere_cone", size=(48, 64), images=8)
OPTIONS = Options(T=0.05, Ts=0.02, samples=50)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_scene(SCENE, tmp_path / "scene")
    return tmp_path / "scene"


OpenApp = Callable[..., App]


@pytest.fixture
def open_app() -> Iterator[OpenApp]:
    apps: list[App] = []

    def open_one(folder: Path, options: Options = OPTIONS) -> App:
        stack = load_stack(folder)
        source = Source(stack, None, options, path=folder, place=saved_place(folder))
        apps.append(App(source, port=0))
        return apps[-1]

    yield open_one
    for opened in apps:
        opened.stop()


def enter(page: Any, app: App) -> Session:
    """Open a tab of the browser, or load it again, and wait for a result."""
    page.set_viewport_size({"width": 1000, "height": 640})  # software GL is slow
    before = set(app._sessions.values())
    open_canvas(page, app.server.url)
    page.add_style_tag(content="* { box-shadow: none !important }")
    wait_until(lambda: len(app._sessions) == 1 and not before & set(app._sessions.values()))
    (session,) = app._sessions.values()
    wait_until(lambda: session._frame is not None and session._frame.analysis is not None, 30)
    wait_until(lambda: session._record.latest is not None)
    return session


def kept(session: Session) -> bool:
    return session._record.latest is not None and session._record.latest.state == session._read()


def test_what_was_set_survives_a_reload_and_a_restart(
    page: Any, open_app: OpenApp, folder: Path
) -> None:
    app = open_app(folder)
    session = enter(page, app)
    assert not (folder / NAME).exists()  # nobody has done anything
    press(page, "]", "]", "}", "ArrowRight", "ArrowDown", "3")
    click_pixel(page, 20, 30)
    wait_until(lambda: session._pointing.pixel == (20, 30))
    press(page, "p")
    page.get_by_role("tab", name="Export").click()
    page.locator("textarea:visible").fill("the left lamp flickers")
    session._exclude(5)
    wait_until(lambda: session._bench.runs.excluded == (5,) and kept(session))
    state = session._read()
    assert (state.image, state.layer, state.pins) == (1, "linearized", ((20, 30),))
    assert state.T > OPTIONS.T  # type: ignore[operator]

    again = enter(page, app)
    wait_until(lambda: again._read() == state)
    assert again._bench.runs.excluded == (5,)
    assert again._panels.notes.read() == "the left lamp flickers"
    wait_until(lambda: again._bench.work.results["robust"].thresholds == state.thresholds)

    app.stop()
    told = json.loads((folder / NAME).read_text())
    assert told["exclusions"] == [5]
    restarted = enter(page, open_app(folder, Options(samples=50)))
    wait_until(lambda: restarted._read() == state)
    expected = analyze(
        exclude_images(load_stack(folder), [5]), replace(OPTIONS, T=state.T, Ts=state.Ts)
    )
    found = restarted._bench.work.results["robust"]
    assert np.array_equal(found.labels, expected.labels)
    page.get_by_role("tab", name="Export").click()
    page.get_by_text("the left lamp flickers").wait_for()


def test_an_image_is_left_out_and_taken_in_again(
    page: Any, open_app: OpenApp, folder: Path
) -> None:
    session = enter(page, open_app(folder))
    whole = session._bench.work.results["robust"]
    press(page, *["ArrowRight"] * 3)
    wait_until(lambda: session._read().image == 3)
    session._exclude(3)
    page.get_by_text("7 images (1 left out)").wait_for()
    wait_until(lambda: "robust" in session._bench.work.results)
    assert session._frame is not None
    left = session._bench.work.results["robust"]
    expected = analyze(exclude_images(load_stack(folder), [3]), OPTIONS)
    assert np.array_equal(left.labels, expected.labels)
    assert session._read().image == 3  # the one that followed
    page.get_by_text("004.png").wait_for()
    session._exclude(3, False)
    page.get_by_text("8 images, 48").wait_for()
    page.get_by_text("004.png").wait_for()  # still the same
    assert session._bench.work.results["robust"] is whole
    for k in (0, 1, 2):
        session._exclude(k)
    page.get_by_text("exclude leaves 5 of 8 images").wait_for()
    wait_until(lambda: session._excluded == session._bench.runs.excluded)
    assert len(session._bench.runs.stack.images) >= 6


def test_the_copied_command_makes_what_is_on_screen(
    page: Any, open_app: OpenApp, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(folder.parent)
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    session = enter(page, open_app(folder))
    session._exclude(6)
    press(page, "]", "}")
    wanted = session._read().thresholds
    assert wanted != Thresholds(0.05, 0.02)
    wait_until(lambda: session._bench.runs.excluded == (6,))
    wait_until(lambda: "robust" in session._bench.work.results)
    wait_until(lambda: session._bench.work.results["robust"].thresholds == wanted)
    press(page, "c")
    page.get_by_text("Copied", exact=True).wait_for()
    command = page.evaluate("navigator.clipboard.readText()")
    assert main(shlex.split(command)[1:]) == 0
    made = load_result(folder.parent / "scene_result")
    assert np.array_equal(made.labels, session._bench.work.results["robust"].labels)

    page.get_by_role("tab", name="Export").click()
    page.locator("textarea:visible").fill("<b>mine</b>\nand more")
    session._panels.export._kind.value = "report (one web page to send)"
    wait_until(lambda: "and more" in session._panels.notes.read())
    with page.expect_download() as download:
        page.get_by_role("button", name="Download").click()
    told = Path(download.value.path()).read_text()
    assert download.value.suggested_filename == "scene_report.html"
    assert "&lt;b&gt;mine&lt;/b&gt;<br>and more" in told
    assert "--exclude 6" in told


def test_memory_is_given_back_when_a_tab_rests_and_after_it_is_closed(
    page: Any, open_app: OpenApp, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[str] = []
    for module in ("app", "pace"):
        monkeypatch.setattr(f"webapp.{module}.LULL", 0.5)
        monkeypatch.setattr(f"webapp.{module}.give_back", lambda by=module: given.append(by))
    session = enter(page, open_app(folder))
    wait_until(lambda: given[-1:] == ["pace"])
    page.wait_for_timeout(1500)
    rests = len(given)
    page.wait_for_timeout(1500)
    assert len(given) == rests  # once for each rest
    press(page, "ArrowRight")
    wait_until(lambda: session._read().image == 1)
    wait_until(lambda: len(given) > rests)
    assert "app" not in given
    page.close()
    wait_until(lambda: given[-1] == "app")


def test_background_work_rests_while_a_tab_draws(
    page: Any, open_app: OpenApp, folder: Path
) -> None:
    session = enter(page, open_app(folder))
    draw, rounds, goes_on = session._panels.draw, [], []

    def watched(frame: Frame) -> None:
        waiter = Thread(target=lambda: (give_way(), goes_on.append(len(rounds))), daemon=True)
        waiter.start()
        waiter.join(0.1)
        rounds.append(waiter.is_alive())
        draw(frame)

    session._panels.draw = watched
    press(page, "ArrowRight")
    wait_until(lambda: bool(rounds))
    assert all(rounds)  # whoever gives way was still waiting
    wait_until(lambda: bool(goes_on))
