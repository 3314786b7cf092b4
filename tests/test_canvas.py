"""The 2D canvas: what a click means, and what a person sees, in a real browser."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from importlib import resources
from typing import Any

import numpy as np
import pytest
import viser
from browser import (
    camera_rotation,
    click_pixel,
    colours_on_screen,
    encode_png,
    open_canvas,
    place_of,
    similarity,
    wait_for_colours,
    wait_until,
)

from webapp.access import Server, open_server
from webapp.box import Box
from webapp.canvas import Canvas, Window, pixel_in_text, window_in_text

pytestmark = pytest.mark.filterwarnings("error")


@pytest.mark.parametrize("text", ["", "1", "-1,2", "60,0", "0,80", "1,2,3", "nan,1", "9" * 4000])
def test_a_text_that_names_no_pixel_is_none(text: str) -> None:
    assert pixel_in_text(text, (60, 80)) is None
    assert pixel_in_text("59,79", (60, 80)) == (59, 79)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "0,60,0,80",
        "0,60,0,80,1,1",
        "0,61,0,80,1",
        "0,60,0,81,1",
        "5,5,0,80,1",
        "6,5,0,80,1",
        "0,60,80,80,1",
        "-1,60,0,80,1",
        "0,60,0,80,0",
        "0,60,0,80,0.000",
        "0,60,0,80,.",
        "0,60,0,80,1.2.3",
        "0,60,0,80,-1",
        "0,60,0,80,nan",
        "0,60,0,80,1e9",
        "0,60,0,80,1\n",
        " 0,60,0,80,1",
        "0,60,0,80,٣",
        "0,60,0,80," + "9" * 4000,
        "9" * 4000,
    ],
)
def test_a_text_that_is_no_part_of_the_picture_is_no_window(text: str) -> None:
    assert window_in_text(text, (60, 80)) is None


@pytest.mark.parametrize(
    ("text", "window"),
    [
        ("0,60,0,80,11.163", Window(0, 60, 0, 80, 11.163)),
        ("59,60,79,80,0.001", Window(59, 60, 79, 80, 0.001)),
        ("7,12,3,80,20", Window(7, 12, 3, 80, 20.0)),
    ],
)
def test_a_window_is_read_as_the_page_writes_it(text: str, window: Window) -> None:
    assert window_in_text(text, (60, 80)) == window


def test_the_script_of_the_canvas_is_part_of_the_package() -> None:
    canvas = resources.files("webapp").joinpath("page", "canvas.js").read_text("utf-8")
    assert "window.openCanvas" in canvas


# --- in a real browser ---


@dataclass
class Stage:
    """A server whose clients get a canvas of one picture, and what the last client reported."""

    server: Server
    picture: np.ndarray
    canvas: Any = None
    slider: Any = None
    picks: list[tuple[int, int]] = field(default_factory=list)
    hovers: list[tuple[int, int] | None] = field(default_factory=list)
    keys: list[str] = field(default_factory=list)
    windows: list[Window] = field(default_factory=list)
    boxes: list[Box] = field(default_factory=list)
    connected: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))

    def connect(self, client: viser.ClientHandle) -> None:
        self.canvas = Canvas(client, *self.picture.shape[:2])
        self.canvas.set_base(encode_png(self.picture), "png")
        self.canvas.on_pick(self.picks.append)
        self.canvas.on_hover(self.hovers.append)
        self.canvas.on_key(self.keys.append)
        self.canvas.on_view(self.windows.append)
        self.canvas.on_box(self.boxes.append)
        self.slider = client.gui.add_slider("T", 0.0, 1.0, 0.01, 0.5)
        client.gui.add_text("Note", "")
        self.connected.release()


@pytest.fixture
def open_stage(page: Any) -> Iterator[Callable[[int, int], Stage]]:
    """Open a page with a canvas of coloured noise, (H, W, 3)."""
    servers: list[Server] = []

    def open_one(height: int, width: int) -> Stage:
        server = open_server(port=0)
        servers.append(server)
        server.server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.server.gui.main_panel.dock_right()
        noise = np.random.default_rng(1).integers(0, 256, (height, width, 3), dtype=np.uint8)
        stage = Stage(server, noise)
        server.server.on_client_connect(stage.connect)
        open_canvas(page, server.url)
        assert stage.connected.acquire(timeout=10)
        return stage

    yield open_one
    for server in servers:
        server.stop()


OpenStage = Callable[[int, int], Stage]


@pytest.mark.browser
def test_clicks_on_the_fitted_picture_land_on_their_pixel(page: Any, open_stage: OpenStage) -> None:
    stage = open_stage(60, 80)
    scale, left, top = similarity(page)
    width = page.evaluate("window.__viserMutable.canvas.clientWidth")
    assert left == pytest.approx(width - left - 80 * scale, abs=0.01)
    assert top == pytest.approx(900 - top - 60 * scale, abs=0.01)
    assert 0 < left < 0.02 * width
    expected = [(0, 0), (0, 79), (59, 0), (59, 79), (17, 33)]
    page.mouse.click(left + 5, top - 8)
    page.wait_for_timeout(100)
    for count, pixel in enumerate(expected, 1):
        click_pixel(page, *pixel)
        wait_until(lambda count=count: len(stage.picks) == count)
    assert stage.picks == expected


@pytest.mark.browser
def test_clicks_at_20_fold_land_on_their_pixel_up_to_its_edges(
    page: Any, open_stage: OpenStage
) -> None:
    stage = open_stage(400, 400)
    expected = [(0, 0), (0, 399), (399, 0), (399, 399)]
    for row, column in expected:
        page.keyboard.press("f")
        page.mouse.move(*place_of(page, row + 0.5, column + 0.5))
        for _ in range(8):
            page.mouse.wheel(0, -600)
        wait_until(lambda: similarity(page)[0] > 25)  # all of them: they add up to 25.86
        page.mouse.down()
        page.mouse.move(558, 450, steps=3)  # the whole pixel into view
        page.mouse.up()
        for at in (0.06, 0.94):
            count = len(stage.picks)
            page.mouse.click(*place_of(page, row + at, column + at))
            wait_until(lambda count=count: len(stage.picks) > count)
    assert stage.picks == [pixel for pixel in expected for _ in range(2)]


@pytest.mark.browser
def test_the_pointer_pans_zooms_and_never_rotates(page: Any, open_stage: OpenStage) -> None:
    open_stage(60, 80)
    rotation = camera_rotation(page)
    scale, left, top = similarity(page)
    page.mouse.move(500, 400)
    page.mouse.down()
    page.mouse.move(560, 430, steps=4)
    page.mouse.move(620, 375, steps=4)
    page.mouse.up()
    assert similarity(page) == pytest.approx((scale, left + 120, top - 25), abs=0.5)

    before = [(300 - similarity(page)[1]) / scale, (200 - similarity(page)[2]) / scale]
    page.mouse.move(300, 200)
    for _ in range(4):
        page.mouse.wheel(0, -400)
    wait_until(lambda: similarity(page)[0] > 1.3 * scale)
    zoomed, left, top = similarity(page)
    assert [(300 - left) / zoomed, (200 - top) / zoomed] == pytest.approx(before, abs=1 / scale)
    assert camera_rotation(page) == pytest.approx(rotation, abs=1e-9)

    page.mouse.dblclick(500, 400)
    wait_until(lambda: similarity(page)[0] == pytest.approx(scale))


@pytest.mark.browser
def test_keys_on_a_slider_or_the_page_move_no_camera(page: Any, open_stage: OpenStage) -> None:
    stage = open_stage(60, 80)
    view, rotation = similarity(page), camera_rotation(page)
    page.get_by_role("slider").first.focus()
    for key in ("ArrowUp", "ArrowLeft", "ArrowRight", "ArrowRight"):
        page.keyboard.press(key, delay=60)
    wait_until(lambda: stage.slider.value == pytest.approx(0.52))
    assert stage.keys == []
    page.evaluate("document.activeElement.blur()")
    keys = ["w", "a", "s", "d", "q", "e", "ArrowLeft", "ArrowUp"]
    for key in keys:
        page.keyboard.press(key, delay=60)
    wait_until(lambda: len(stage.keys) == len(keys))
    assert stage.keys == keys
    assert similarity(page) == pytest.approx(view, abs=1e-6)
    assert camera_rotation(page) == pytest.approx(rotation, abs=1e-9)


@pytest.mark.browser
def test_pixels_are_square_and_their_colours_exact(page: Any, open_stage: OpenStage) -> None:
    stage = open_stage(60, 80)
    wait_for_colours(page, stage.picture)
    for at in (0.12, 0.88):  # linear interpolation would mix neighbours there
        shown = colours_on_screen(page, (60, 80), at)
        assert np.array_equal(shown[:, :79], stage.picture[:, :79])  # the panel shades the last

    overlay = np.random.default_rng(2).integers(0, 256, (60, 80, 4), dtype=np.uint8)
    overlay[..., 3] = np.where(overlay[..., 3] < 80, 0, 140)
    alpha = overlay[..., 3:] / 255
    blended = np.rint(alpha * overlay[..., :3] + (1 - alpha) * stage.picture)
    stage.canvas.set_overlay(encode_png(overlay))
    wait_for_colours(page, blended, tolerance=1)
    page.keyboard.down(" ")
    wait_for_colours(page, stage.picture)
    page.keyboard.up(" ")
    wait_for_colours(page, blended, tolerance=1)

    stage.canvas.set_base(encode_png(stage.picture[::-1]), "png")
    stage.canvas.set_overlay(None)
    wait_for_colours(page, stage.picture[::-1])
    shown = colours_on_screen(page, (60, 80), 0.88)
    assert np.array_equal(shown[:, :79], stage.picture[::-1, :79])


@pytest.mark.browser
def test_one_to_one_shows_pixel_for_pixel_and_fit_follows_the_window(
    page: Any, open_stage: OpenStage
) -> None:
    stage = open_stage(301, 400)
    fitted = similarity(page)[0]
    stage.canvas.one_to_one()
    wait_until(lambda: similarity(page)[0] == pytest.approx(1))
    wait_for_colours(page, stage.picture)
    page.set_viewport_size({"width": 1280, "height": 720})
    page.wait_for_function("window.__viserMutable.canvas.clientHeight === 720")
    assert similarity(page)[0] == pytest.approx(1)
    stage.canvas.fit()
    width = page.evaluate("window.__viserMutable.canvas.clientWidth")
    smaller = 0.98 * min(720 / 301, width / 400)
    wait_until(lambda: similarity(page)[0] == pytest.approx(smaller))
    page.set_viewport_size({"width": 1440, "height": 900})
    wait_until(lambda: similarity(page)[0] == pytest.approx(fitted))


@pytest.mark.browser
def test_the_page_reports_the_pointer_and_marks_pixels(page: Any, open_stage: OpenStage) -> None:
    stage = open_stage(60, 80)
    page.mouse.move(*place_of(page, 12.5, 34.5))
    wait_until(lambda: stage.hovers[-1:] == [(12, 34)])
    page.mouse.move(*place_of(page, -0.5, 3))
    wait_until(lambda: stage.hovers[-1] is None)

    page.get_by_role("textbox").last.click()
    page.keyboard.type("fgw ")
    stage.canvas.set_marker((59, 0))
    stage.canvas.set_pins([(2, 3, "<b>1")])
    page.wait_for_selector(".photolin-pin")
    assert page.inner_text(".photolin-pin") == "<b>1"
    box = page.wait_for_selector(".photolin-marker").bounding_box()
    assert (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2) == pytest.approx(
        place_of(page, 59.5, 0.5), abs=0.6
    )
    stage.canvas.set_marker(None)
    page.wait_for_selector(".photolin-marker", state="detached")
    assert stage.keys == []


@pytest.mark.browser
def test_a_tab_that_lost_its_connection_gets_a_working_canvas_again(
    page: Any, open_stage: OpenStage
) -> None:
    stage = open_stage(60, 80)
    stage.server.server._websock_server.disconnect_all_clients()
    assert stage.connected.acquire(timeout=10)
    wait_for_colours(page, stage.picture)
    click_pixel(page, 5, 70)
    wait_until(lambda: stage.picks == [(5, 70)])
    page.keyboard.press("]")
    wait_until(lambda: stage.keys == ["]"])


def window_on_screen(page: Any, shape: tuple[int, int]) -> Window:
    """What the page should report: every pixel of the picture of which something is in view."""
    scale, left, top = similarity(page)
    width = page.evaluate("window.__viserMutable.canvas.clientWidth")
    edges = [-top / scale, (900 - top) / scale, -left / scale, (width - left) / scale]
    row0, column0 = (max(int(np.floor(edge)), 0) for edge in edges[::2])
    row1, column1 = (min(int(np.ceil(e)), n) for e, n in zip(edges[1::2], shape, strict=True))
    return Window(row0, row1, column0, column1, pytest.approx(scale, abs=0.001))


@pytest.mark.browser
def test_the_page_reports_which_part_of_the_picture_is_in_view(
    page: Any, open_stage: OpenStage
) -> None:
    stage = open_stage(300, 400)
    wait_until(lambda: stage.windows[-1:] == [window_on_screen(page, (300, 400))])
    assert stage.windows[-1][:4] == (0, 300, 0, 400)

    page.mouse.move(400, 300)
    for _ in range(4):
        page.mouse.wheel(0, -400)
    wait_until(lambda: stage.windows[-1] == window_on_screen(page, (300, 400)))
    zoomed = stage.windows[-1]
    assert 0 < zoomed.row0 < zoomed.row1 < 300
    assert 0 < zoomed.column0 < zoomed.column1 < 400

    page.mouse.down()
    page.mouse.move(300, 250, steps=4)
    page.mouse.up()
    wait_until(lambda: stage.windows[-1] == window_on_screen(page, (300, 400)))
    assert stage.windows[-1].row0 > zoomed.row0
    assert stage.windows[-1].column0 > zoomed.column0

    stage.canvas.fit()
    wait_until(lambda: stage.windows[-1][:4] == (0, 300, 0, 400))


def drag(page: Any, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Press at (row, column), go to another place, and hold."""
    page.mouse.move(*place_of(page, *start))
    page.mouse.down()
    page.mouse.move(*place_of(page, *end), steps=4)


def start_sampling(page: Any, stage: Stage) -> None:
    stage.canvas.set_sampling("#cc79a7")
    page.wait_for_function("window.__viserMutable.canvas.style.cursor === 'crosshair'")


def outline(page: Any, name: str) -> tuple[float, float, float, float]:
    """(row0, row1, column0, column1) that an element covers on the picture."""
    box = page.wait_for_selector(name).bounding_box()
    scale, left, top = similarity(page)
    rows = [(box["y"] - top) / scale, (box["y"] + box["height"] - top) / scale]
    columns = [(box["x"] - left) / scale, (box["x"] + box["width"] - left) / scale]
    return rows[0], rows[1], columns[0], columns[1]


@pytest.mark.browser
def test_a_drag_while_sampling_draws_a_rectangle_and_the_picture_stays(
    page: Any, open_stage: OpenStage
) -> None:
    stage = open_stage(60, 80)
    view = similarity(page)
    start_sampling(page, stage)
    drag(page, (12.5, 50.5), (40.5, 20.5))  # from the upper right to the lower left
    assert outline(page, ".photolin-band") == pytest.approx((12, 41, 20, 51), abs=0.1)
    page.mouse.up()
    wait_until(lambda: stage.boxes == [Box(12, 41, 20, 51)])
    page.wait_for_selector(".photolin-band", state="hidden")
    assert similarity(page) == pytest.approx(view, abs=1e-6)
    assert stage.picks == []
    click_pixel(page, 7, 9)
    wait_until(lambda: stage.picks == [(7, 9)])
    drag(page, (55.5, 30.5), (70, 10.5))  # beyond the border
    page.mouse.up()
    wait_until(lambda: stage.boxes[1:] == [Box(55, 60, 10, 31)])


@pytest.mark.browser
def test_a_rectangle_beside_the_picture_or_given_up_is_none(
    page: Any, open_stage: OpenStage
) -> None:
    stage = open_stage(60, 60)
    view = similarity(page)
    start_sampling(page, stage)
    drag(page, (10, -6), (30, -2))
    page.mouse.up()
    drag(page, (10.5, 10.5), (30.5, 30.5))
    page.keyboard.press("Escape")
    page.wait_for_selector(".photolin-band", state="hidden")
    page.mouse.up()
    drag(page, (20.5, 20.5), (22.5, 25.5))
    stage.canvas.set_sampling(None)
    page.wait_for_function("window.__viserMutable.canvas.style.cursor === ''")
    page.mouse.up()
    start_sampling(page, stage)
    drag(page, (3.5, 3.5), (4.5, 4.5))
    page.mouse.up()
    wait_until(lambda: len(stage.boxes) > 0)
    assert stage.boxes == [Box(3, 5, 3, 5)]
    assert stage.keys == []  # Escape was about the rectangle
    assert similarity(page) == pytest.approx(view, abs=1e-6)


@pytest.mark.browser
@pytest.mark.parametrize("how", ["off", "Shift", "right", "middle"])
def test_a_drag_pans_with_sampling_off_with_shift_and_with_other_buttons(
    page: Any, open_stage: OpenStage, how: str
) -> None:
    stage = open_stage(60, 80)
    start_sampling(page, stage)
    drag(page, (3.5, 3.5), (4.5, 4.5))  # what it leaves behind must not hold the picture
    page.mouse.up()
    wait_until(lambda: len(stage.boxes) == 1)
    if how == "off":
        stage.canvas.set_sampling(None)
        page.wait_for_function("window.__viserMutable.canvas.style.cursor === ''")
    if how == "Shift":
        page.keyboard.down(how)
    scale, left, top = similarity(page)
    button = how if how in ("right", "middle") else "left"
    page.mouse.move(500, 400)
    page.mouse.down(button=button)
    page.mouse.move(560, 430, steps=4)
    page.mouse.up(button=button)
    assert similarity(page) == pytest.approx((scale, left + 60, top + 30), abs=0.5)
    assert len(stage.boxes) == 1


@pytest.mark.browser
def test_in_3d_a_drag_turns_and_takes_nothing(page: Any, open_stage: OpenStage) -> None:
    stage = open_stage(60, 80)
    stage.canvas.set_boxes([(Box(5, 9, 5, 9), "#009e73")])
    start_sampling(page, stage)
    page.wait_for_selector(".photolin-box")
    stage.canvas.set_orbit(True)
    page.wait_for_selector(".photolin-box", state="hidden")
    before = camera_rotation(page)
    page.mouse.move(500, 400)
    page.mouse.down()
    page.mouse.move(560, 430, steps=4)
    page.mouse.up()
    wait_until(lambda: np.abs(camera_rotation(page) - before).max() > 0.01)
    stage.canvas.set_orbit(False)
    page.wait_for_selector(".photolin-box")
    drag(page, (3.5, 3.5), (4.5, 4.5))
    page.mouse.up()
    wait_until(lambda: stage.boxes == [Box(3, 5, 3, 5)])


@pytest.mark.browser
def test_boxes_are_outlined_where_they_are_even_small_ones(
    page: Any, open_stage: OpenStage
) -> None:
    stage = open_stage(60, 80)
    stage.canvas.set_boxes([(Box(5, 25, 30, 70), "#cc79a7")])
    assert outline(page, ".photolin-box") == pytest.approx((5, 25, 30, 70), abs=0.1)
    colour = page.evaluate(
        "getComputedStyle(document.querySelector('.photolin-box')).borderTopColor"
    )
    assert colour == "rgb(204, 121, 167)"
    page.mouse.move(400, 300)
    page.mouse.wheel(0, -600)
    wait_until(lambda: similarity(page)[0] > 12)
    assert outline(page, ".photolin-box") == pytest.approx((5, 25, 30, 70), abs=0.1)
    page.keyboard.press("f")
    for _ in range(6):
        page.mouse.wheel(0, 600)
    wait_until(lambda: similarity(page)[0] < 6)
    stage.canvas.set_boxes([(Box(40, 41, 7, 8), "#009e73")])
    page.wait_for_function(
        "document.querySelector('.photolin-box')?.style.borderColor === 'rgb(0, 158, 115)'"
    )
    row0, row1, column0, column1 = outline(page, ".photolin-box")
    assert (row0 + row1, column0 + column1) == pytest.approx((81, 15), abs=0.2)
    assert (row1 - row0) * similarity(page)[0] == pytest.approx(7, abs=0.1)
    stage.canvas.set_boxes([])
    page.wait_for_selector(".photolin-box", state="detached")
