"""Two pictures compared as a person does it, in a real browser."""

import io
from collections.abc import Iterator
from pathlib import Path
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
    screenshot,
    similarity,
    wait_for_colours,
    wait_for_keys,
    wait_until,
)
from PIL import Image

from photolin.analysis import Options
from photolin.factors import PALETTE, Factor
from photolin.figures import draw_figure
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp.app import App
from webapp.difference import DIM
from webapp.layers import render_layer
from webapp.render import render_input
from webapp.session import Session
from webapp.source import Source

pytestmark = [
    pytest.mark.browser,
    # a tab may close while its worker draws
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

SCENE = render_scene("sphere_cone", size=(48, 64), images=8)
STACK, TRUTH = SCENE.stack, SCENE.truth.labels
RESULT = analyze(STACK, Options(T=0.05, Ts=0.02, samples=50))
SHAPE = (48, 64)


@pytest.fixture
def app() -> Iterator[App]:
    opened = App(Source(STACK, RESULT, RESULT.options, truth=TRUTH), port=0)
    yield opened
    opened.stop()


def enter(page: Any, app: App, against: str = "truth", show: str = "split") -> Session:
    """Open the tab Compare, photographs without labels on the left; only labels follow T."""
    page.set_viewport_size({"width": 880, "height": 560})  # software GL is slow
    open_canvas(page, app.server.url)
    page.add_style_tag(content="* { box-shadow: none !important }")
    wait_until(lambda: len(app._sessions) == 1)
    (session,) = app._sessions.values()
    wait_until(lambda: session._frame is not None)
    session._panels.thresholds._live.value = False
    session._panels.legend._opacity.value = 0
    page.get_by_role("tab", name="Compare").click()
    wait_for_keys(page)
    choose(page, session._panels.compare._against, against)
    if show != "split":
        choose(page, session._panels.compare._arrangement, show)
    wait_until(lambda: session._read().against == against)
    wait_until(lambda: session._read().arrangement == show)
    return session


def colours(labels: np.ndarray) -> np.ndarray:
    table = np.zeros((256, 3), np.uint8)
    for factor in Factor:
        table[factor] = PALETTE[factor]
    return table[labels]


def photograph(session: Session) -> np.ndarray:
    picture = render_input(STACK.images[0], session._read().gain or 1.0)
    return np.repeat(picture[:, :, None], 3, axis=2)


def expected(session: Session, at: int) -> np.ndarray:
    """The photograph left of a column, the truth from it on."""
    return np.concatenate([photograph(session)[:, :at], colours(TRUTH[0])[:, at:]], axis=1)


def wait_for_split(page: Any, session: Session, at: int) -> None:
    """Wait until both pictures are as they are on either side of the line, which hides some."""
    wanted = expected(session, at)
    scale, _, _ = similarity(page)
    hidden = int(np.ceil(12 / scale))

    def right() -> bool:
        gap = np.abs(colours_on_screen(page, SHAPE).astype(int) - wanted)
        gap[:, max(at - hidden, 0) : at + hidden] = 0
        gap[-12:, :] = 0  # under the line of text
        return gap.max() <= 1

    wait_until(right, 20)


def drag_line(page: Any, column: float, *, let_go: bool = True) -> None:
    """Take the line and move it to a column, as a hand does, not straight."""
    bar = page.locator(".photolin-divider").bounding_box()
    y = bar["y"] + bar["height"] / 3
    page.mouse.move(bar["x"] + bar["width"] / 2, y)
    page.mouse.down()
    x, _ = place_of(page, 0, column)
    page.mouse.move((x + bar["x"]) / 2, y + 5)
    page.mouse.move(x, y + 9)
    if let_go:
        page.mouse.up()


def test_the_line_is_dragged_on_the_picture_also_after_zooming(page: Any, app: App) -> None:
    session = enter(page, app)
    wait_for_split(page, session, 32)
    before = similarity(page)
    drag_line(page, 16.2)
    wait_for_split(page, session, 16)
    wait_until(lambda: session._read().divider == pytest.approx(16.2 / 64, abs=0.01))
    assert similarity(page) == before  # the picture has not moved
    x, y = place_of(page, 20, 16)
    page.mouse.move(x + 40, y)
    page.mouse.wheel(0, -300)
    wait_until(lambda: similarity(page)[0] > 1.1 * before[0])
    bar = page.locator(".photolin-divider").bounding_box()
    assert bar["x"] + bar["width"] / 2 == pytest.approx(place_of(page, 0, 16)[0], abs=2)
    drag_line(page, 24.0)
    wait_until(lambda: session._read().divider == pytest.approx(24 / 64, abs=0.01))
    press(page, "f")
    wait_for_split(page, session, 24)


def test_while_it_is_dragged_the_page_alone_moves_the_line(page: Any, app: App) -> None:
    session = enter(page, app)
    wait_for_split(page, session, 32)
    painted: list[int] = []
    second = session._canvas.second
    for planes in (session._canvas, second):
        for name in ("set_base", "set_overlay"):
            draw = getattr(planes, name)
            setattr(planes, name, lambda *a, d=draw: (painted.append(1), d(*a)))
    drag_line(page, 40, let_go=False)
    wait_for_split(page, session, 40)
    page.mouse.up()
    wait_until(lambda: session._read().divider == pytest.approx(40 / 64, abs=0.01))
    assert painted == []
    # what the slider says later counts again
    page.wait_for_timeout(1100)
    session._panels.compare._divider.value = 0.25
    wait_for_split(page, session, 16)


@pytest.mark.parametrize("text", ["nan", "7.5", "-0.2", "<b>", "0.5.5"])
def test_a_place_of_the_line_that_is_none_changes_nothing(page: Any, app: App, text: str) -> None:
    session = enter(page, app)
    field = session._canvas.second.divider_id
    tell = """([uuid, value]) => window.__viserMutable.sendMessage(
        {type: "GuiUpdateMessage", uuid, updates: {value}})"""
    page.evaluate(tell, [field, text])
    page.evaluate(tell, [field, "0.7500"])
    wait_until(lambda: session._read().divider == 0.75)
    page.evaluate(tell, [field, text])
    page.wait_for_timeout(300)
    assert session._read().divider == 0.75


def test_side_by_side_a_click_in_either_view_selects_the_same_pixel(page: Any, app: App) -> None:
    session = enter(page, app, show="side by side")
    half = page.evaluate("window.__viserMutable.canvas.clientWidth / 2")
    wait_until(lambda: place_of(page, 0, 64)[0] < half)

    def views() -> tuple[np.ndarray, np.ndarray]:
        scale, left, top = similarity(page)
        window = screenshot(page)
        rows = np.floor(top + (np.arange(48) + 0.5) * scale).astype(int)
        columns = left + (np.arange(64) + 0.5) * scale
        return tuple(  # type: ignore[return-value]
            window[np.ix_(rows, np.floor(columns + moved).astype(int))] for moved in (0, half)
        )

    wanted = (photograph(session), colours(TRUTH[0]))
    wait_until(
        lambda: all(
            np.abs(v.astype(int) - w).max() <= 1 for v, w in zip(views(), wanted, strict=True)
        ),
        20,
    )
    x, y = place_of(page, 20.5, 30.5)
    page.mouse.move(x + half, y)
    page.get_by_text("left: row 20 column 30").wait_for()
    letter = {1: "D", 2: "S", 3: "A", 4: "C"}[int(TRUTH[0, 20, 30])]
    page.get_by_text(f"right: truth {letter}").wait_for()
    page.mouse.click(x + half, y)
    wait_until(lambda: session._pointing.pixel == (20, 30))
    for n in (0, 1):
        page.locator(".photolin-marker").nth(n).wait_for()
    # in one go: rings are drawn anew with each frame
    rings = page.evaluate(
        """() => [...document.querySelectorAll(".photolin-marker")]
            .map((ring) => ring.getBoundingClientRect().toJSON())"""
    )
    assert rings[1]["x"] - rings[0]["x"] == pytest.approx(half, abs=1)
    assert rings[0]["x"] + rings[0]["width"] / 2 == pytest.approx(x, abs=1.5)
    click_pixel(page, 10, 11)
    wait_until(lambda: session._pointing.pixel == (10, 11))


def test_side_by_side_both_views_pan_and_zoom_together(page: Any, app: App) -> None:
    session = enter(page, app, show="side by side")
    half = page.evaluate("window.__viserMutable.canvas.clientWidth / 2")
    wait_until(lambda: place_of(page, 0, 64)[0] < half)
    x, y = place_of(page, 20.5, 40.5)
    before = similarity(page)
    page.mouse.move(x + half, y)
    page.mouse.wheel(0, -400)
    wait_until(lambda: similarity(page)[0] > 1.1 * before[0])
    assert place_of(page, 20.5, 40.5) == pytest.approx((x, y), abs=1.5)
    page.mouse.move(x + half, y)
    page.mouse.down()
    page.mouse.move(x + half - 30, y + 10)
    page.mouse.move(x + half - 40, y + 20)
    page.mouse.up()
    assert place_of(page, 20.5, 40.5) == pytest.approx((x - 40, y + 20), abs=2)
    page.mouse.click(x + half - 40, y + 20)
    wait_until(lambda: session._pointing.pixel == (20, 40))
    kept = similarity(page)[0]
    choose(page, session._panels.compare._arrangement, "left")
    wait_until(lambda: page.evaluate("document.querySelector('.photolin-divider').hidden"))
    assert similarity(page)[0] == pytest.approx(kept, rel=1e-3)
    press(page, "f")
    wait_for_colours(page, photograph(session)[:15], tolerance=1)  # above the ring


@pytest.mark.parametrize("show", ["split", "side by side", "difference"])
def test_B_shows_one_and_the_other_alone_and_shift_B_both_again(
    page: Any, app: App, show: str
) -> None:
    session = enter(page, app, show=show)
    press(page, "b")
    wait_until(lambda: session._read().arrangement == "left")
    wait_for_colours(page, photograph(session)[:36], tolerance=1)
    for _ in range(2):
        press(page, "b")
        wait_until(lambda: session._read().arrangement == "right")
        wait_for_colours(page, colours(TRUTH[0])[:36], tolerance=1)
        press(page, "b")
        wait_until(lambda: session._read().arrangement == "left")
        wait_for_colours(page, photograph(session)[:36], tolerance=1)
    press(page, "Shift+B")
    wait_until(lambda: session._read().arrangement == show)


def test_the_difference_of_labels_is_coloured_and_counted(page: Any, app: App) -> None:
    session = enter(page, app, show="difference")
    labels = RESULT.labels[0]
    apart = labels != TRUTH[0]
    wanted = np.where(
        apart[..., None],
        colours(labels),
        render_input(STACK.images[0], DIM * (session._read().gain or 1.0))[..., None],
    )
    assert 10 < apart.sum() < apart.size / 2
    wait_for_colours(page, wanted[:36], tolerance=1)
    share = 100 * apart.mean()
    page.get_by_text(f"This image: {share:.2f} % of {apart.size} labels differ.").wait_for()
    everywhere = RESULT.labels != TRUTH
    share = 100 * everywhere.mean()
    page.get_by_text(f"All images: {share:.2f} % of {everywhere.size} labels differ.").wait_for()
    page.get_by_text("labels that differ, in the colour of the left one").wait_for()
    choose(page, session._panels.compare._against, "linearized")
    wait_until(lambda: session._frame is not None and session._frame.state.against == "linearized")
    residual, _ = render_layer(_residual(session))
    wait_for_colours(page, residual[:36], tolerance=1)
    page.get_by_text("left minus right, blue -").wait_for()


def _residual(session: Session) -> Any:
    from dataclasses import replace

    frame = session._frame
    assert frame is not None
    return replace(frame, state=replace(frame.state, layer="residual", against=None))


def test_the_truth_is_offered_only_where_it_is_known(page: Any, app: App) -> None:
    unknown = App(Source(STACK, RESULT, RESULT.options), port=0)
    try:
        session = enter(page, unknown, against="linearized")
        assert "truth" not in session._panels.compare._against.options
    finally:
        unknown.stop()


def test_the_method_is_chosen_here_or_in_Tune_alike(page: Any, app: App) -> None:
    session = enter(page, app, against="labels")
    pixel = session._panels.pixel
    page.get_by_text("There are no two results to count labels of").wait_for()
    choose(page, pixel._twin, "statistical")
    wait_until(lambda: session._read().beside == "statistical")
    assert pixel._beside.value == "statistical"
    page.get_by_text("Left: input by robust. Right: labels by statistical.").wait_for(
        timeout=60_000
    )
    page.get_by_text("labels differ.").first.wait_for()
    page.get_by_role("tab", name="Tune").click()
    choose(page, pixel._beside, "no other method")
    wait_until(lambda: session._read().beside is None)
    wait_until(lambda: pixel._twin.value == "no other method")


def test_a_figure_is_saved_as_it_is_drawn(page: Any, app: App, tmp_path: Path) -> None:
    session = enter(page, app)
    page.get_by_role("tab", name="Export").click()
    wait_for_keys(page)
    choose(page, session._panels.export._kind, "figure 10 of the paper (PNG)")
    assert session._panels.export.chosen() == ("figure 10", False)
    with page.expect_download(timeout=60_000) as started:
        page.locator("button:visible").get_by_text("Download", exact=True).click()
    file = tmp_path / "figure.png"
    started.value.save_as(file)
    assert started.value.suggested_filename == "sphere_cone_000_figure_10.png"
    assert file.read_bytes() == draw_figure("10", STACK, {"robust": RESULT}, 0, TRUTH)
    assert "Fig. 10" in Image.open(io.BytesIO(file.read_bytes())).info["Description"]
