"""The tab Lights as a person meets it, in a real browser."""

from collections.abc import Iterator
from typing import Any

import pytest
from browser import choose, open_canvas, press, wait_for_keys, wait_until

from photolin.analysis import Options
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp.app import App
from webapp.session import Session
from webapp.source import Source

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


def enter(page: Any, app: App) -> Session:
    """Open a tab of the browser at the tab Lights; only labels follow T."""
    page.set_viewport_size({"width": 880, "height": 700})
    open_canvas(page, app.server.url)
    wait_until(lambda: len(app._sessions) == 1)
    (session,) = app._sessions.values()
    wait_until(lambda: session._frame is not None)
    session._panels.thresholds._live.value = False
    page.get_by_role("tab", name="Lights").click()
    wait_for_keys(page)
    page.get_by_text("of 2000 candidates within T").wait_for(timeout=60_000)
    return session


def test_a_drag_turns_the_cube_and_leaves_the_picture_alone(page: Any, app: App) -> None:
    session = enter(page, app)
    view, before = session._panels.cloud, session._panels.cloud._html.content
    start = view._turn.value, view._tilt.value
    cube = page.locator("#photolin-cloud-cube")
    cube.scroll_into_view_if_needed()
    box = cube.bounding_box()
    place = page.evaluate("JSON.stringify(window.photolin.similarity())")
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 0.25 * box["width"], y + 0.2 * box["height"], steps=8)
    page.mouse.up()
    wait_until(lambda: abs(view._turn.value - (start[0] - 60)) <= 1)
    wait_until(lambda: abs(view._tilt.value - (start[1] + 36)) <= 1)
    wait_until(lambda: view._html.content != before)
    assert page.evaluate("JSON.stringify(window.photolin.similarity())") == place
    assert session._pointing.pixel is None


def test_the_cloud_follows_the_image_and_what_it_is_solved_from(page: Any, app: App) -> None:
    session = enter(page, app)
    page.get_by_text("Image 0", exact=False).first.wait_for()
    press(page, "ArrowRight")
    wait_until(lambda: session._read().image == 1)
    page.get_by_text("Image 1", exact=False).first.wait_for()
    choose(page, session._panels.cloud._source, "linearized bases")
    page.get_by_text("(D + A + C - U)").wait_for()
    choose(page, session._panels.cloud._count, "500")
    page.get_by_text("of 500 candidates").wait_for()
    page.get_by_text("Coefficients of all 8 images; image 1 is ringed").wait_for()
