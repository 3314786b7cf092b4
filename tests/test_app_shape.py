"""The Shape tab as a person meets it: from clicks to a surface in 3D, in a real browser."""

import io
import time
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest
import tifffile
from browser import (
    camera_rotation,
    choose,
    click_pixel,
    open_canvas,
    press,
    screenshot,
    similarity,
    wait_for_colours,
    wait_for_text,
    wait_until,
    widget,
)

from photolin.analysis import Analysis, Options
from photolin.export import load_result, load_shape, save_result
from photolin.pipeline import analyze
from photolin.shape.known import Known
from photolin.shape.recover import Shape, recover_shape
from photolin.shape.resolve import resolve_ambiguity
from photolin.stack import ImageStack
from photolin.synthetic import render_scene
from webapp.app import App
from webapp.frame import Recovered
from webapp.pointed import Pointed
from webapp.session import Session
from webapp.source import Source
from webapp.surface import render_surface

pytestmark = [
    pytest.mark.browser,
    # a tab may close while its worker draws
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

SCENE = render_scene("sphere_obstacles")
"""A sphere of 50 mm in the middle, among poles and blocks."""
STACK = SCENE.stack
OPTIONS = Options(T=0.05, Ts=0.02)
RESULT = analyze(STACK, OPTIONS)
RADIUS = 50 / SCENE.truth.px_mm
RIM = ((8, 80), (29, 121), (95, 43))
"""Pixels on the sphere's outline, each within a pixel."""
FIVE = ((60, 80), (45, 65), (45, 95), (78, 68), (77, 92))


def on_sphere(share: float = 0.9) -> np.ndarray:
    """(H,W) pixels of the sphere up to a share of its radius that nothing stands before."""
    H, W = STACK.mask.shape
    row, column = np.mgrid[:H, :W]
    x = (column + 0.5 - W / 2) * SCENE.truth.px_mm
    y = (H / 2 - row - 0.5) * SCENE.truth.px_mm
    z = np.sqrt(np.maximum(50**2 - x**2 - y**2, 0))
    return (x**2 + y**2 < (50 * share) ** 2) & (np.abs(SCENE.truth.depth - z) < 0.5)


OpenApp = Callable[..., App]


@pytest.fixture
def open_app() -> Iterator[OpenApp]:
    apps: list[App] = []

    def open_one(stack: ImageStack = STACK, result: Analysis | None = RESULT) -> App:
        apps.append(App(Source(stack, result, OPTIONS), port=0))
        return apps[-1]

    yield open_one
    for opened in apps:
        opened.stop()


def enter(page: Any, app: App) -> Session:
    """Open a tab of the browser at the tab Shape."""
    page.set_viewport_size({"width": 1000, "height": 640})  # software GL is slow
    open_canvas(page, app.server.url)
    page.add_style_tag(content="* { box-shadow: none !important }")
    wait_until(lambda: len(app._sessions) == 1)
    (session,) = app._sessions.values()
    wait_until(lambda: session._frame is not None)
    page.get_by_role("tab", name="Shape").click()
    leave_widgets(page)
    return session


def leave_widgets(page: Any) -> None:
    page.wait_for_timeout(60)
    page.evaluate("document.activeElement.blur()")


def push(page: Any, name: str) -> None:
    page.locator("button:visible").get_by_text(name, exact=True).click()
    page.wait_for_timeout(100)
    leave_widgets(page)


def dismiss_notes(page: Any) -> None:
    buttons = "document.querySelectorAll('.mantine-Notification-root button')"
    page.evaluate(f"{buttons}.forEach((button) => button.click())")
    page.wait_for_function(f"{buttons}.length === 0")  # once they have faded


def click_all(page: Any, session: Session, pixels: tuple[tuple[int, int], ...]) -> None:
    for pixel in pixels:
        click_pixel(page, *pixel)
        wait_until(lambda p=pixel: any(click.pixel == p for click in pointed(session).clicks))


def pointed(session: Session) -> Pointed:
    return session._panels.shape._sphere.pointed


def ask_for_points(page: Any, session: Session) -> None:
    """Begin to point out a sphere by points."""
    choose(page, session._panels.shape._known, "points on a sphere")
    wait_until(lambda: pointed(session).wanted == "points")
    wait_until(lambda: session._panels.shape._sphere._in_view)
    wait_until(lambda: drawn(page) is not None)


def drawn(page: Any) -> tuple[int, int, bool] | None:
    """How many rim clicks and points are on the picture, and whether the outline is dashed."""
    found = page.evaluate(
        """() => {
            const all = (what) => document.querySelectorAll(`.photolin-sketch > ${what}`);
            const outline = all("circle[fill=none]");
            return outline.length === 0 ? null
                : [all("path").length / 2, all("text").length,
                   outline[0].hasAttribute("stroke-dasharray")];
        }"""
    )
    return None if found is None else (found[0], found[1], found[2])


def circle(page: Any) -> tuple[float, float, float]:
    """Middle (x, y) and radius of the outline on screen, CSS pixels."""
    found = page.locator(".photolin-sketch > circle[fill=none]").first
    return tuple(float(found.get_attribute(name)) for name in ("cx", "cy", "r"))  # type: ignore[return-value]


def refusal(page: Any) -> str:
    """What is said when the shape is asked for and cannot be recovered; then it is put away."""
    press(page, "n")
    note = page.get_by_text("This did not work").first
    note.wait_for(timeout=10_000)
    said = page.locator(".mantine-Notification-root").all_inner_texts()
    dismiss_notes(page)
    return " ".join(said)


def recovered(session: Session) -> Recovered:
    """The shape, once it is on screen and can be looked at in 3D: panels are drawn last."""
    wait_until(lambda: session._frame is not None and session._frame.shape is not None, 30)
    wait_until(lambda: not session._panels.shape._relief.disabled)
    found = session._bench.work.recovered
    assert found is not None
    return found


def set_outline(session: Session) -> None:
    """Give the sphere's outline, once a sphere is asked for: that begins at the rim."""
    sphere = session._panels.shape._sphere
    wait_until(lambda: sphere.pointed.wanted is not None)
    sphere.set((59.5, 79.5, RADIUS))


def recover(page: Any, session: Session) -> Recovered:
    """A shape by all pixels of the sphere."""
    session._panels.shape._known.value = "a whole sphere"
    set_outline(session)
    session._panels.shape._sphere.press("select")  # clicks are for pixels again
    press(page, "n")
    return recovered(session)


def ring_at(page: Any) -> np.ndarray:
    """Middle of the ring round the selected pixel, (x, y) CSS pixels; NaN while it is hidden."""
    ring = page.locator(".photolin-marker").bounding_box()
    if ring is None:
        return np.full(2, np.nan)
    return np.array([ring["x"] + ring["width"] / 2, ring["y"] + ring["height"] / 2])


def turn_on(page: Any) -> float:
    """Go to 3D by the key; seconds until the picture lies on the surface."""
    start = time.monotonic()
    page.keyboard.press("d")
    page.wait_for_function(DRESSED)
    return time.monotonic() - start


DRESSED = """() => {
    let drawn = false;
    window.__viserMutable.nodeRefFromName["/canvas/relief"]?.traverse((mesh) => {
        drawn ||= mesh.userData.photolin && mesh.visible && Boolean(mesh.material.map);
    });
    return drawn;
}"""


def turn(page: Any, right: int, down: int) -> None:
    """Drag the view, from a place where nothing but the scene is."""
    page.mouse.move(300, 320)
    page.mouse.down()
    page.mouse.move(300 + right, 320 + down, steps=6)
    page.mouse.up()
    rest(page)


def rest(page: Any) -> None:
    """Wait until the camera stands still."""
    before = camera_matrix(page)
    end = time.monotonic() + 10
    while True:
        page.wait_for_timeout(150)
        now = camera_matrix(page)
        if np.allclose(now, before, rtol=0, atol=1e-7):
            return
        assert time.monotonic() < end, "the camera does not rest"
        before = now


def camera_matrix(page: Any) -> np.ndarray:
    """(4,4) from three.js's world to the clip cube."""
    parts = page.evaluate(
        """() => {
            const { camera } = window.__viserMutable;
            camera.updateMatrixWorld();
            return [camera.projectionMatrix.toArray(), camera.matrixWorld.toArray()];
        }"""
    )
    projection, placed = (np.array(part).reshape(4, 4).T for part in parts)
    return projection @ np.linalg.inv(placed)


def picture_matrix(page: Any) -> np.ndarray:
    """(4,4) from viser's world, x right, y down, z away, to three.js's."""
    source = "window.__viserMutable.nodeRefFromName['/canvas/base'].matrixWorld.toArray()"
    return np.array(page.evaluate(source)).reshape(4, 4).T


def on_screen(page: Any, depth: np.ndarray, pixel: tuple[int, int]) -> np.ndarray:
    """Where the surface at a pixel's centre lies in the window, (x, y) CSS pixels."""
    H, W = depth.shape
    row, column = pixel
    world = 10 / H * np.array([column + 0.5 - W / 2, row + 0.5 - H / 2, -depth[pixel]])
    x, y, _, w = camera_matrix(page) @ picture_matrix(page) @ [*world, 1]
    width, height = page.evaluate(
        "[window.__viserMutable.canvas.clientWidth, window.__viserMutable.canvas.clientHeight]"
    )
    return np.array([(x / w + 1) / 2 * width, (1 - y / w) / 2 * height])


# --- what a person does ---


def test_three_clicks_on_the_rim_and_five_on_the_sphere_give_its_shape(
    page: Any, open_app: OpenApp
) -> None:
    session = enter(page, open_app())
    ask_for_points(page, session)
    wait_for_text(page, "1. Click the rim of the sphere three times: 0 of 3.")
    assert drawn(page) == (0, 0, True)
    push(page, "points")
    wait_for_text(page, "First the outline: click the rim")
    assert "outline of the sphere is not set" in refusal(page)
    click_all(page, session, RIM[:2])
    wait_for_text(page, "2 of 3")
    click_all(page, session, RIM[2:])
    assert pointed(session).outline[2] == pytest.approx(RADIUS, abs=1)
    wait_for_text(page, "2. Click five points on it, spread wide: 0 of 5.")
    wait_until(lambda: drawn(page) == (3, 0, False))
    click_all(page, session, FIVE[:4])
    assert session._bench.work.recovered is None
    click_all(page, session, FIVE[4:])
    shape = recovered(session).shape
    assert session._read().layer == "relit"
    assert shape.resolved.kind == "points"
    wait_for_text(page, "resolved by 5 points of known normal")
    push(page, "normals")
    wait_until(lambda: session._read().layer == "normals")
    sphere = on_sphere() & np.isfinite(shape.albedo)
    cosines = (shape.normals * SCENE.truth.normals).sum(axis=2)[sphere].clip(-1, 1)
    mean = float(np.degrees(np.arccos(cosines)).mean())
    print(f"normals of the sphere: {mean:.2f} degrees in the mean")
    assert np.count_nonzero(sphere) > 4000
    assert mean < 2


def test_a_click_on_the_surface_selects_the_pixel_that_is_seen_there(
    page: Any, open_app: OpenApp
) -> None:
    session = enter(page, open_app())
    depth = recover(page, session).shape.depth
    assert depth is not None
    session._panels.shape._arrows.value = False
    turn_on(page)
    rest(page)
    worst = 0
    for drag in ((0, 0), (70, -40), (-190, 60)):
        if any(drag):
            turn(page, *drag)
        for pixel in ((60, 80), (45, 80), (66, 73), (52, 90)):
            session._pointing.pixel = None
            page.mouse.click(*on_screen(page, depth, pixel))
            wait_until(lambda: session._pointing.pixel is not None)
            met = session._pointing.pixel
            assert met is not None
            off = np.abs(np.subtract(met, pixel)).max()
            worst = max(worst, off)
            assert off <= 1, (drag, pixel, met)
            expected = on_screen(page, depth, met)
            wait_until(lambda at=expected: np.abs(ring_at(page) - at).max() < 1)
            page.wait_for_timeout(350)  # the next click is none of a double click
    print(f"clicks are off by at most {worst} pixels")
    page.mouse.click(300, 5)
    assert session._pointing.pixel is not None


def test_each_pixel_of_the_picture_lies_on_its_point_of_the_surface(
    page: Any, open_app: OpenApp
) -> None:
    session = enter(page, open_app())
    shape = recover(page, session).shape
    assert shape.depth is not None
    session._panels.shape._arrows.value = False
    press(page, "ArrowUp", "ArrowUp")  # from relit to normals, whose colours tell all sides apart
    wait_until(lambda: session._frame is not None and session._frame.state.layer == "normals")
    turn_on(page)
    for drag in ((0, 0), (60, -30)):
        if any(drag):
            turn(page, *drag)
        page.mouse.move(300, 2)
        page.wait_for_timeout(500)
        window = screenshot(page).astype(int)
        expected = render_surface(shape, "normals", (0, 0), STACK.mask)[0]
        for pixel in ((60, 80), (40, 80), (75, 80), (60, 65), (60, 95)):
            x, y = on_screen(page, shape.depth, pixel)
            shown = window[int(y), int(x)]
            # a pixel's neighbours on a sphere of 51 pixels differ by 3 steps
            assert np.abs(shown - expected[pixel]).max() <= 4, (drag, pixel)


def test_what_the_surface_hides_is_not_marked(page: Any, open_app: OpenApp) -> None:
    session = enter(page, open_app())
    recover(page, session)
    click_pixel(page, 60, 40)
    wait_until(lambda: session._pointing.pixel == (60, 40))
    turn_on(page)
    page.wait_for_selector(".photolin-marker:not([hidden])")
    turn(page, -150, 0)
    page.wait_for_selector(".photolin-marker", state="hidden")
    turn(page, 300, 0)
    page.wait_for_selector(".photolin-marker:not([hidden])")


def test_the_flat_picture_is_as_before_after_3d(page: Any, open_app: OpenApp) -> None:
    session = enter(page, open_app())
    found = recover(page, session)
    expected = render_surface(found.shape, "relit", session._pointing.light, STACK.mask)[0]
    expected = np.repeat(expected[..., None], 3, axis=2)
    page.add_style_tag(content=".photolin-light, .photolin-sketch { visibility: hidden }")
    wait_for_colours(page, expected)
    view, rotation = similarity(page), camera_rotation(page)
    turn_on(page)
    turn(page, 120, 50)
    assert np.abs(camera_rotation(page) - rotation).max() > 0.05
    page.mouse.wheel(0, -300)
    rest(page)
    press(page, "d")
    wait_until(lambda: not session._read().relief)
    wait_until(lambda: np.allclose(camera_rotation(page), rotation, atol=1e-9))
    assert similarity(page) == pytest.approx(view, abs=1e-6)
    wait_for_colours(page, expected)
    click_pixel(page, 30, 100)
    wait_until(lambda: session._pointing.pixel == (30, 100))
    before = camera_rotation(page)
    turn(page, 60, 20)
    assert camera_rotation(page) == pytest.approx(before, abs=1e-9)
    scale, left, top = view
    assert similarity(page) == pytest.approx((scale, left + 60, top + 20), abs=0.5)


def test_in_3d_keys_turn_nothing_and_fit_double_click_and_window_keep_the_surface_in_view(
    page: Any, open_app: OpenApp
) -> None:
    session = enter(page, open_app())
    depth = recover(page, session).shape.depth
    assert depth is not None
    turn_on(page)
    rest(page)
    fitted = camera_matrix(page)
    turn(page, 100, 40)
    turned = camera_matrix(page)
    press(page, "w", "a", "q", "ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown")
    rest(page)
    assert camera_matrix(page) == pytest.approx(turned, abs=1e-4)  # a key of viser turns by 0.04

    press(page, "f")
    rest(page)
    assert camera_matrix(page) == pytest.approx(fitted, abs=1e-6)
    press(page, "g")
    rest(page)
    facing = camera_rotation(page)
    turn(page, 100, 40)
    assert np.abs(camera_rotation(page) - facing).max() > 0.05
    page.mouse.dblclick(300, 320)
    rest(page)
    assert camera_matrix(page) == pytest.approx(fitted, abs=1e-6)

    turn(page, 100, 40)
    rest(page)  # the camera glides on a little
    rotation = camera_rotation(page)
    corners = [on_screen(page, depth, pixel) for pixel in ((15, 80), (105, 80))]
    page.set_viewport_size({"width": 820, "height": 640})
    page.wait_for_function("window.__viserMutable.canvas.clientWidth < 600")
    rest(page)
    assert camera_rotation(page) == pytest.approx(rotation, abs=1e-6)
    narrower = [on_screen(page, depth, pixel) for pixel in ((15, 80), (105, 80))]
    assert np.ptp(narrower, axis=0)[1] < np.ptp(corners, axis=0)[1]
    page.set_viewport_size({"width": 1000, "height": 640})
    page.wait_for_function("window.__viserMutable.canvas.clientWidth > 600")
    rest(page)
    again = [on_screen(page, depth, pixel) for pixel in ((15, 80), (105, 80))]
    assert np.abs(np.subtract(again, corners)).max() < 0.5


def test_the_surface_of_half_a_megapixel_appears(page: Any, open_app: OpenApp) -> None:
    scene = render_scene("sphere_obstacles", size=(512, 512), images=8)
    result = analyze(scene.stack, OPTIONS)
    session = enter(page, open_app(scene.stack, result))
    session._panels.shape._known.value = "nothing"
    press(page, "n")
    recovered(session)
    page.wait_for_timeout(500)
    seconds = turn_on(page)
    print(f"512 x 512 pixels lie on the surface after {seconds:.2f} s")
    rest(page)
    assert screenshot(page)[320, 300].max() > 20


def test_dragging_the_light_shows_the_scene_under_it(page: Any, open_app: OpenApp) -> None:
    session = enter(page, open_app())
    found = recover(page, session)
    page.wait_for_selector(".photolin-light:not([hidden])")
    view = similarity(page)
    box = page.locator(".photolin-light").bounding_box()
    readout = page.locator(".photolin-readout").bounding_box()
    assert box["y"] + box["height"] < readout["y"]
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    for x, y in ((-0.3, 0.1), (0.55, -0.35)):
        page.mouse.move(
            box["x"] + box["width"] * (1 + x) / 2, box["y"] + box["height"] * (1 - y) / 2, steps=5
        )
    page.mouse.up()
    wait_until(lambda: session._pointing.light == pytest.approx((0.55, -0.35), abs=0.02))
    expected, caption = render_surface(found.shape, "relit", session._pointing.light, STACK.mask)
    page.add_style_tag(content=".photolin-light, .photolin-sketch { visibility: hidden }")
    wait_for_colours(page, np.repeat(expected[..., None], 3, axis=2))
    page.mouse.move(300, 2)
    wait_for_text(page, caption)
    assert session._pointing.pixel is None  # the ball is not the picture
    assert similarity(page) == view


def test_dragging_the_light_beyond_the_ball_stays_on_its_rim(page: Any, open_app: OpenApp) -> None:
    session = enter(page, open_app())
    recover(page, session)
    page.wait_for_selector(".photolin-light:not([hidden])")
    box = page.locator(".photolin-light").bounding_box()
    page.mouse.move(box["x"] + 50, box["y"] + 50)
    page.mouse.down()
    page.mouse.move(box["x"] - 300, box["y"] + 55, steps=5)
    page.mouse.up()
    wait_until(lambda: session._pointing.light == pytest.approx((-0.99, 0), abs=0.01))


def test_what_does_not_work_is_told_in_the_words_of_the_command_line_until_it_is_undone(
    page: Any, open_app: OpenApp
) -> None:
    session = enter(page, open_app())
    ask_for_points(page, session)
    set_outline(session)
    push(page, "points")
    click_all(page, session, ((60, 60), (60, 70), (60, 80), (60, 90), (60, 100)))
    wait_for_text(page, "This did not work")
    wait_for_text(page, "lie nearly in one plane")
    assert session._bench.work.recovered is None
    push(page, "undo")
    page.get_by_text("lie nearly in one plane").wait_for(state="detached")
    assert len(pointed(session).points) == 4

    push(page, "clear")
    click_all(page, session, (*RIM, *FIVE))
    assert recovered(session).shape.resolved.residual < 2


def test_a_click_outside_the_sphere_is_refused_at_once_and_not_kept(
    page: Any, open_app: OpenApp
) -> None:
    session = enter(page, open_app())
    ask_for_points(page, session)
    click_all(page, session, (*RIM, *FIVE[:4]))
    click_pixel(page, 112, 2)
    wait_for_text(page, "Row 112, column 2 is outside the outline")
    assert pointed(session).points == FIVE[:4]
    click_all(page, session, FIVE[4:])
    page.get_by_text("is outside the outline").wait_for(state="detached")
    assert recovered(session).shape.resolved.kind == "points"
    assert session._pointing.pixel is None


def test_undo_takes_back_one_click_and_the_outline_with_the_third_on_the_rim(
    page: Any, open_app: OpenApp
) -> None:
    session = enter(page, open_app())
    ask_for_points(page, session)
    guess = pointed(session).outline
    click_all(page, session, (*RIM, *FIVE[:2]))
    wait_until(lambda: drawn(page) == (3, 2, False))
    push(page, "undo")
    wait_for_text(page, "2. Click five points on it, spread wide: 1 of 5.")
    wait_until(lambda: drawn(page) == (3, 1, False))
    push(page, "undo")
    push(page, "undo")
    wait_for_text(page, "1. Click the rim of the sphere three times: 2 of 3.")
    wait_until(lambda: drawn(page) == (2, 0, True))
    assert pointed(session).outline == guess
    assert "outline of the sphere is not set" in refusal(page)


def test_the_outline_lies_on_the_picture_and_follows_the_numbers_and_the_view(
    page: Any, open_app: OpenApp
) -> None:
    session = enter(page, open_app())
    ask_for_points(page, session)
    click_all(page, session, RIM)
    for radius in (None, "40"):
        if radius is not None:
            box = widget(page, session._panels.shape._sphere._numbers[2])
            box.fill(radius)
            box.press("Enter")
            wait_until(lambda: pointed(session).outline[2] == 40)
            leave_widgets(page)
            page.mouse.move(300, 320)
            page.mouse.wheel(0, -200)
        row, column, size = pointed(session).outline
        scale, left, top = similarity(page)
        expected = (left + (column + 0.5) * scale, top + (row + 0.5) * scale, size * scale)
        wait_until(lambda at=expected: circle(page) == pytest.approx(at, abs=0.01))
    page.get_by_role("tab", name="Tune").click()
    wait_until(lambda: drawn(page) is None)
    leave_widgets(page)
    click_pixel(page, 60, 80)
    wait_until(lambda: session._pointing.pixel == (60, 80))
    assert pointed(session).rim == RIM


def test_in_3d_clicks_select_although_points_are_being_clicked(
    page: Any, open_app: OpenApp
) -> None:
    session = enter(page, open_app())
    ask_for_points(page, session)
    click_all(page, session, (*RIM, *FIVE))
    depth = recovered(session).shape.depth
    assert depth is not None
    session._panels.shape._arrows.value = False
    turn_on(page)
    rest(page)
    wait_for_text(page, "In 3D clicks select pixels.")
    assert drawn(page) is None
    page.mouse.click(*on_screen(page, depth, (52, 90)))
    wait_until(lambda: session._pointing.pixel is not None)
    assert pointed(session).points == FIVE


def test_a_click_while_a_shape_is_recovered_counts(
    page: Any, open_app: OpenApp, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = enter(page, open_app())
    held = Event()

    def hold(*arguments: Any, **options: Any) -> Shape:
        assert held.wait(20)
        return recover_shape(*arguments, **options)

    monkeypatch.setattr("webapp.work.recover_shape", hold)
    ask_for_points(page, session)
    click_all(page, session, (*RIM, *FIVE, (60, 100)))
    held.set()
    wait_for_text(page, "resolved by 6 points of known normal")


def test_normals_are_pasted_as_lines(page: Any, open_app: OpenApp) -> None:
    session = enter(page, open_app())
    view = session._panels.shape
    choose(page, view._known, "normals of some pixels")
    lines = [" ".join(map(str, (*p, *SCENE.truth.normals[p].tolist()))) for p in FIVE]
    box = page.locator("textarea:visible")
    box.fill("\n".join(lines))
    wait_until(lambda: view._list.value.count("\n") == 4)
    push(page, "Recover shape")
    assert recovered(session).shape.resolved.kind == "points"
    wait_for_text(page, "resolved by 5 points of known normal")


def test_a_result_with_a_shape_opens_with_it(page: Any, tmp_path: Path) -> None:
    known = Known((59.5, 79.5, RADIUS))
    shape = recover_shape(STACK, RESULT, resolve_ambiguity(RESULT, known), px_mm=0.5)
    save_result(RESULT, tmp_path, shape=shape)
    source = Source(STACK, load_result(tmp_path), OPTIONS, shape=load_shape(tmp_path))
    app = App(source, port=0)
    session = enter(page, app)
    found = recovered(session)
    assert found.shape is source.shape
    assert session._read().layer == "relit"
    wait_for_text(page, "resolved by a sphere at row 59.5, column 79.5")
    assert session._panels.shape.known() == replace(
        known, sphere=pytest.approx(known.sphere, abs=0.1)
    )
    assert session._panels.shape.px_mm() == 0.5
    expected = render_surface(shape, "relit", session._pointing.light, STACK.mask)[0]
    page.add_style_tag(content=".photolin-light, .photolin-sketch { visibility: hidden }")
    wait_for_colours(page, np.repeat(expected[..., None], 3, axis=2))
    press(page, "ArrowUp")
    wait_until(lambda: session._read().layer == "depth")
    session._exclude(3)
    wait_until(lambda: session._frame is not None and session._frame.shape is None)
    session._exclude(3, False)
    assert recovered(session).shape is source.shape
    assert "depth" in session._panels.picture._layer.options
    app.stop()


def test_a_shape_of_other_thresholds_says_so_until_it_is_recovered_again(
    page: Any, open_app: OpenApp
) -> None:
    session = enter(page, open_app())
    recover(page, session)
    session._panels.thresholds._T.value = 0.08
    session._pace.wake()
    wait_for_text(page, "This shape is of T 0.0500, Ts 0.0200; recover again")
    wait_until(lambda: session._bench.work.results["robust"].thresholds.T == 0.08)
    wait_until(lambda: not session._bench.work._job._running)
    press(page, "n")
    wait_until(lambda: recovered(session).analysis.thresholds.T == 0.08, 30)
    page.get_by_text("This shape is of").wait_for(state="detached")


def test_files_of_the_shape_are_what_is_on_screen(
    page: Any, open_app: OpenApp, tmp_path: Path
) -> None:
    session = enter(page, open_app())
    page.get_by_role("tab", name="Export").click()
    choose(page, session._panels.export._kind, "shape (maps and mesh, zip)")
    wait_until(lambda: session._panels.export._images.disabled)
    press(page, "e")
    wait_for_text(page, "there is no shape yet; recover one in the tab Shape (key: N)")
    found = recover(page, session)
    directx = widget(page, session._panels.export._directx)
    directx.check()
    wait_until(lambda: session._panels.export.convention() == "directx")
    leave_widgets(page)
    with page.expect_download() as started:
        press(page, "e")
    saved = tmp_path / started.value.suggested_filename
    started.value.save_as(saved)
    assert saved.name == "sphere_obstacles_shape.zip"
    with zipfile.ZipFile(saved) as archive:
        normals = tifffile.imread(io.BytesIO(archive.read("normals.tif")))
        names = set(archive.namelist())
    assert {"mesh.ply", "mesh.obj", "lights.lp", "result.npz", "report.json"} <= names
    assert "normals_directx.png" in names
    assert "normals_opengl.png" not in names
    assert np.array_equal(normals, found.shape.normals, equal_nan=True)


def test_with_lights_the_shape_takes_them(page: Any, open_app: OpenApp) -> None:
    lights = SCENE.truth.lights * SCENE.truth.power[:, None]
    stack, result = replace(STACK, lights=lights), replace(RESULT, lights=lights)
    session = enter(page, open_app(stack, result))
    assert session._panels.shape._known.value == "the lights of the stack"
    page.get_by_role("button", name="Recover shape").click()
    shape = recovered(session).shape
    assert np.array_equal(shape.resolved.matrix, resolve_ambiguity(result).matrix)
