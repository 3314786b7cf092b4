"""Sampling as a person does it, in a real browser: rectangles, clicks, undo, T and Ts set."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from browser import (
    click_pixel,
    go_to,
    open_canvas,
    place_of,
    press,
    similarity,
    wait_for_keys,
    wait_until,
)

from photolin.analysis import Options
from photolin.factors import Factor
from photolin.pipeline import analyze
from photolin.residuals import measure_residuals
from photolin.shadow_level import sample_shadow_level
from photolin.synthetic import render_scene
from webapp.app import App
from webapp.box import Box
from webapp.session import Session
from webapp.source import Source

pytestmark = [
    pytest.mark.browser,
    # a tab may close while its worker draws
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

SCENE = render_scene("sphere_cone", size=(48, 64), images=8, noise=0.01, bits=8)
STACK, TRUE = SCENE.stack, SCENE.truth.labels
RESULT = analyze(STACK, Options(T=0.05, Ts=0.05, samples=50))


@pytest.fixture
def app() -> Iterator[App]:
    opened = App(Source(STACK, RESULT, RESULT.options), port=0)
    yield opened
    opened.stop()


def enter(page: Any, app: App) -> Session:
    """Open a tab of the browser at the tab Samples; only labels follow T."""
    page.set_viewport_size({"width": 880, "height": 620})  # software GL is slow
    open_canvas(page, app.server.url)
    wait_until(lambda: len(app._sessions) == 1)
    (session,) = app._sessions.values()
    wait_until(lambda: session._frame is not None)
    session._panels.thresholds._live.value = False
    go_to(page, "Samples")
    wait_until(lambda: session._panels.samples._shown)
    return session


def push(page: Any, row: str, name: str) -> None:
    """A button of a row of buttons."""
    label = page.get_by_text(row, exact=True)
    label.locator("xpath=ancestor::*[.//button][1]").get_by_text(name, exact=True).click()
    wait_for_keys(page)


def wait_for_cursor(page: Any, cursor: str) -> None:
    page.wait_for_function(f"window.__viserMutable.canvas.style.cursor === '{cursor}'")


def drag(page: Any, box: Box) -> None:
    page.mouse.move(*place_of(page, box.row0 + 0.5, box.column0 + 0.5))
    page.mouse.down()
    page.mouse.move(*place_of(page, box.row1 - 0.5, box.column1 - 0.5), steps=3)
    page.mouse.up()


def find_box(wanted: np.ndarray, side: int) -> Box:
    """A square of `side` pixels that are all wanted, (H,W) bool."""
    windows = np.lib.stride_tricks.sliding_window_view(wanted, (side, side))
    row, column = np.argwhere(windows.all(axis=(2, 3)))[0].tolist()
    return Box(row, row + side, column, column + side)


DARK = np.isin(TRUE, (Factor.ATTACHED, Factor.CAST))
SHADOW, LIT = find_box(DARK[0], 4), find_box(TRUE[0] == Factor.DIFFUSE, 7)


def part(box: Box, image: int = 0) -> np.ndarray:
    return STACK.images[image, box.row0 : box.row1, box.column0 : box.column1].ravel()


def test_a_rectangle_on_a_shadow_sets_Ts_between_true_shadows_and_true_light(
    page: Any, app: App
) -> None:
    session = enter(page, app)
    view = session._panels.samples
    push(page, "Shadows", "sample")
    wait_for_cursor(page, "crosshair")
    before = similarity(page)
    drag(page, SHADOW)
    page.get_by_text("Shadows: 16 pixels in 1 sample").wait_for()
    assert similarity(page) == pytest.approx(before, abs=1e-6)
    push(page, "Lit pixels", "sample")
    page.get_by_text("Drag or click over lit pixels").wait_for()
    row, column = LIT.row0 + 3, LIT.column0 + 3
    click_pixel(page, row, column)
    page.get_by_text("Lit pixels: 25 pixels in 1 sample").wait_for()
    clicked = Box(row - 2, row + 3, column - 2, column + 3)
    assert [sample.box for sample in view._samples] == [SHADOW, clicked]
    expected = sample_shadow_level(part(SHADOW), part(clicked)).Ts
    assert (STACK.images[DARK] < expected).mean() > 0.9
    assert (STACK.images[TRUE == Factor.DIFFUSE] < expected).mean() < 0.05
    assert page.locator(".photolin-box").count() == 2
    first = session._read().thresholds
    page.get_by_role("button", name=f"Set Ts to {expected:.4f}").click()
    wait_until(lambda: session._read().Ts == pytest.approx(expected))
    wait_until(lambda: session._panels.thresholds._history.now.Ts == pytest.approx(expected))
    wait_for_keys(page)
    press(page, "z")
    wait_until(lambda: session._read().thresholds == first)
    press(page, "Shift+Z")
    wait_until(lambda: session._read().Ts == pytest.approx(expected))
    assert session._pointing.pixel is None  # these clicks select nothing


def test_samples_are_undone_and_cleared_kind_by_kind(page: Any, app: App) -> None:
    session = enter(page, app)
    view = session._panels.samples
    for row, box in (("Shadows", SHADOW), ("Lit pixels", LIT)):
        push(page, row, "sample")
        wait_for_cursor(page, "crosshair")
        for count in (1, 2):
            drag(page, box)
            own = "shadow" if row == "Shadows" else "lit"
            wait_until(lambda o=own, n=count: [s.kind for s in view._samples].count(o) == n)
    page.get_by_text("Lit pixels: 98 pixels in 2 samples").wait_for()
    push(page, "Shadows", "undo")
    page.get_by_text("Shadows: 16 pixels in 1 sample").wait_for()
    assert [s.kind for s in view._samples] == ["shadow", "lit", "lit"]
    push(page, "Lit pixels", "clear")
    page.get_by_text("Lit pixels: none").wait_for()
    wait_until(lambda: page.locator(".photolin-box").count() == 1)
    press(page, "ArrowRight")  # another image: no outline there
    wait_until(lambda: page.locator(".photolin-box").count() == 0)
    press(page, "ArrowLeft")
    wait_until(lambda: page.locator(".photolin-box").count() == 1)
    push(page, "Shadows", "undo")
    page.get_by_text("Shadows: none").wait_for()
    assert view._samples == ()


def test_a_drag_pans_and_a_click_selects_unless_samples_are_taken_in_view(
    page: Any, app: App
) -> None:
    session = enter(page, app)

    def pan() -> None:
        scale, left, top = similarity(page)
        page.mouse.move(150, 300)
        page.mouse.down()
        page.mouse.move(180, 320, steps=3)
        page.mouse.up()
        assert similarity(page) == pytest.approx((scale, left + 30, top + 20), abs=0.5)

    pan()
    push(page, "Shadows", "sample")
    wait_for_cursor(page, "crosshair")
    drag(page, SHADOW)
    page.get_by_text("Shadows: 16 pixels in 1 sample").wait_for()
    go_to(page, "Tune")
    wait_for_cursor(page, "")
    wait_until(lambda: page.locator(".photolin-box").count() == 0)
    pan()
    go_to(page, "Samples")
    wait_for_cursor(page, "crosshair")
    press(page, "Escape")
    wait_for_cursor(page, "")
    pan()
    click_pixel(page, 20, 20)
    wait_until(lambda: session._pointing.pixel == (20, 20))
    assert len(session._panels.samples._samples) == 1


def test_T_is_set_from_the_residuals_with_the_share_that_passes(page: Any, app: App) -> None:
    session = enter(page, app)
    found = measure_residuals(STACK, RESULT, 0.05)
    name = f"Set T to {found.T:.4f} ({found.passed(found.T):.1%} passed)"
    button = page.get_by_role("button", name=name)
    button.wait_for()
    button.click()
    wait_until(lambda: pytest.approx(found.T) == session._read().T)
    assert session._read().Ts == pytest.approx(0.05)
