"""Clicks on parts of the panel: what a text may say, and what a page reports."""

import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest
import viser
from browser import wait_until

from webapp.access import Server, open_server
from webapp.clicks import Choice, Click, Clicks, Drag, Sight, event_in_text


@pytest.mark.parametrize(
    ("text", "event"),
    [
        ("1 map 0.5000,0.2500", Click("map", 0.5, 0.25)),
        ("999999999 a-b 0.0,1.0000", Click("a-b", 0, 1)),
        ("2 map by -0.2500,1.0000", Drag("map", -0.25, 1)),
        ("7 map shown", Sight("map", True)),
        ("8 map hidden", Sight("map", False)),
        ("9 strip image-0", Choice("strip", "image", 0)),
        ("9 strip shown-000012", Choice("strip", "shown", 12)),
        ("9 a-b abcdefghijkl-999999", Choice("a-b", "abcdefghijkl", 999999)),
    ],
)
def test_an_event_is_read_as_the_page_writes_it(
    text: str, event: Click | Choice | Drag | Sight
) -> None:
    assert event_in_text(text) == event


@pytest.mark.parametrize(
    "text",
    [
        "",
        "map 0.5,0.5",
        "1 map",
        "1 map 0.5",
        "1 map 0.5,0.5,0.5",
        "1 map 1.5,0.5",
        "1 map 0.5,1.0001",
        "1 map -0.5,0.5",
        "1 map -0.0,0.5",
        "1 map nan,0.5",
        "1 map by 0.5",
        "1 map by -1.5,0.5",
        "1 map by 0.5,1.0001",
        "1 map by by 0.5,0.5",
        "1 map by --0.5,0.5",
        "1 map by 0.5,0.5\n",
        "1 map by nan,0.5",
        "1 map by shown",
        "1 map 1e0,0.5",
        "1 map 0.5,0.5\n",
        " 1 map 0.5,0.5",
        "1 Map 0.5,0.5",
        "1 <b> 0.5,0.5",
        "1 map shown hidden",
        "1 map seen",
        "1 strip image",
        "1 strip image-",
        "1 strip -3",
        "1 strip image--3",
        "1 strip image-1.5",
        "1 strip image-1000000",
        "1 strip image-٣",
        "1 strip Image-3",
        "1 strip abcdefghijklm-3",
        "1 strip image-3 image-4",
        "1 strip by image-3",
        "1 strip image-3\n",
        "1 strip <b>-3",
        "1 map 0.٣,0.5",
        "٣ map 0.5,0.5",
        "1 " + "m" * 41 + " shown",
        "1" * 10 + " map shown",
        "1 map 0." + "5" * 4000 + ",0.5",
        "9" * 4000,
    ],
)
def test_a_text_that_is_no_event_is_none(text: str) -> None:
    assert event_in_text(text) is None


# --- in a real browser ---

BOX = (
    '<div style="padding:7px"><svg width="200" height="100" viewBox="0 0 200 100">'
    '<g id="{}"><rect x="20" y="10" width="160" height="80" fill="#888"/></g></svg></div>'
)


@dataclass
class Stage:
    """A panel with one picture in a tab of its own, and what came of it."""

    server: Server
    html: Any = None
    clicks: list[tuple[float, float]] = field(default_factory=list)
    drags: list[tuple[float, float]] = field(default_factory=list)
    sights: list[bool] = field(default_factory=list)
    connected: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))

    def connect(self, client: viser.ClientHandle) -> None:
        clicks = Clicks(client)
        tabs = client.gui.add_tab_group()
        with tabs.add_tab("One"):
            client.gui.add_html("first")
        with tabs.add_tab("Two"):
            self.html = client.gui.add_html("")
        name = clicks.watch("map", lambda x, y: self.clicks.append((x, y)), self.sights.append)
        assert clicks.drag("map", lambda x, y: self.drags.append((x, y))) == name
        self.html.content = BOX.format(name)
        self.connected.release()


@pytest.fixture
def stage(page: Any) -> Iterator[Stage]:
    one = Stage(open_server(port=0))
    one.server.server.on_client_connect(one.connect)
    page.goto(one.server.url)
    assert one.connected.acquire(timeout=20)
    page.wait_for_function("window.photolinClicks !== undefined")
    yield one
    one.server.stop()


def press(page: Any, x: float, y: float) -> None:
    """Click at fractions of the picture's box."""
    box = page.locator("#photolin-map").bounding_box()
    page.mouse.click(box["x"] + x * box["width"], box["y"] + y * box["height"])


@pytest.mark.browser
@pytest.mark.filterwarnings("error")
def test_clicks_and_sights_are_told_also_after_the_content_was_replaced(
    page: Any, stage: Stage
) -> None:
    page.wait_for_timeout(500)
    assert stage.sights == []
    page.get_by_role("tab", name="Two").click()
    wait_until(lambda: stage.sights == [True])
    places = [(0.25, 0.75), (0.25, 0.75), (0.99, 0.02)]
    for count, place in enumerate(places, 1):
        press(page, *place)
        wait_until(lambda count=count: len(stage.clicks) == count)
        # another element with the id takes the first one's place
        stage.html.content = f"<p>{count}</p>{BOX.format('photolin-map')}"
        page.get_by_text(str(count), exact=True).wait_for()
    for found, place in zip(stage.clicks, places, strict=True):
        assert found == pytest.approx(place, abs=0.01)
    press(page, 0.5, 1.08)  # beside it, in the same drawing
    press(page, 0.5, 0.5)
    wait_until(lambda: len(stage.clicks) == 4)
    assert stage.clicks[3] == pytest.approx((0.5, 0.5), abs=0.01)
    page.get_by_role("tab", name="One").click()
    wait_until(lambda: stage.sights == [True, False])


@pytest.mark.browser
@pytest.mark.filterwarnings("error")
def test_steps_of_a_drag_add_up_to_the_way_of_the_pointer_also_beyond_the_element(
    page: Any, stage: Stage
) -> None:
    page.get_by_role("tab", name="Two").click()
    wait_until(lambda: stage.sights == [True])
    box = page.locator("#photolin-map").bounding_box()
    at = [(0.5, 0.5), (0.7, 0.4), (0.2, 0.9), (-0.1, 1.2)]
    places = [(box["x"] + x * box["width"], box["y"] + y * box["height"]) for x, y in at]
    page.mouse.move(*places[0])
    page.mouse.down()
    for count, place in enumerate(places[1:], 1):
        page.mouse.move(*place)
        page.wait_for_timeout(80)
        stage.html.content = f"<p>{count}</p>{BOX.format('photolin-map')}"
        page.get_by_text(str(count), exact=True).wait_for()
    page.mouse.up()
    page.mouse.move(*places[0])  # nothing is held any more

    def way() -> list[float]:
        return [sum(step[axis] for step in stage.drags) for axis in (0, 1)]

    wait_until(lambda: way() == pytest.approx([-0.6, 0.7], abs=0.01))
    assert len(stage.drags) >= 2
    press(page, 0.5, 0.5)
    wait_until(lambda: len(stage.clicks) == 1)
    assert way() == pytest.approx([-0.6, 0.7], abs=0.01)


@pytest.mark.browser
def test_a_tab_that_lost_its_connection_is_watched_again(page: Any, stage: Stage) -> None:
    stage.server.server._websock_server.disconnect_all_clients()
    assert stage.connected.acquire(timeout=20)
    page.get_by_role("tab", name="Two").click()
    wait_until(lambda: stage.sights[-1:] == [True])
    press(page, 0.5, 0.5)
    wait_until(lambda: len(stage.clicks) == 1)
    page.wait_for_timeout(200)
    assert len(stage.clicks) == 1


PARTS = (
    '<div id="{}"><div data-part="image-7" style="width:120px;height:60px"><span>seven</span>'
    '<b data-part="toggle-7">x</b></div><i>{}</i></div><p data-part="image-8">beside</p>'
)


@pytest.mark.browser
def test_the_innermost_part_that_is_clicked_is_told(page: Any) -> None:
    server, chosen, clicks = open_server(port=0), [], []

    def connect(client: viser.ClientHandle) -> None:
        html = client.gui.add_html("")
        name = Clicks(client).watch_parts(
            "strip", lambda part, number: chosen.append((part, number)), clicks.append
        )
        html.content = PARTS.format(name, "none")

    server.server.on_client_connect(connect)
    try:
        page.goto(server.url)
        expected: list[tuple[str, int]] = []
        for text, part in [
            ("seven", ("image", 7)),
            ("x", ("toggle", 7)),
            ("beside", None),
            ("none", None),
            ("seven", ("image", 7)),
        ]:
            page.get_by_text(text, exact=True).click()
            expected += [part] if part else []
            wait_until(lambda: chosen == expected)  # noqa: B023
        assert clicks == [True]
    finally:
        server.stop()
