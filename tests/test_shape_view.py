"""The Shape tab: what clicks make known, and what it says of the shape."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from photolin.analysis import Options
from photolin.factors import Thresholds
from photolin.pipeline import analyze
from photolin.shape.recover import recover_shape
from photolin.shape.resolve import resolve_ambiguity
from photolin.synthetic import render_scene
from webapp.access import open_server
from webapp.frame import Frame, Recovered, compose
from webapp.runs import Runs
from webapp.state import ViewState
from webapp.views.shape import (
    BALL,
    CLEAR,
    LIGHTS,
    NO_SHAPE,
    NOTHING,
    ON,
    POINTS,
    RIM,
    SELECT,
    ShapeView,
    outline_of,
    status_of,
)

# what a widget's change calls may come when the server is gone
pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STACK = render_scene("sphere_obstacles", size=(48, 64), images=9).stack
RESULT = analyze(STACK, Options(T=0.05, Ts=0.02, samples=50))
RECOVERED = Recovered(recover_shape(STACK, RESULT, resolve_ambiguity(RESULT)), RESULT)
FIVE = ((24, 32), (18, 26), (18, 38), (32, 27), (31, 38))


class Calls:
    """How often the tab was told something."""

    def __init__(self) -> None:
        self.changed = self.recovered = 0

    def change(self) -> None:
        self.changed += 1

    def recover(self) -> None:
        self.recovered += 1


@pytest.fixture
def calls() -> Calls:
    return Calls()


@pytest.fixture
def view(calls: Calls) -> Iterator[ShapeView]:
    server = open_server(port=0)
    yield ShapeView(server.server.gui, STACK, calls.change, calls.recover)
    server.stop()


def frame(result: bool = True, recovered: Recovered | None = RECOVERED, **state: object) -> Frame:
    shown = ViewState(**({"T": 0.05, "Ts": 0.02} | state))  # type: ignore[arg-type]
    return compose(
        Runs(STACK, Options()), {"robust": RESULT} if result else {}, shown, None, recovered
    )


def test_the_fifth_point_recovers_and_each_further_one_again(view: ShapeView, calls: Calls) -> None:
    view._known.value = POINTS
    view._begin(ON)
    for n, pixel in enumerate(FIVE, 1):
        assert calls.recovered == 0
        assert view.take(pixel)
        assert f"{n} so far" in view._told.content
    assert calls.recovered == 1
    assert view.take((24, 40))
    assert calls.recovered == 2
    assert view.known().points == (*FIVE, (24, 40))
    assert view.marks[0] == (24, 32, "1")


def test_three_rim_points_set_the_outline(view: ShapeView) -> None:
    view._known.value = POINTS
    before = view.known().sphere
    view._begin(RIM)
    assert view.take((4, 32))
    assert view.take((44, 32))
    assert view.known().sphere == before
    assert view.take((24, 12))
    assert view.known().sphere == (24.0, 32.0, 20.0)
    assert [text for *_, text in view.marks] == ["rim"] * 3


def test_rim_points_on_a_line_change_nothing(view: ShapeView) -> None:
    view._known.value = BALL
    before = view.known().sphere
    view._begin(RIM)
    for column in (10, 20, 30):
        assert view.take((5, column))
    assert view.known().sphere == before


def test_clicks_select_pixels_unless_points_are_being_clicked(
    view: ShapeView, calls: Calls
) -> None:
    assert not view.take((1, 1))
    view._known.value = POINTS
    view._begin(ON)
    assert view.take((1, 1))
    view._begin(SELECT)
    assert not view.take((2, 2))
    assert view.marks == ((1, 1, "1"),)
    view._begin(CLEAR)
    assert view.marks == ()
    assert not view.take((2, 2))
    assert calls.recovered == 0


def test_each_kind_of_knowledge_is_what_it_says(view: ShapeView) -> None:
    assert LIGHTS not in view._known.options
    view._known.value = NOTHING
    assert view.known().sphere is None
    assert view.known().points == ()
    view._known.value = BALL
    assert view.known().sphere == pytest.approx(outline_of(STACK), abs=0.05)
    assert not view.given_lights()


def test_lights_of_the_stack_are_offered_first_where_there_are_some() -> None:
    lit = replace(STACK, lights=np.random.default_rng(0).normal(size=(9, 3)))
    server = open_server(port=0)
    view = ShapeView(server.server.gui, lit, lambda: None, lambda: None)
    assert view.given_lights()
    view._known.value = NOTHING
    assert not view.given_lights()
    server.stop()


def test_a_scale_of_zero_is_none(view: ShapeView) -> None:
    assert view.px_mm() is None
    view._px_mm.value = 0.25
    assert view.px_mm() == 0.25


def test_the_switches_are_part_of_the_state(view: ShapeView) -> None:
    view.draw(frame(recovered=None))
    view.toggle()
    assert not view.read(ViewState()).relief
    view.draw(frame())
    view.toggle()
    assert view.read(ViewState()).relief
    view._arrows.value = False
    assert not view.read(ViewState()).arrows
    view.toggle()
    assert not view.read(ViewState()).relief


def test_a_shape_of_what_is_on_screen_has_no_status() -> None:
    assert status_of(frame()) == ""
    assert status_of(frame(recovered=None)) == ""
    assert status_of(frame(image=3, layer="relit")) == ""


def test_a_shape_of_other_thresholds_says_of_which() -> None:
    assert status_of(frame(T=0.06)) == (
        "This shape is of T 0.0500, Ts 0.0200; recover again to match what is on screen."
    )
    # without following, recovering again would take the same result again
    assert status_of(frame(T=0.06, live=False)) == ""


def test_a_shape_of_another_method_or_of_an_earlier_run_says_so() -> None:
    other = replace(RESULT, options=replace(RESULT.options, method="statistical"))
    of_other = Recovered(RECOVERED.shape, other)
    assert "by the method statistical; recover again" in status_of(frame(recovered=of_other))
    earlier = replace(RESULT, thresholds=Thresholds(0.05, 0.01))
    of_earlier = Recovered(RECOVERED.shape, earlier)
    assert "T 0.0500, Ts 0.0100; recover" in status_of(frame(recovered=of_earlier))
    assert status_of(frame(recovered=of_earlier, result=False)) != ""


def test_the_note_says_how_the_shape_was_found_and_first_that_it_is_of_another_result(
    view: ShapeView,
) -> None:
    view.draw(frame(recovered=None))
    assert NO_SHAPE[:12] in view._note.content
    view.draw(frame())
    assert "recover again" not in view._note.content
    view.draw(frame(T=0.06))
    assert 0 < view._note.content.index("recover again") < view._note.content.index("Normals")


def test_the_outline_has_the_centre_and_the_area_of_the_mask() -> None:
    mask = np.zeros((48, 64), bool)
    rows, columns = np.mgrid[:48, :64]
    mask[(rows - 20) ** 2 + (columns - 30) ** 2 <= 15**2] = True
    row, column, radius = outline_of(replace(STACK, mask=mask))
    assert (row, column) == pytest.approx((20, 30))
    assert radius == pytest.approx(15, abs=0.2)
