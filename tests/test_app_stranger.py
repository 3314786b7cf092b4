"""In a real browser: the whole task of somebody who has never seen the tool, by mouse and keys."""

import shlex
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import choose, click_pixel, go_to, open_canvas, press, wait_until

from photolin.cli import main
from photolin.factors import Factor
from photolin.synthetic import render_scene, write_scene
from webapp.app import App
from webapp.keeper import NAME
from webapp.session import Session
from webapp.source import Source

pytestmark = [
    pytest.mark.browser,
    # a tab may close while its worker draws
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

SCENE = render_scene("sphere_cone", size=(60, 80), images=10)
BAD = 6
"""The image that is a copy of the one before."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    images = SCENE.stack.images.copy()
    images[BAD] = images[BAD - 1]
    write_scene(replace(SCENE, stack=replace(SCENE.stack, images=images)), tmp_path / "scene")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "scene"


Inspect = Callable[[Path], App]


@pytest.fixture
def inspect(monkeypatch: pytest.MonkeyPatch) -> Iterator[Inspect]:
    """`photolin inspect PATH`, up to where it would open a browser and wait."""
    apps: list[App] = []

    def serve(source: Source, **_: object) -> None:
        apps.append(App(source, port=0))

    monkeypatch.setattr("webapp.app.serve", serve)

    def open_one(path: Path) -> App:
        assert main(["inspect", str(path)]) == 0
        return apps[-1]

    yield open_one
    for app in apps:
        app.stop()


def enter(page: Any, app: App) -> Session:
    page.set_viewport_size({"width": 1280, "height": 720})
    open_canvas(page, app.server.url)
    page.add_style_tag(content="* { box-shadow: none !important }")
    wait_until(lambda: len(app._sessions) == 1)
    (session,) = app._sessions.values()
    wait_until(lambda: session._frame is not None and session._frame.analysis is not None, 60)
    return session


def settled(session: Session) -> bool:
    """Whether a run by T and Ts as they stand is on screen."""
    frame, work = session._frame, session._bench.work
    result = work.results.get("robust")
    now = session._read().thresholds
    return (
        result is not None
        and result.thresholds == now
        and frame is not None
        and (frame.preview is None and frame.analysis is result)
    )


def suggest(page: Any, session: Session) -> None:
    press(page, "]", "]", "]")
    moved = session._read().thresholds
    press(page, "s")
    wait_until(lambda: session._read().thresholds != moved and settled(session), 60)


def adjust_on_the_landscape(page: Any, session: Session) -> None:
    suggested = session._read().thresholds
    go_to(page, "Map")
    place = page.locator("#photolin-landscape")
    place.wait_for(timeout=60_000)
    box = place.bounding_box()
    page.mouse.click(box["x"] + 0.4 * box["width"], box["y"] + 0.5 * box["height"])
    wait_until(lambda: session._read().thresholds != suggested and settled(session), 60)


def diagnose_three_pixels(page: Any, session: Session) -> None:
    go_to(page, "Pixel")
    labels = session._bench.work.results["robust"].labels[:, 20:]
    for n, factor in enumerate((Factor.SPECULAR, Factor.CAST, Factor.DIFFUSE)):
        row, column = np.argwhere((labels == factor).any(axis=0))[3 + 40 * n] + (20, 0)
        click_pixel(page, int(row), int(column))
        wait_until(lambda at=(row, column): session._pointing.pixel == at)
        told = page.get_by_text(f"row {row}, column {column}").locator("visible=true")
        told.first.wait_for()
        press(page, "p")
    wait_until(lambda: len(session._read().pins) == 3)


def compare_methods(page: Any, session: Session) -> None:
    go_to(page, "Compare")
    compare = session._panels.compare
    choose(page, compare._against, "labels")
    choose(page, session._panels.pixel._twin, "statistical")
    choose(page, compare._arrangement, "side by side")
    wait_until(lambda: "statistical" in session._bench.work.results, 60)
    wait_until(lambda: session._frame is not None and session._frame.beside is not None)
    choose(page, compare._against, "nothing")


def leave_the_copy_out(page: Any, session: Session) -> None:
    """As the overview advises."""
    go_to(page, "Overview")
    page.locator(f"[data-part=image-{BAD}] .photolin-badge").first.wait_for(timeout=60_000)
    page.locator(f"[data-part=toggle-{BAD}]").click()
    wait_until(lambda: session._bench.runs.excluded == (BAD,) and settled(session), 60)


def export_masks(page: Any, session: Session) -> dict[str, bytes]:
    go_to(page, "Export")
    choose(page, session._panels.export._images, "all images")
    with page.expect_download() as started:
        page.get_by_role("button", name="Download").click()
    with zipfile.ZipFile(started.value.path()) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def copy_command(page: Any) -> list[str]:
    press(page, "c")
    page.get_by_text("Copied", exact=True).wait_for()
    return shlex.split(page.evaluate("navigator.clipboard.readText()"))


def test_a_stranger_gets_masks_that_the_copied_command_makes_again(
    page: Any, inspect: Inspect, folder: Path
) -> None:
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    session = enter(page, inspect(folder))
    suggest(page, session)
    adjust_on_the_landscape(page, session)
    diagnose_three_pixels(page, session)
    compare_methods(page, session)
    leave_the_copy_out(page, session)
    exported = export_masks(page, session)
    command = copy_command(page)
    page.locator("textarea:visible").fill("image 6 was taken twice")
    wait_until(lambda: (folder / NAME).exists() and "taken twice" in (folder / NAME).read_text())
    before = session._read()

    again = enter(page, inspect(folder))
    wait_until(lambda: again._read() == before and settled(again), 60)
    assert again._panels.notes.read() == "image 6 was taken twice"
    assert again._bench.runs.excluded == (BAD,)

    assert main(command[1:]) == 0
    masks = folder.parent / "masks"
    assert main(["export", command[3], str(masks), "--what", "masks"]) == 0
    assert len(exported) == 5 * 9
    assert exported == {path.name: path.read_bytes() for path in masks.iterdir()}
