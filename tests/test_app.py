"""The inspector as a person meets it: acts in a real browser, effects read off the screen."""

import gc
import io
import threading
import time
import weakref
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import tifffile
from browser import (
    choose,
    click_pixel,
    colours_on_screen,
    open_canvas,
    place_of,
    press,
    wait_for_colours,
    wait_for_keys,
    wait_for_text,
    wait_until,
    widget,
)
from lambert import lambertian
from PIL import Image
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from photolin.analysis import METHODS, Analysis, Cancel, Options, Progress
from photolin.errors import Cancelled, DegenerateError
from photolin.export import load_result
from photolin.factors import LETTERS, PALETTE, TITLES, Factor, Thresholds
from photolin.label import label_images
from photolin.pipeline import analyze
from photolin.stack import ImageStack
from photolin.synthetic import render_scene
from webapp import runs
from webapp.app import App
from webapp.readout import legend
from webapp.render import encode_labels, render_input
from webapp.session import Session
from webapp.source import Source
from webapp.viser_internals import SUBPROTOCOL, widget_id

pytestmark = [
    pytest.mark.browser,
    # a tab may close while its worker draws
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

STACK = render_scene("sphere_cone", size=(48, 64), images=8).stack
OPTIONS = Options(T=0.05, Ts=0.02, samples=50)
RESULT = analyze(STACK, OPTIONS)
SHAPE = (48, 64)
DRAG = 5.0
"""Seconds that T is dragged for."""


# --- what is expected on screen ---


def labels_at(session: Session, result: Analysis = RESULT) -> np.ndarray:
    """The backend's labels (H,W) of the image and thresholds that a tab's widgets show."""
    state = session._read()
    labels = label_images(
        STACK.images, result.linearized_bases, result.coefficients, STACK.mask, state.thresholds
    )
    return labels[state.image]


def painted(labels: np.ndarray) -> np.ndarray:
    """(H,W,3): each label in its colour of the palette."""
    colours = np.zeros((256, 3), np.uint8)
    for factor, colour in PALETTE.items():
        colours[factor] = colour
    return colours[labels]


def blended(base: np.ndarray, labels: np.ndarray, **look: Any) -> np.ndarray:
    """(H,W,3): the overlay of the labels on a picture (H,W) or (H,W,3)."""
    overlay = np.asarray(Image.open(io.BytesIO(encode_labels(labels, **look))).convert("RGBA"))
    alpha = overlay[..., 3:] / 255
    below = base[..., None] if base.ndim == 2 else base
    return np.rint(alpha * overlay[..., :3] + (1 - alpha) * below)


def picture(image: int, gain: float = 1.0) -> np.ndarray:
    return render_input(STACK.images[image], gain)


# --- a tab and its widgets ---


def enter(page: Any, app: App, *, live: bool = False) -> Session:
    """Open a tab; its session, once it has drawn. Without `live`, only labels follow T."""
    page.set_viewport_size({"width": 880, "height": 560})  # software GL is slow
    before = set(app._sessions)
    open_canvas(page, app.server.url)
    # the panel's shadow falls on the last column
    page.add_style_tag(content="* { box-shadow: none !important }")
    wait_until(lambda: len(set(app._sessions) - before) == 1)
    (number,) = set(app._sessions) - before
    session = app._sessions[number]
    wait_until(lambda: session._frame is not None)
    session._panels.thresholds._live.value = live
    wait_until(lambda: session._frame is not None and session._frame.state.live == live)
    return session


def caught_up(session: Session) -> bool:
    """Whether the latest run is by T and Ts as the sliders stand."""
    return session._bench.work.results["robust"].thresholds == session._read().thresholds


def thumb(page: Any, handle: Any) -> Any:
    return widget(page, handle).get_by_role("slider")


def number(page: Any, handle: Any) -> float:
    """What the number field beside a slider shows."""
    row = widget(page, handle).locator("xpath=..")
    return float(row.locator("input:not([type=hidden])").input_value())


def leave_widgets(page: Any) -> None:
    """Give the keyboard back to the canvas."""
    page.evaluate("document.activeElement.blur()")


def wait_for_part(page: Any, expected: np.ndarray, where: np.ndarray, tolerance: int = 0) -> None:
    """Wait until the pixels `where`, (H,W) or (H,), show `expected`, (H,W,3)."""
    end = time.monotonic() + 10
    while True:
        shown = colours_on_screen(page, expected.shape[:2]).astype(int)
        worst = np.abs(shown - expected)[where].max()
        if worst <= tolerance:
            return
        assert time.monotonic() < end, f"colours differ by up to {worst}"
        time.sleep(0.1)


def away_from(row: int, rows: int = 48) -> np.ndarray:
    """(H,): rows that the ring round a pixel of `row` does not cover."""
    return np.abs(np.arange(rows) - row) > 2


def dismiss_notes(page: Any) -> None:
    for note in page.locator(".mantine-Notification-root").all():
        note.get_by_role("button").click()
        note.wait_for(state="detached")


def shares(labels: np.ndarray) -> list[str]:
    return [f"{row.letter} {row.percent:.1f} %" for row in legend(labels)]


@pytest.fixture
def app() -> Iterator[App]:
    opened = App(Source(STACK, RESULT, OPTIONS), port=0)
    yield opened
    opened.stop()


OpenApp = Callable[..., App]


@pytest.fixture
def open_app() -> Iterator[OpenApp]:
    apps: list[App] = []

    def open_one(
        stack: ImageStack = STACK, result: Analysis | None = None, options: Options = OPTIONS
    ) -> App:
        apps.append(App(Source(stack, result, options), port=0))
        return apps[-1]

    yield open_one
    for opened in apps:
        opened.stop()


class Gate:
    """`analyze`, held up in the middle until it is released or cancelled."""

    def __init__(self) -> None:
        self.began: list[Options] = []
        self.cancelled = 0
        self.release = threading.Event()

    def __call__(
        self, stack: ImageStack, options: Options, *, progress: Progress, cancel: Cancel
    ) -> Analysis:
        self.began.append(options)
        progress("coefficients", 0.5)
        while not self.release.wait(0.02):
            if cancel():
                self.cancelled += 1
                raise Cancelled("coefficients was cancelled")
        return analyze(stack, options, progress=progress, cancel=cancel)


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[Gate]:
    held = Gate()
    monkeypatch.setattr(runs, "analyze", held)
    yield held
    held.release.set()


# --- thresholds ---


def test_labels_on_screen_follow_T_moved_by_keyboard(page: Any, app: App) -> None:
    session = enter(page, app)
    T = session._panels.thresholds._T
    wait_for_colours(page, blended(picture(0), RESULT.labels[0]), tolerance=1)

    thumb(page, T).focus()
    press(page, *["ArrowLeft"] * 6)
    wait_until(lambda: T.value == pytest.approx(0.047))
    wait_for_colours(page, blended(picture(0), labels_at(session)), tolerance=1)

    leave_widgets(page)
    press(page, *"[" * 12)
    wait_until(lambda: T.value < 0.02)
    few = labels_at(session)
    assert np.count_nonzero(few != RESULT.labels[0]) > 20
    wait_for_colours(page, blended(picture(0), few), tolerance=1)
    press(page, "]", "}", "}", "{", "ArrowUp", "ArrowUp")  # round to the label map
    wait_until(lambda: session._read().layer == "labels")
    wait_for_colours(page, painted(labels_at(session)))
    assert number(page, T) == pytest.approx(T.value, abs=1e-9)


def test_after_dragging_T_the_last_value_wins_everywhere(page: Any, app: App) -> None:
    session = enter(page, app)
    T = session._panels.thresholds._T
    click_pixel(page, 30, 20)
    wait_until(lambda: session._pointing.pixel == (30, 20))
    press(page, "ArrowUp", "ArrowUp")
    track = widget(page, T).bounding_box()
    middle = track["y"] + thumb(page, T).bounding_box()["height"] / 2
    knob = thumb(page, T).bounding_box()
    page.mouse.move(knob["x"] + knob["width"] / 2, knob["y"] + knob["height"] / 2)
    page.mouse.down()
    seen: set[float] = set()
    end, step = time.monotonic() + DRAG, 0
    while time.monotonic() < end:
        step += 1
        page.mouse.move(track["x"] + track["width"] * abs(step % 20 - 10) / 10, middle)
        seen.add(T.value)
    page.mouse.move(track["x"] + track["width"] * 0.1, middle)
    page.mouse.up()
    assert len(seen) > 3

    wait_until(lambda: number(page, T) == pytest.approx(T.value, abs=1e-9))
    assert 0.01 < T.value < 0.03
    final = labels_at(session)
    expected, away = painted(final), away_from(30)
    wait_for_part(page, expected, away)
    for text in shares(final):
        assert page.get_by_text(text, exact=True).count() == 1
    page.wait_for_timeout(400)
    assert np.array_equal(colours_on_screen(page, SHAPE)[away], expected[away])
    line = page.locator("svg[role=img] line").nth(4)  # l = (1 + T) i, from i = Ts to the border
    x1, y1, x2, y2 = (float(line.get_attribute(name)) for name in ("x1", "y1", "x2", "y2"))
    assert (y1 - y2) / (x2 - x1) == pytest.approx(1 + T.value, abs=1e-3)


def test_the_linearization_follows_T_and_ends_in_that_of_a_run(page: Any, app: App) -> None:
    session = enter(page, app, live=True)
    wait_for_text(page, "final, linearized in")
    for keys in ("[" * 9, "}" * 3):
        press(page, *keys)
        state = session._read()
        wait_until(lambda: caught_up(session))
        state = session._read()
        expected = analyze(STACK, replace(OPTIONS, T=state.T, Ts=state.Ts))
        assert np.array_equal(session._bench.work.results["robust"].labels, expected.labels)
        wait_for_colours(page, blended(picture(0), expected.labels[0]), tolerance=1)
        wait_for_text(page, f"T {state.T:.4f}, Ts {state.Ts:.4f}: final")


def test_a_preview_is_shown_and_called_one_until_the_run_is_there(
    page: Any, open_app: OpenApp, gate: Gate
) -> None:
    session = enter(page, open_app(result=RESULT), live=True)
    press(page, *"[" * 9)
    wait_for_text(page, "preview")
    wait_until(lambda: len(gate.began) > 0)
    frame = session._frame
    assert frame is not None and frame.preview is not None and frame.labels is not None
    assert frame.preview.analysis.thresholds == session._read().thresholds
    assert not np.array_equal(frame.labels, labels_at(session))  # other bases, not other T alone
    wait_for_colours(page, blended(picture(0), frame.labels), tolerance=1)
    press(page, "]")  # newer thresholds stop the run for older ones
    wait_until(lambda: gate.cancelled == 1)
    gate.release.set()
    wait_for_text(page, "final, linearized in")


def test_files_are_of_a_run_even_while_a_preview_is_shown(
    page: Any, open_app: OpenApp, gate: Gate
) -> None:
    session = enter(page, open_app(result=RESULT), live=True)
    press(page, *"[" * 9)
    wait_for_text(page, "preview")
    page.get_by_role("tab", name="Export").click()
    gate.release.set()
    _, data = save(page, session, "label maps (indexed PNG, zip)", "all images")
    state = session._read()
    expected = analyze(STACK, replace(OPTIONS, T=state.T, Ts=state.Ts))
    assert np.array_equal(np.stack(unzip(data)), expected.labels)


def test_dragging_T_for_five_seconds_shows_linearizations_and_ends_in_the_last(
    page: Any, open_app: OpenApp, capsys: pytest.CaptureFixture[str]
) -> None:
    """24 images of 512 x 512. How many a second is up to the machine, and said, not asserted."""
    stack = render_scene("sphere_cone", size=(512, 512), images=24).stack
    first = analyze(stack)
    app = open_app(stack, result=first)
    session = enter(page, app, live=True)
    shown: list[tuple[float, Thresholds, bytes]] = []
    draw = session._canvas.set_overlay

    def record(encoded: bytes | None) -> None:
        if encoded is not None:
            shown.append((time.monotonic(), session._frame.state.thresholds, encoded))
        draw(encoded)

    session._canvas.set_overlay = record
    T = session._panels.thresholds._T
    track, knob = widget(page, T).bounding_box(), thumb(page, T).bounding_box()
    middle = knob["y"] + knob["height"] / 2
    page.mouse.move(knob["x"] + knob["width"] / 2, middle)
    page.mouse.down()
    end, step = time.monotonic() + DRAG, 0
    while time.monotonic() < end:
        step += 1
        page.mouse.move(track["x"] + track["width"] * (0.1 + abs(step % 40 - 20) / 40), middle)
        page.wait_for_timeout(20)
    page.mouse.up()
    times = np.array([when for when, _, _ in shown])
    distinct = len({encoded for _, _, encoded in shown})
    wait_until(lambda: caught_up(session), 30)
    last = session._read().thresholds
    expected = analyze(stack, replace(OPTIONS, T=last.T, Ts=last.Ts))
    found = session._bench.work.results["robust"]
    assert np.array_equal(found.labels, expected.labels)
    assert np.array_equal(found.linearized_bases, expected.linearized_bases, equal_nan=True)
    wait_until(lambda: shown[-1][2] == encode_labels(expected.labels[0]))
    assert distinct >= 3
    stall = np.diff(times).max()
    with capsys.disabled():
        print(f"\n{distinct / DRAG:.1f} pictures a second, longest stall {stall:.2f} s")


def test_suggested_thresholds_reach_sliders_and_screen(page: Any, app: App) -> None:
    session = enter(page, app)
    page.get_by_role("button", name="suggest T, Ts").click()
    suggested = analyze(STACK, Options(samples=50)).thresholds
    wait_until(lambda: session._read().thresholds == suggested)
    wait_for_colours(page, blended(picture(0), labels_at(session)), tolerance=1)
    assert number(page, session._panels.thresholds._T) == suggested.T


def test_thresholds_beyond_the_sliders_widen_them(page: Any, open_app: OpenApp) -> None:
    wide = replace(RESULT, thresholds=Thresholds(0.6, 0.0))
    session = enter(page, open_app(result=wide))
    assert session._read().thresholds == Thresholds(0.6, 0.0)
    assert number(page, session._panels.thresholds._T) == 0.6
    thumb(page, session._panels.thresholds._T).focus()
    press(page, "ArrowLeft")
    wait_until(lambda: abs(session._read().T - 0.5995) < 1e-9)


# --- the pixel ---


def test_a_click_tells_why_and_the_scatter_follows_T(page: Any, app: App) -> None:
    session = enter(page, app)
    wait_for_text(page, "Click a pixel to see why it is labelled as it is.")
    higher = label_images(
        STACK.images,
        RESULT.linearized_bases,
        RESULT.coefficients,
        STACK.mask,
        Thresholds(0.05, 0.05),
    )
    changed = np.count_nonzero(higher != RESULT.labels, axis=0)
    assert changed.max() > 0
    picked = divmod(int(changed.argmax()), SHAPE[1])
    click_pixel(page, *picked)
    wait_for_text(page, f"Pixel (row {picked[0]}, column {picked[1]})")
    dots = page.locator("svg[role=img] svg g > title")
    assert dots.count() == 8
    page.wait_for_selector(".photolin-marker")

    def titles() -> list[str]:
        return [text.split(", ")[-1] for text in dots.all_text_contents()]

    def expected() -> list[str]:
        state = session._read()
        column = label_images(
            STACK.images,
            RESULT.linearized_bases,
            RESULT.coefficients,
            STACK.mask,
            state.thresholds,
        )[:, picked[0], picked[1]]
        names = {factor: factor.name.lower() for factor in Factor}
        names |= {Factor.ATTACHED: "attached shadow", Factor.CAST: "cast shadow"}
        order = [k for k in range(8) if k != state.image] + [state.image]
        return [names[Factor(int(column[k]))] for k in order]

    assert titles() == expected()
    before = expected()
    press(page, *"}" * 12)
    wait_until(lambda: titles() == expected())
    assert expected() != before
    press(page, "ArrowRight")
    wait_until(lambda: session._read().image == 1 and titles() == expected())
    wait_for_text(page, "Image 1: i ")


# --- picture, layers, classes ---


def test_images_and_layers_are_the_stack_and_the_backend(page: Any, app: App) -> None:
    session = enter(page, app)
    view, legend_view = session._panels.picture, session._panels.legend
    page.get_by_role("button", name="previous").click()
    wait_until(lambda: view._image.value == 7)
    wait_for_colours(page, blended(picture(7), RESULT.labels[7]), tolerance=1)
    page.get_by_role("button", name="next").click()
    wait_until(lambda: number(page, view._image) == 0)
    thumb(page, view._image).focus()
    press(page, "ArrowRight", "ArrowRight")
    wait_until(lambda: view._image.value == 2)
    wait_for_colours(page, blended(picture(2), RESULT.labels[2]), tolerance=1)

    thumb(page, legend_view._opacity).focus()
    press(page, "Home")
    wait_until(lambda: legend_view._opacity.value == 0)
    wait_for_colours(page, np.repeat(picture(2)[..., None], 3, axis=2))

    choose(page, view._layer, "linearized")
    l = RESULT.linearized(2)
    steady = np.abs(l) < 2e-3  # less than half a step of grey
    assert steady.any()
    wait_for_part(page, np.full((*SHAPE, 3), 128), steady)
    shown = colours_on_screen(page, SHAPE)[..., 0].astype(int)
    bright, dark = l > 0.02, l < -0.02
    assert dark.any()
    assert (shown[bright] > 128).all()
    assert (shown[dark] < 128).all()

    choose(page, view._layer, "residual")
    residual = STACK.images[2] - l
    exact = np.abs(residual) < 1e-5
    assert exact.any()
    wait_for_part(page, np.full((*SHAPE, 3), 255), exact)
    red, _, blue = np.moveaxis(colours_on_screen(page, SHAPE).astype(int), 2, 0)
    assert (red > blue)[residual > 0.05].all()

    thumb(page, legend_view._gain).focus()
    choose(page, view._layer, "input")
    thumb(page, legend_view._gain).focus()
    press(page, "ArrowRight", "ArrowRight")
    gain = legend_view._gain
    wait_until(lambda: gain.value == pytest.approx(session._panels.legend._first_gain + 0.2))
    wait_for_colours(page, np.repeat(picture(2, gain.value)[..., None], 3, axis=2))


def test_classes_are_switched_and_outlined(page: Any, app: App) -> None:
    session = enter(page, app)
    press(page, "4", "ArrowUp", "ArrowUp")
    shown = frozenset(Factor) - {Factor.CAST}
    wait_until(lambda: session._read().shown == shown)
    cast = RESULT.labels[0] == Factor.CAST
    assert cast.any()
    below = np.repeat(picture(0)[..., None], 3, axis=2)
    expected = np.where(cast[..., None], below, painted(RESULT.labels[0]))
    wait_for_colours(page, expected)
    press(page, "4", "ArrowDown", "ArrowDown")
    widget(page, session._panels.legend._switches[Factor.SPECULAR]).click()
    widget(page, session._panels.legend._outlines).click()
    look = {"shown": frozenset(Factor) - {Factor.SPECULAR}, "outlines": True}
    wait_for_colours(page, blended(picture(0), RESULT.labels[0], **look), tolerance=1)


def test_what_is_used_together_is_seen_together_in_a_small_window(page: Any, app: App) -> None:
    session = enter(page, app)
    click_pixel(page, 30, 20)
    page.locator("svg[role=img]").wait_for()
    page.set_viewport_size({"width": 1280, "height": 720})
    views = session._panels.picture, session._panels.thresholds, session._panels.thresholds
    for view, name in zip(views, ("_image", "_T", "_Ts"), strict=True):
        box = widget(page, getattr(view, name)).bounding_box()
        assert 0 < box["y"] < 720 - box["height"]
    box = page.locator("svg[role=img]").first.bounding_box()
    assert box["width"] > 200
    assert 0 < box["y"] < 720 - box["height"]


def test_the_scroll_bar_covers_no_widget(page: Any, app: App) -> None:
    session = enter(page, app)
    page.set_viewport_size({"width": 1280, "height": 720})
    bar = page.locator(".mantine-ScrollArea-scrollbar[data-orientation=vertical]")
    bar = bar.filter(visible=True)
    bar.wait_for()
    left = bar.bounding_box()["x"]
    for handle in (
        session._panels.picture._layer,
        session._panels.run._method,
        session._panels.pixel._beside,
    ):
        box = widget(page, handle).bounding_box()
        assert box["x"] + box["width"] <= left


# --- keys ---


def test_keys_reach_the_picture_after_any_use_of_the_pointer(page: Any, app: App) -> None:
    session = enter(page, app)
    page.set_viewport_size({"width": 1280, "height": 900})
    view, legend_view = session._panels.picture, session._panels.legend

    def use_switch() -> None:
        widget(page, legend_view._switches[Factor.UNDEFINED]).click()

    for count, use in enumerate(
        (
            lambda: page.get_by_role("tab", name="Tune").click(),
            lambda: page.get_by_role("button", name="fit").click(),
            lambda: choose(page, view._layer, "labels"),
            use_switch,
            use_switch,
            lambda: thumb(page, legend_view._opacity).click(),
            lambda: click_pixel(page, 30, 20),
        ),
        1,
    ):
        use()
        wait_for_keys(page)
        press(page, "ArrowRight")
        wait_until(lambda count=count: view._image.value == count)
    wait_for_part(page, painted(RESULT.labels[7]), away_from(30))
    page.get_by_role("tab", name="Tune").click()
    wait_for_keys(page)
    page.keyboard.down(" ")
    wait_for_part(page, np.repeat(picture(7)[..., None], 3, axis=2), away_from(30))
    page.keyboard.up(" ")
    wait_for_part(page, painted(RESULT.labels[7]), away_from(30))


def test_a_list_has_the_keys_while_it_is_open_and_the_picture_afterwards(
    page: Any, app: App
) -> None:
    session = enter(page, app)
    layer, image = session._panels.picture._layer, session._panels.picture._image
    for end in ("Enter", "Escape"):
        before = image.value
        widget(page, layer).click()
        option = page.get_by_role("option", name="residual", exact=True)
        option.wait_for()
        press(page, "m", "ArrowRight")  # typed into the list's own search
        assert session._read().method == "robust"
        assert image.value == before
        press(page, "Backspace", "ArrowDown", end)
        option.wait_for(state="hidden")
        chosen = layer.value
        press(page, "ArrowUp")
        wait_until(lambda: layer.value != chosen)  # noqa: B023
        assert not option.is_visible()
        press(page, "ArrowRight")
        wait_until(lambda: image.value == before + 1)  # noqa: B023


def test_a_number_being_typed_has_its_keys_and_tab_goes_from_widget_to_widget(
    page: Any, app: App
) -> None:
    session = enter(page, app)
    T = session._panels.thresholds._T
    field = widget(page, T).locator("xpath=..").locator("input:not([type=hidden])")
    field.click()
    press(page, "Home", "ArrowRight", "1")
    page.wait_for_timeout(200)
    assert session._panels.picture._image.value == 0
    assert session._read().shown == frozenset(Factor)
    field.fill("0.03")
    wait_until(lambda: T.value == 0.03)
    thumb(page, T).focus()
    press(page, "Tab", "Tab")
    assert thumb(page, session._panels.thresholds._Ts).evaluate("e => e === document.activeElement")
    press(page, "ArrowRight")  # reached by keyboard, the slider has its arrows
    wait_until(lambda: session._panels.thresholds._Ts.value > 0.02)
    assert session._panels.picture._image.value == 0


# --- tabs ---


def count_threads() -> int:
    """All but the timer that gives memory back some seconds after a tab was closed."""
    return sum(not isinstance(thread, threading.Timer) for thread in threading.enumerate())


def test_two_tabs_share_nothing_and_a_closed_one_is_freed(page: Any, app: App) -> None:
    first = enter(page, app)
    press(page, "ArrowUp", "ArrowUp")
    wait_for_colours(page, painted(RESULT.labels[0]))
    other = page.context.new_page()
    gone = change_everything(other, app)
    state = first._read()
    untouched = (state.T, state.image, state.layer, state.shown, state.pixel)
    assert untouched == (0.05, 0, "labels", frozenset(Factor), None)
    assert np.array_equal(colours_on_screen(page, SHAPE), painted(RESULT.labels[0]))
    assert page.locator(".photolin-marker").count() == 0

    threads = count_threads()
    other.close()
    wait_until(lambda: len(app._sessions) == 1)
    wait_until(lambda: is_freed(gone))
    assert count_threads() < threads

    gone = weakref.ref(first)
    del first, state
    again = enter(page, app)  # the same tab, loaded again, as the last one was left
    wait_until(lambda: is_freed(gone))
    T = again._read().T
    assert T < 0.05
    press(page, "]")
    wait_until(lambda: again._read().T > T)


def change_everything(page: Any, app: App) -> weakref.ref[Session]:
    session = enter(page, app)
    press(page, *"[[[[[[", "ArrowRight", "ArrowUp", "2")
    click_pixel(page, 5, 6)
    wait_until(lambda: session._read().image == 1 and session._pointing.pixel == (5, 6))
    assert session._read().T < 0.05
    return weakref.ref(session)


def is_freed(gone: weakref.ref[Session]) -> bool:
    gc.collect()
    return gone() is None


def test_closing_a_tab_ends_its_run(page: Any, open_app: OpenApp, gate: Gate) -> None:
    app = open_app()
    other = page.context.new_page()
    enter(other, app)
    wait_until(lambda: len(gate.began) == 1)
    other.close()
    wait_until(lambda: gate.cancelled == 1)
    wait_until(lambda: app._sessions == {})
    wait_until(lambda: all(t.name not in ("tab", "job") for t in threading.enumerate()))


def test_hostile_values_change_no_other_tab(page: Any, app: App) -> None:
    session = enter(page, app)
    press(page, "ArrowUp", "ArrowUp")
    expected = painted(RESULT.labels[0])
    wait_for_colours(page, expected)
    T = session._panels.thresholds._T
    origin = app.server.url.rstrip("/")
    with connect(
        origin.replace("http", "ws"),
        origin=Origin(origin),
        subprotocols=[Subprotocol(SUBPROTOCOL)],
        max_size=None,
    ) as socket:
        for value in (float("nan"), 1e300, -1e300, "0.1", None, [0.1], {"T": 1}, True, 0.1):
            updates = {
                "type": "GuiUpdateMessage",
                "uuid": widget_id(T),
                "updates": {"value": value},
            }
            socket.send(msgspec.msgpack.encode(updates))
        wipe = {"type": "GuiUpdateMessage", "uuid": widget_id(T), "updates": {"update_cb": []}}
        socket.send(msgspec.msgpack.encode(wipe))
        page.wait_for_timeout(300)
    assert session._read().T == 0.05
    assert np.array_equal(colours_on_screen(page, SHAPE), expected)
    press(page, "]")
    wait_for_colours(page, painted(labels_at(session)))


# --- runs ---


def test_the_first_picture_is_there_before_anything_is_computed(
    page: Any, open_app: OpenApp, gate: Gate
) -> None:
    session = enter(page, open_app(options=Options(samples=50)))
    wait_for_colours(page, np.repeat(picture(0)[..., None], 3, axis=2))
    wait_for_text(page, "Nothing is linearized yet.")
    wait_for_text(page, "coefficients")
    assert page.get_by_role("button", name="Cancel").is_visible()
    gate.release.set()
    result = analyze(STACK, Options(samples=50))
    wait_until(lambda: session._read().thresholds == result.thresholds)
    wait_for_colours(page, blended(picture(0), result.labels[0]), tolerance=1)
    page.get_by_role("button", name="Cancel").wait_for(state="hidden")


def test_linearizing_again_can_be_cancelled_and_says_what_the_bases_belong_to(
    page: Any, open_app: OpenApp, gate: Gate
) -> None:
    session = enter(page, open_app(result=RESULT))
    wait_for_text(page, "T 0.0500, Ts 0.0200: final")
    press(page, *"]" * 8)
    wait_until(lambda: session._read().T > 0.09)
    T = session._read().T
    wait_for_text(page, f"Labels: T {T:.4f}, Ts 0.0200. Linearized bases: T 0.0500, Ts 0.0200;")

    page.get_by_role("button", name="linearize again").click()
    wait_until(lambda: len(gate.began) == 1)
    page.get_by_role("button", name="linearize again").click()
    wait_for_text(page, "Still running")
    press(page, "e", "s")
    page.get_by_role("button", name="Cancel").click()
    wait_for_text(page, "linearization cancelled; the earlier result is kept")
    assert page.get_by_text("coefficients was cancelled").count() == 0
    assert session._bench.work.results == {"robust": RESULT}
    wait_for_colours(page, blended(picture(0), labels_at(session)), tolerance=1)

    gate.release.set()
    leave_widgets(page)
    press(page, "r")
    wait_for_text(page, f"T {T:.4f}, Ts 0.0200: final")
    expected = replace(OPTIONS, T=T, Ts=0.02)
    assert gate.began == [expected, expected]
    result = analyze(STACK, expected)
    wait_for_colours(page, blended(picture(0), result.labels[0]), tolerance=1)


def test_methods_are_computed_once_and_kept_even_if_asked_for_while_one_runs(
    page: Any, open_app: OpenApp, gate: Gate
) -> None:
    session = enter(page, open_app(result=RESULT))
    click_pixel(page, 30, 20)
    press(page, "m")
    wait_until(lambda: len(gate.began) == 1)
    press(page, "m")
    wait_until(lambda: session._read().method == "statistical")
    assert [options.method for options in gate.began] == ["classification"]
    gate.release.set()
    wait_until(lambda: set(session._bench.work.results) == set(METHODS))
    statistical = session._bench.work.results["statistical"]
    expected = blended(picture(0), labels_at(session, statistical))
    wait_for_part(page, expected, away_from(30), tolerance=1)

    plots = page.locator("svg[role=img]")
    assert plots.count() == 1
    choose(page, session._panels.pixel._beside, "robust")
    wait_until(lambda: plots.count() == 2)
    assert [plots.nth(k).locator("text").first.text_content() for k in (0, 1)] == [
        "statistical",
        "robust",
    ]
    choose(page, session._panels.run._method, "robust")  # beside itself: one plot
    wait_until(lambda: plots.count() == 1)
    assert len(gate.began) == 2


def test_two_methods_are_compared_in_percentages_plots_and_sentences(
    page: Any, open_app: OpenApp
) -> None:
    session = enter(page, open_app(result=RESULT))
    choose(page, session._panels.pixel._beside, "statistical")
    wait_for_text(page, "Click a pixel to see why robust and statistical label it as they do.")
    wait_until(lambda: "statistical" in session._bench.work.results)
    other = session._bench.work.results["statistical"]
    here, there = labels_at(session), labels_at(session, other)
    differing = np.argwhere((here != there) & STACK.mask)
    assert len(differing)
    row, column = map(int, differing[len(differing) // 2])
    click_pixel(page, row, column)
    wait_for_text(page, "robust, image 0: i ")
    panel = " ".join(page.inner_text("body").split())
    for shown in (here, there):
        assert " ".join(shares(shown)) in panel
        assert panel.count(" ".join(shares(shown))) == 1
    first, second = panel.split("robust, image 0: i ")[1].split("statistical, image 0: i ")
    for sentence, shown in ((first, here), (second, there)):
        assert f": {TITLES[Factor(int(shown[row, column]))]}" in sentence.split("Pixel (")[0]


def test_a_first_run_that_is_cancelled_says_how_to_go_on(
    page: Any, open_app: OpenApp, gate: Gate
) -> None:
    session = enter(page, open_app())
    wait_until(lambda: len(gate.began) == 1)
    click_pixel(page, 30, 20)
    wait_for_text(page, "There is no result by robust yet")
    press(page, "Escape")
    wait_for_text(page, "linearization cancelled; linearize again starts anew")
    assert session._bench.work.results == {}
    gate.release.set()
    page.get_by_role("button", name="linearize again").click()
    wait_until(lambda: "robust" in session._bench.work.results)


# --- exports ---


def save(page: Any, session: Session, kind: str, images: str) -> tuple[str, bytes]:
    """Choose and press Download; the file's name and bytes."""
    choose(page, session._panels.export._kind, kind)
    if images:
        choose(page, session._panels.export._images, images)
    with page.expect_download() as started:
        page.get_by_role("button", name="Download", exact=True).click()
    with open(started.value.path(), "rb") as file:
        return started.value.suggested_filename, file.read()


def unzip(data: bytes) -> list[np.ndarray]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return [
            np.asarray(Image.open(io.BytesIO(archive.read(name)))) for name in archive.namelist()
        ]


def test_downloads_decode_to_what_the_screen_shows(page: Any, app: App, tmp_path: Path) -> None:
    session = enter(page, app)
    press(page, "ArrowRight", *"[[[[[[[[")
    wait_until(lambda: session._read().T < 0.025)
    state = session._read()
    labels = label_images(
        STACK.images, RESULT.linearized_bases, RESULT.coefficients, STACK.mask, state.thresholds
    )
    assert not np.array_equal(labels, RESULT.labels)
    page.get_by_role("tab", name="Export").click()

    name, data = save(page, session, "masks (PNG, zip)", "this image")
    assert name == "sphere_cone_001_masks.zip"
    for factor, mask in zip(LETTERS, unzip(data), strict=True):
        assert np.array_equal(mask == 255, labels[1] == factor)
    wait_for_text(page, "Received sphere_cone_001_masks.zip")

    name, data = save(page, session, "label maps (indexed PNG, zip)", "all images")
    assert name == "sphere_cone_all_labels.zip"
    assert np.array_equal(np.stack(unzip(data)), labels)

    name, data = save(page, session, "linearized (float32 TIFF)", "this image")
    pixels = tifffile.imread(io.BytesIO(data))
    assert pixels.dtype == np.float32
    assert np.array_equal(pixels, RESULT.linearized(1), equal_nan=True)
    assert np.nanmin(pixels) < 0

    name, data = save(page, session, "result (npz and json, zip)", "")
    assert name == "sphere_cone_result.zip"
    assert widget(page, session._panels.export._images).is_disabled()
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        archive.extractall(tmp_path)
    opened = load_result(tmp_path)
    assert np.array_equal(opened.labels, labels)
    assert np.array_equal(opened.linearized_bases, RESULT.linearized_bases, equal_nan=True)
    assert opened.thresholds == state.thresholds

    choose(page, session._panels.export._kind, "masks (PNG, zip)")
    wait_until(lambda: widget(page, session._panels.export._images).is_enabled())


# --- what goes wrong ---


def test_a_stack_without_solution_is_told_in_the_words_of_the_command_line(
    page: Any, open_app: OpenApp
) -> None:
    flat, _ = lambertian(8, (24, 32), flat=True)
    with pytest.raises(DegenerateError) as told:
        analyze(flat, OPTIONS)
    session = enter(page, open_app(flat))
    note = page.locator(".mantine-Notification-root", has_text="This did not work")
    note.wait_for()
    assert str(told.value) in note.inner_text()
    assert "Traceback" not in page.inner_text("body")
    press(page, "ArrowRight")
    click_pixel(page, 20, 28)
    wait_until(lambda: session._read().image == 1 and session._pointing.pixel == (20, 28))
    expected = np.repeat(render_input(flat.images[1], session._read().gain or 1)[..., None], 3, 2)
    dismiss_notes(page)
    wait_for_part(page, expected, away_from(20, rows=24))
    page.mouse.move(*place_of(page, 2.5, 3.5))
    wait_for_text(page, "row 2  column 3  i ")


def test_a_fault_of_the_program_is_told_and_the_tool_goes_on(
    page: Any, app: App, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    session = enter(page, app)

    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("gone wrong")

    for owner, name, key in (
        (session._panels.thresholds, "set", "s"),  # in the job
        (session._painter, "paint", "ArrowRight"),  # in the worker
        (session._client, "send_file_download", "e"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, fail)
            press(page, key)
            note = page.locator(".mantine-Notification-root", has_text="photolin made a mistake")
            note.wait_for()
            assert "RuntimeError: gone wrong" in note.inner_text()
            note.get_by_role("button").click()
            note.wait_for(state="detached")
    monkeypatch.setitem(session._panels._keys, "m", fail)  # in a callback
    press(page, "m")
    wait_for_text(page, "RuntimeError: gone wrong")
    assert capfd.readouterr().err.count("RuntimeError: gone wrong") == 4
    press(page, "ArrowRight")
    wait_until(lambda: session._read().image == 2)
    dismiss_notes(page)
    wait_for_colours(page, blended(picture(2), labels_at(session)), tolerance=1)
