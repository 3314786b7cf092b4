"""The habits of the page in a real browser: keys, hint, theme, patterns, typing, tooltips."""

import io
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from browser import (
    choose,
    click_pixel,
    colours_on_screen,
    open_canvas,
    place_of,
    press,
    wait_for_colours,
    wait_for_keys,
    wait_until,
    widget,
)
from PIL import Image

from photolin.analysis import Options
from photolin.factors import Thresholds
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp import work
from webapp.app import App
from webapp.keys import KEYS
from webapp.render import encode_labels, render_input
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


def enter(page: Any, app: App, *, hint: bool = False) -> Session:
    """Open a tab; only labels follow T."""
    page.set_viewport_size({"width": 880, "height": 560})  # software GL is slow
    before = set(app._sessions)
    open_canvas(page, app.server.url, hint=hint)
    page.add_style_tag(content="* { box-shadow: none !important }")
    wait_until(lambda: len(set(app._sessions) - before) == 1)
    (number,) = set(app._sessions) - before
    session = app._sessions[number]
    wait_until(lambda: session._frame is not None)
    session._panels.thresholds._live.value = False
    return session


def box_of(page: Any, slider: Any) -> Any:
    """The field beside a slider."""
    return widget(page, slider).locator("xpath=..").locator("input:not([type=hidden])")


def overlap(one: dict[str, float], other: dict[str, float]) -> bool:
    return (
        one["x"] < other["x"] + other["width"]
        and other["x"] < one["x"] + one["width"]
        and one["y"] < other["y"] + other["height"]
        and other["y"] < one["y"] + one["height"]
    )


# --- keys and hint ---


def test_the_list_of_keys_holds_them_all_and_is_closed_by_its_key_by_escape_and_by_a_click(
    page: Any, app: App
) -> None:
    session = enter(page, app)
    stopped: list[bool] = []
    session._panels._keys["escape"] = lambda: stopped.append(True)
    keys = page.locator(".photolin-keys")
    assert keys.is_hidden()
    press(page, "?")
    keys.wait_for(state="visible")
    shown = keys.inner_text()
    assert all(key.shown in shown and key.does in shown for key in KEYS)
    press(page, "?")
    keys.wait_for(state="hidden")
    press(page, "?", "Escape")
    keys.wait_for(state="hidden")
    press(page, "?")
    keys.click(position={"x": 20, "y": 20})
    keys.wait_for(state="hidden")
    assert session._pointing.pixel is None  # the click was for the list
    assert stopped == []
    press(page, "Escape")
    wait_until(lambda: stopped == [True])


def test_the_picture_is_in_use_around_the_list_of_keys(page: Any, app: App) -> None:
    session = enter(page, app)
    page.set_viewport_size({"width": 1000, "height": 900})
    press(page, "?")
    card = page.locator(".photolin-keys").bounding_box()
    _, y = place_of(page, 2.5, 30.5)
    assert y < card["y"]
    click_pixel(page, 2, 30)
    wait_until(lambda: session._pointing.pixel == (2, 30))
    press(page, "ArrowRight")
    wait_until(lambda: session._read().image == 1)
    assert page.locator(".photolin-keys").is_visible()


def test_the_hint_is_shown_until_it_is_dismissed_and_then_stays_away(page: Any, app: App) -> None:
    enter(page, app, hint=True)
    hint = page.locator(".photolin-hint")
    hint.wait_for(state="visible")
    page.reload()
    hint.wait_for(state="visible")  # nobody has dismissed it
    hint.get_by_role("button").click()
    hint.wait_for(state="hidden")
    enter(page, app, hint=True)
    assert hint.is_hidden()
    press(page, "h")
    hint.wait_for(state="visible")
    press(page, "h")
    hint.wait_for(state="hidden")


def test_a_key_dismisses_the_hint_for_good_too(page: Any, app: App) -> None:
    enter(page, app, hint=True)
    page.locator(".photolin-hint").wait_for(state="visible")
    press(page, "h")
    page.locator(".photolin-hint").wait_for(state="hidden")
    enter(page, app, hint=True)
    assert page.locator(".photolin-hint").is_hidden()


@pytest.mark.parametrize("size", [(1280, 720), (700, 420)])
def test_the_hint_lets_clicks_through_and_leaves_the_readout_free(
    page: Any, app: App, size: tuple[int, int]
) -> None:
    session = enter(page, app, hint=True)
    page.set_viewport_size({"width": size[0], "height": size[1]})
    hint, readout = page.locator(".photolin-hint"), page.locator(".photolin-readout")
    hint.wait_for(state="visible")
    row = next(
        row
        for row in range(47, 0, -1)
        if place_of(page, row + 0.5, 32.5)[1] < hint.bounding_box()["y"] + 20
    )
    click_pixel(page, row, 32)  # under the hint
    wait_until(lambda: session._pointing.pixel == (row, 32))
    wait_until(lambda: readout.inner_text().startswith("row "))
    assert not overlap(hint.bounding_box(), readout.bounding_box())


# --- theme and patterns ---


def brightness(page: Any, element: str, what: str) -> float:
    """Mean of red, green and blue of a computed colour."""
    found = page.evaluate(f"getComputedStyle(document.querySelector('{element}')).{what}")
    return float(np.mean([float(n) for n in found.strip("rgba()").split(",")[:3]]))


def test_the_theme_turns_panel_plots_and_cards_and_leaves_the_picture(page: Any, app: App) -> None:
    session = enter(page, app)
    click_pixel(page, 20, 30)
    page.locator("svg[role=img]").wait_for()
    press(page, "?", "?")
    before = colours_on_screen(page, (48, 64)).astype(int)
    parts = (("body", "backgroundColor"), ("svg[role=img]", "fill"), (".photolin-keys", "color"))

    def levels() -> tuple[bool, ...]:
        return tuple(brightness(page, *part) > 127 for part in parts)

    assert levels() == (False, True, True)
    session._panels.legend._theme.value = "light"
    wait_until(lambda: levels() == (True, False, False))
    wait_until(lambda: session._read().theme == "light")
    after = colours_on_screen(page, (48, 64)).astype(int)
    assert abs(after - before).max() <= 1
    session._panels.legend._theme.value = "dark"
    wait_until(lambda: levels() == (False, True, True))


def test_patterns_lie_over_the_picture_and_in_the_legend(page: Any, app: App) -> None:
    session = enter(page, app)
    swatch = page.locator("img[alt='']").first
    plain = swatch.get_attribute("src")
    widget(page, session._panels.legend._patterns).click()
    wait_for_keys(page)
    png = encode_labels(RESULT.labels[0], patterns=True)
    overlay = np.asarray(Image.open(io.BytesIO(png)).convert("RGBA"))
    alpha = overlay[..., 3:] / 255
    gain = session._read().gain or 1.0
    below = render_input(STACK.images[0], gain)[..., None]
    wait_for_colours(page, np.rint(alpha * overlay[..., :3] + (1 - alpha) * below), tolerance=1)
    swatches = page.locator("img[alt='']").evaluate_all("all => all.map(one => one.src)")
    assert len(set(swatches)) == 5
    assert swatches[0] == plain  # diffuse has none


# --- typing ---


@pytest.mark.parametrize(
    ("text", "expected"), [("0.5", 0.5), ("0.123456", 0.123456), ("1", 1.0), ("0.03", 0.03)]
)
def test_T_is_taken_as_typed_even_beyond_its_slider(
    page: Any, app: App, text: str, expected: float
) -> None:
    session = enter(page, app)
    field = box_of(page, session._panels.thresholds._T)
    field.fill(text)
    field.press("Tab")  # at once, before the slider can have been widened
    wait_until(lambda: pytest.approx(expected, abs=1e-12) == session._read().T)
    page.wait_for_timeout(300)
    assert float(field.input_value()) == expected
    assert pytest.approx(expected, abs=1e-12) == session._read().T


def test_Ts_is_taken_as_typed_up_to_just_below_1_and_a_reset_narrows_the_slider(
    page: Any, app: App
) -> None:
    session = enter(page, app)
    Ts = session._panels.thresholds._Ts
    field = box_of(page, Ts)
    field.fill("0.9999")
    field.press("Tab")
    wait_until(lambda: session._read().Ts == pytest.approx(0.9999))
    wait_until(lambda: session._panels.thresholds._history.now.Ts == pytest.approx(0.9999))
    session._panels.thresholds.reset()
    wait_until(lambda: session._read().thresholds == Thresholds(0.05, 0.02))
    assert Ts.max == 0.2


@pytest.mark.parametrize("value", ["7", "-1", "1e300", "-1e300", "null", "'0.5'", "[0.5]", "true"])
def test_hostile_values_leave_T_and_Ts_within_what_they_can_be(
    page: Any, app: App, value: str
) -> None:
    session = enter(page, app)
    view = session._panels.thresholds
    for slider in (view._T, view._Ts):
        page.evaluate(
            f"""window.__viserMutable.sendMessage({{type: "GuiUpdateMessage",
            uuid: "{widget_id(slider)}", updates: {{value: {value}}}}})"""
        )
        page.wait_for_timeout(70)
    press(page, "ArrowRight")  # messages before it have been handled then
    wait_until(lambda: session._read().image == 1)
    low = value.startswith("-")
    assert session._read().thresholds == (Thresholds(0.0005, 0) if low else RESULT.thresholds)
    assert (view._T.max, view._Ts.max) == (0.2, 0.2)


# --- tooltips ---


def test_every_control_has_a_tooltip(page: Any, app: App) -> None:
    session = enter(page, app)
    handles = session._client.gui._gui_input_handle_from_uuid.values()
    silent = [handle.label for handle in handles if handle.visible and not handle.hint]
    assert len(handles) > 30
    assert silent == []


def test_a_tooltip_lies_beside_the_panel_and_takes_no_click(page: Any, app: App) -> None:
    session = enter(page, app)
    row = widget(page, session._panels.thresholds._Ts)
    row.hover()
    tip = page.get_by_role("tooltip")
    tip.wait_for(state="visible")
    box, canvas = tip.bounding_box(), page.locator("canvas").first.bounding_box()
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= canvas["x"] + canvas["width"]
    assert tip.evaluate("tip => getComputedStyle(tip).pointerEvents") == "none"
    page.mouse.down()  # who moves the slider looks at the picture
    page.mouse.up()
    tip.wait_for(state="hidden")
    page.wait_for_timeout(800)  # longer than viser waits before it shows one
    assert tip.is_hidden()
    widget(page, session._panels.picture._layer).hover()
    tip.wait_for(state="visible")


def test_a_button_says_what_it_does_whenever_its_tab_is_opened(page: Any, app: App) -> None:
    enter(page, app)
    for _ in range(2):
        page.get_by_role("tab", name="Shape").click()
        button = page.get_by_role("button", name="Recover shape")
        button.hover()
        wait_until(lambda b=button: "key: N" in (b.get_attribute("title") or ""))
        page.get_by_role("tab", name="Tune").click()


# --- what takes long ---


def test_an_export_shows_its_progress_beside_its_button_and_can_be_cancelled(
    page: Any, app: App, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = enter(page, app)
    going, waiting = session._bench.work, []

    def pack(*given: Any) -> tuple[str, bytes]:
        waiting.append(given)
        while not going._job.stopping():
            time.sleep(0.02)
        return "late.zip", b"late"

    sent: list[str] = []
    session._bench.work._desk = replace(
        session._bench.work._desk, send=lambda name, data: sent.append(name)
    )
    monkeypatch.setattr(work, "make_download", pack)
    page.get_by_role("tab", name="Export").click()
    page.get_by_role("button", name="Download").click()
    wait_until(lambda: len(waiting) == 1)
    page.get_by_text("writing files").filter(visible=True).wait_for()
    page.get_by_role("button", name="Cancel").filter(visible=True).click()
    page.get_by_text("export cancelled; nothing was saved").wait_for()
    page.get_by_role("button", name="Cancel").filter(visible=True).wait_for(state="detached")
    assert sent == []


def test_all_is_seen_together_on_a_small_and_legible_on_a_huge_screen(page: Any, app: App) -> None:
    session = enter(page, app)
    click_pixel(page, 30, 20)
    plot = page.locator("svg[role=img]")
    plot.wait_for()
    views = session._panels.picture._image, *(s for s, _ in session._panels.thresholds.typed)
    letters = {}
    for width, height in ((1280, 720), (3840, 2160)):
        page.set_viewport_size({"width": width, "height": height})
        size = "parseFloat(getComputedStyle(document.documentElement).fontSize)"
        letters[width] = page.evaluate(size)
        boxes = [one.bounding_box() for one in (*(widget(page, v) for v in views), plot)]
        assert all(0 < box["y"] < height - box["height"] for box in boxes)
    assert letters[3840] > letters[1280]


def test_a_list_that_chooses_the_theme_is_in_the_display(page: Any, app: App) -> None:
    session = enter(page, app)
    choose(page, session._panels.legend._theme, "light")
    wait_until(lambda: session._read().theme == "light")
