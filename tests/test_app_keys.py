"""Keys as they come from real keyboards, and the clipboard, in a real browser."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browser import open_canvas, press, wait_until

from photolin.analysis import Options
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp.app import App
from webapp.session import Session
from webapp.source import Source
from webapp.values import MAX_TEXT
from webapp.viser_internals import widget_id

pytestmark = [
    pytest.mark.browser,
    # a tab may close while its worker draws
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

STACK = render_scene("sphere_cone", size=(48, 64), images=10).stack
RESULT = analyze(STACK, Options(T=0.05, Ts=0.02, samples=50))


SEND = "(options) => document.body.dispatchEvent(new KeyboardEvent('keydown', options))"


@pytest.fixture
def app(tmp_path: Path) -> Iterator[App]:
    opened = App(Source(STACK, RESULT, RESULT.options, path=tmp_path), port=0)
    yield opened
    opened.stop()


def enter(page: Any, app: App) -> Session:
    """Open a tab; only labels follow T."""
    page.set_viewport_size({"width": 880, "height": 560})  # software GL is slow
    open_canvas(page, app.server.url)
    wait_until(lambda: len(app._sessions) == 1)
    (session,) = app._sessions.values()
    wait_until(lambda: session._frame is not None)
    session._panels.thresholds._live.value = False
    return session


def threshold(session: Session) -> float:
    return session._read().T


def test_a_key_that_is_held_steps_through_images_but_leaves_out_one(page: Any, app: App) -> None:
    session = enter(page, app)
    for key in ("ArrowRight", "K", "k"):
        for _ in range(4):
            page.keyboard.down(key)
            page.wait_for_timeout(150)
        page.keyboard.up(key)
    wait_until(lambda: session._bench.runs.excluded != ())
    page.wait_for_timeout(300)
    assert session._excluded == (4,)


def test_brackets_that_take_AltGr_are_brackets_and_chords_are_none(page: Any, app: App) -> None:
    session = enter(page, app)
    first = threshold(session)
    chord = {"key": "]", "ctrlKey": True, "altKey": True, "bubbles": True}
    page.evaluate(SEND, chord)
    page.wait_for_timeout(300)
    assert threshold(session) == first
    page.evaluate(SEND, chord | {"modifierAltGraph": True})
    wait_until(lambda: threshold(session) > first)


def test_the_command_is_copied_where_a_page_has_no_clipboard_of_its_own(
    page: Any, app: App
) -> None:
    # as in a page of another machine, which comes without TLS
    page.add_init_script("Object.defineProperty(navigator, 'clipboard', { value: undefined })")
    session = enter(page, app)
    press(page, "c")
    page.get_by_text("Copied", exact=True).wait_for()
    press(page, "ArrowRight")  # keys go to the picture again
    wait_until(lambda: session._read().image == 1)
    page.get_by_role("tab", name="Export").click()
    page.locator("textarea:visible").click()
    page.keyboard.press("Control+V")
    wait_until(lambda: session._panels.notes.read().startswith("photolin run "))


def test_notes_end_in_the_page_where_they_end_in_the_session(page: Any, app: App) -> None:
    session = enter(page, app)
    page.get_by_role("tab", name="Export").click()
    page.locator("textarea:visible").click()
    page.keyboard.insert_text("a" * (MAX_TEXT - 1))
    page.keyboard.insert_text("bcd")
    wait_until(lambda: session._panels.notes.read() == "a" * (MAX_TEXT - 1) + "b")
    assert page.locator("textarea:visible").input_value() == session._panels.notes.read()


def test_keys_are_found_by_their_place_on_keyboards_without_latin_letters(
    page: Any, app: App
) -> None:
    """As on a Greek or Russian one, where the key P says π or з."""
    session = enter(page, app)
    first = threshold(session)
    page.evaluate(SEND, {"key": "ъ", "code": "BracketRight", "bubbles": True})
    wait_until(lambda: threshold(session) > first)
    page.evaluate(SEND, {"key": "я", "code": "KeyZ", "bubbles": True})
    wait_until(lambda: threshold(session) == first)
    page.evaluate(SEND, {"key": "Я", "code": "KeyZ", "shiftKey": True, "bubbles": True})
    wait_until(lambda: threshold(session) > first)
    # a Latin letter is what it says, wherever it lies: Z is where the US have Y
    page.evaluate(SEND, {"key": "z", "code": "KeyY", "bubbles": True})
    wait_until(lambda: threshold(session) == first)
    page.evaluate(SEND, {"key": "؟", "code": "Slash", "shiftKey": True, "bubbles": True})
    page.get_by_text("undo, redo a change of T or Ts").first.wait_for()  # the list of keys


def test_what_AltGr_types_is_no_key_of_the_tool(page: Any, app: App) -> None:
    session = enter(page, app)
    first = threshold(session)
    press(page, "]")
    wait_until(lambda: threshold(session) > first)
    second = threshold(session)
    # € at E, say; Z would undo
    euro = {"key": "€", "code": "KeyZ", "modifierAltGraph": True, "bubbles": True}
    page.evaluate(SEND, euro)
    press(page, "]")  # keys are taken in turn
    wait_until(lambda: threshold(session) > second)


def test_ctrl_z_undoes_T_and_not_what_was_typed_in_a_box(page: Any, app: App) -> None:
    session = enter(page, app)
    view, first = session._panels.thresholds, threshold(session)
    box = page.locator(f"[id='{widget_id(view._T)}']").locator("xpath=..").locator("[type=text]")
    box.fill("0.09")
    wait_until(lambda: threshold(session) == 0.09)
    page.keyboard.press("Control+z")  # in the box it is the browser's own
    wait_until(lambda: threshold(session) != 0.09)
    box.fill("0.09")
    wait_until(lambda: threshold(session) == 0.09 and view._history.now.T == 0.09)
    box.blur()
    page.keyboard.press("Control+z")
    wait_until(lambda: threshold(session) != 0.09)
    page.keyboard.press("Control+y")
    wait_until(lambda: threshold(session) == 0.09)
    page.keyboard.press("Control+z")
    wait_until(lambda: threshold(session) != 0.09)
    page.keyboard.press("Control+Shift+Z")
    wait_until(lambda: threshold(session) == 0.09)
    assert page.evaluate("document.activeElement === document.body")
    for _ in range(3):
        page.keyboard.press("Control+z")
    wait_until(lambda: threshold(session) == first)
