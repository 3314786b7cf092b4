"""The panels beside Tune as a person meets them, in a real browser."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from browser import (
    click_pixel,
    go_to,
    open_canvas,
    press,
    wait_for_keys,
    wait_until,
)

from photolin.analysis import Options
from photolin.factors import Factor, Thresholds
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp.app import App
from webapp.frame import pixel_values
from webapp.pace import STEP
from webapp.session import Session
from webapp.source import Source
from webapp.viser_internals import widget_id

pytestmark = [
    pytest.mark.browser,
    # a tab may close while its worker draws
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

STACK = render_scene("sphere_cone", size=(48, 64), images=8).stack
RESULT = analyze(STACK, Options(T=0.05, Ts=0.02, samples=50))


@pytest.fixture
def app() -> Iterator[App]:
    opened = App(Source(STACK, RESULT, RESULT.options), port=0)
    yield opened
    opened.stop()


def enter(page: Any, app: App, tab: str) -> Session:
    """Open a tab of the browser at one of the tabs of the panel; only labels follow T."""
    page.set_viewport_size({"width": 880, "height": 560})  # software GL is slow
    open_canvas(page, app.server.url)
    page.add_style_tag(content="* { box-shadow: none !important }")
    wait_until(lambda: len(app._sessions) == 1)
    (session,) = app._sessions.values()
    wait_until(lambda: session._frame is not None)
    session._panels.thresholds._live.value = False
    go_to(page, tab)
    return session


def push(page: Any, name: str) -> None:
    page.locator("button:visible").get_by_text(name, exact=True).click()
    wait_for_keys(page)


def test_changes_of_T_are_undone_rest_by_rest_and_reset_can_be_undone(page: Any, app: App) -> None:
    session = enter(page, app, "Samples")
    first = session._read().thresholds
    seen = [first]
    for _ in range(2):
        press(page, "]")
        wait_until(lambda: session._read().thresholds not in seen)
        wait_until(lambda: session._panels.thresholds._history.now == session._read().thresholds)
        seen.append(session._read().thresholds)
    assert len(set(seen)) == 3
    press(page, "z")
    wait_until(lambda: session._read().thresholds == seen[1])
    press(page, "z")
    wait_until(lambda: session._read().thresholds == seen[0])
    press(page, "Shift+Z", "Shift+Z")
    wait_until(lambda: session._read().thresholds == seen[2])
    push(page, "reset")
    wait_until(lambda: session._read().thresholds == first)
    wait_until(lambda: session._panels.thresholds._history.now == first)
    press(page, "z")
    wait_until(lambda: session._read().thresholds == seen[2])
    push(page, "reset")
    press(page, "]")  # at once: a step of its own all the same
    wait_until(lambda: session._read().thresholds == seen[1])
    press(page, "z")
    wait_until(lambda: session._read().thresholds == first)


@pytest.mark.parametrize("focused", [False, True])
def test_a_slider_that_rests_while_it_is_dragged_makes_one_step(
    page: Any, app: App, focused: bool
) -> None:
    """Also where the focus goes over to it from a box beside another slider."""
    session = enter(page, app, "Tune")
    view, first = session._panels.thresholds, session._read().thresholds
    if focused:
        page.locator(f"[id='{widget_id(view._Ts)}']").locator("xpath=..").locator(
            "input[type=text]"
        ).focus()
    handle = page.locator(f"[id='{widget_id(view._T)}'] [role=slider]")
    box = handle.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    rests = []
    for x_now in (x + 15, x + 30):
        page.mouse.move(x_now, y, steps=3)
        wait_until(lambda: session._pace.rested(STEP) and session._read().thresholds not in rests)
        rests.append(session._read().thresholds)
    page.mouse.up()
    wait_until(lambda: view._history.now == rests[-1])
    assert len({first, *rests}) == 3
    press(page, "z")
    wait_until(lambda: session._read().thresholds == first)
    assert not view._history.past
    assert not view.settle(first, True)
    view.settle(rests[0], True)  # as the worker read it before the undo
    press(page, "Shift+Z")
    wait_until(lambda: session._read().thresholds == rests[-1])


SEND = """([type, options]) => document.querySelector(".mantine-Slider-root")
    .dispatchEvent(new PointerEvent(type, {bubbles: true, pointerId: 7, ...options}))"""


def test_a_slider_is_held_by_the_pointer_that_pressed_it_and_by_no_other(
    page: Any, app: App
) -> None:
    session = enter(page, app, "Tune")
    held = session._pointing

    def send(kind: str, **options: Any) -> None:
        page.evaluate(SEND, [kind, options])

    send("pointerdown", button=2, isPrimary=True)
    send("pointerdown", button=0, isPrimary=False, pointerId=8)
    seen = [session._read().T]
    press(page, "]")  # messages come in turn
    wait_until(lambda: session._read().T not in seen)
    assert not held.holding
    send("pointerdown", button=0, isPrimary=True)
    wait_until(lambda: held.holding)
    seen.append(session._read().T)
    send("pointerup", pointerId=8)
    send("pointermove", buttons=1)
    press(page, "]")
    wait_until(lambda: session._read().T not in seen)
    assert held.holding
    send("pointerup")
    wait_until(lambda: not held.holding)
    send("pointerdown", button=0, isPrimary=True)
    wait_until(lambda: held.holding)
    send("pointermove", buttons=0)  # let go of where the page was not told
    wait_until(lambda: not held.holding)


def test_a_pixel_is_told_in_all_images_beside_pinned_ones(page: Any, app: App) -> None:
    session = enter(page, app, "Pixel")
    specular = np.argwhere((RESULT.labels[1:] == Factor.SPECULAR).any(axis=0))
    row, column = specular[len(specular) // 2].tolist()
    click_pixel(page, 20, 30)
    wait_until(lambda: session._pointing.pixel == (20, 30))
    press(page, "p")
    click_pixel(page, row, column)
    now = session._pointing
    wait_until(lambda: now.pins == ((20, 30),) and now.pixel == (row, column))
    page.get_by_text(f"row {row}, column {column} (line)").wait_for()
    page.get_by_text("row 20, column 30 (dashes)").wait_for()
    assert page.locator("table tr:visible").count() == 9
    labels = pixel_values(STACK, RESULT, (row, column), session._read().thresholds).labels
    there = np.flatnonzero(labels == Factor.SPECULAR)
    expected = [*there[there > 0], there[0]][0]
    press(page, "x")
    wait_until(lambda: session._read().image == expected)
    press(page, "p", "p")
    wait_until(lambda: session._read().pins == ((20, 30),))
    push(page, "unpin all")
    wait_until(lambda: session._read().pins == ())


def test_a_panel_out_of_view_is_not_drawn_and_up_to_date_once_it_is_opened(
    page: Any, app: App
) -> None:
    session = enter(page, app, "Tune")
    before = session._panels.diagnosis._text.content
    click_pixel(page, 20, 30)
    wait_until(lambda: session._frame is not None and session._frame.state.pixel == (20, 30))
    press(page, "ArrowRight")
    wait_until(lambda: session._frame is not None and session._frame.state.image == 1)
    assert session._panels.diagnosis._text.content == before
    go_to(page, "Pixel")
    page.get_by_text("Pixel row 20, column 30.").wait_for()
    go_to(page, "Tune")
    wait_until(lambda: not session._panels.diagnosis._shown)


def test_a_click_on_the_map_moves_both_sliders(page: Any, app: App) -> None:
    session = enter(page, app, "Map")
    before = session._read().thresholds
    picture = page.locator("#photolin-landscape")
    picture.wait_for(timeout=60_000)
    box = picture.bounding_box()
    page.mouse.click(box["x"] + 0.7 * box["width"], box["y"] + 0.2 * box["height"])
    wait_until(lambda: session._read().thresholds != before)
    found = session._read().thresholds
    assert isinstance(found, Thresholds)
    assert found.T > before.T
    assert found.Ts > before.Ts
