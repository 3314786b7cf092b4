"""The Shape tab: what clicks make known, and what it says of the shape."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from photolin.analysis import Options
from photolin.errors import InputError, OptionError
from photolin.factors import Thresholds
from photolin.pipeline import analyze
from photolin.shape.known import Known
from photolin.shape.recover import recover_shape
from photolin.shape.resolve import resolve_ambiguity
from photolin.shape.resolved import Kind, Resolved
from photolin.synthetic import render_scene
from webapp.access import open_server
from webapp.frame import Frame, Recovered, compose
from webapp.runs import Runs
from webapp.state import ViewState
from webapp.views import ATTENTION
from webapp.views.shape import (
    BALL,
    LIGHTS,
    MANY,
    NO_SHAPE,
    NORMALS,
    NOTHING,
    POINTS,
    SOME,
    ShapeView,
    outline_in_note,
    status_of,
)

# what a widget's change calls may come when the server is gone
pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STACK = render_scene("sphere_obstacles", size=(48, 64), images=9).stack
RESULT = analyze(STACK, Options(T=0.05, Ts=0.02, samples=50))
RECOVERED = Recovered(recover_shape(STACK, RESULT, resolve_ambiguity(RESULT)), RESULT)
FIVE = ((24, 32), (18, 26), (18, 38), (32, 27), (31, 38))


def nothing(*_: object) -> None:
    """Nobody is told."""


@pytest.fixture
def view() -> Iterator[ShapeView]:
    server = open_server(port=0)
    made = ShapeView(server.server.gui, STACK, nothing, nothing, nothing, nothing, nothing)
    made.see(True)
    yield made
    server.stop()


def frame(result: bool = True, recovered: Recovered | None = RECOVERED, **state: object) -> Frame:
    shown = ViewState(**({"T": 0.05, "Ts": 0.02} | state))  # type: ignore[arg-type]
    return compose(
        Runs(STACK, Options()), {"robust": RESULT} if result else {}, shown, None, recovered
    )


def want(view: ShapeView, kind: str) -> None:
    view._known.value = kind
    view._arrange()  # the widget tells it a little later


def test_each_kind_of_knowledge_is_what_it_says(view: ShapeView) -> None:
    assert LIGHTS not in view._known.options
    want(view, NOTHING)
    assert view.known() == Known()
    view._sphere.set((24.0, 32.0, 20.0))
    want(view, BALL)
    assert view.known() == Known((24.0, 32.0, 20.0))
    want(view, POINTS)
    for pixel in FIVE:
        assert view.take(pixel)
    assert view.known() == Known((24.0, 32.0, 20.0), FIVE)
    assert not view.given_lights()


@pytest.mark.parametrize("kind", [POINTS, BALL])
def test_an_outline_that_is_only_guessed_is_not_known(view: ShapeView, kind: str) -> None:
    want(view, kind)
    with pytest.raises(OptionError, match=r"outline of the sphere is not set\. First the outline"):
        view.known()


def test_lines_of_normals_and_of_lights_are_read_as_from_a_file(view: ShapeView) -> None:
    want(view, NORMALS)
    view._list.value = "row column x y z\n1 2 0 0 1\n30 4 0.6 0 0.8\n"
    assert view.known() == Known(points=((1, 2), (30, 4)), normals=((0, 0, 1), (0.6, 0, 0.8)))
    want(view, SOME)
    first, second = STACK.names[:2]
    view._list.value = f"{second} 0 0 2\n{first} 0 1 1"
    assert view.known() == Known(images=(1, 0), lights=((0, 0, 2), (0, 1, 1)), powers=True)


def test_a_list_that_cannot_be_read_names_its_line(view: ShapeView) -> None:
    want(view, NORMALS)
    with pytest.raises(InputError, match=r"^the list: holds no points; lines of row column x y z"):
        view.known()
    view._list.value = "1 2 0 0 1\n3 4 zero 0 1"
    with pytest.raises(InputError, match=r"^the list, line 2: '3 4 zero 0 1' is no point"):
        view.known()
    want(view, SOME)
    view._list.value = "nobody.png 0 0 1"
    with pytest.raises(InputError, match=r"^the list: 'nobody\.png' is no image of the stack"):
        view.known()


def test_lights_are_those_of_the_images_that_are_left(view: ShapeView) -> None:
    left = replace(STACK, images=STACK.images[3:], names=STACK.names[3:])
    view.draw(replace(frame(), stack=left))
    want(view, SOME)
    view._list.value = f"{STACK.names[3]} 0 0 1"
    assert view.known().images == (0,)


def test_widgets_of_a_sphere_and_of_lists_are_there_when_they_mean_something(
    view: ShapeView,
) -> None:
    for kind, sphere, lines in (
        (NOTHING, False, False),
        (POINTS, True, False),
        (BALL, True, False),
        (NORMALS, False, True),
        (SOME, False, True),
    ):
        want(view, kind)
        assert (view._sphere._pick.visible, view._list.visible) == (sphere, lines)


def test_in_3d_and_out_of_view_clicks_select_pixels(view: ShapeView) -> None:
    view.draw(frame())
    want(view, POINTS)
    assert view.take((4, 32))
    view.see(False)
    assert not view.take((44, 32))
    view.see(True)
    view._sphere.see(flat=False)
    assert not view.take((44, 32))
    view._sphere.see(flat=True)
    assert view.take((44, 32))
    assert view._sphere.pointed.rim == ((4, 32), (44, 32))


NOTE = (
    "resolved by a sphere at row 59.5, column -7.25e-05, radius 1.5e+06 pixels: half of its 30 "
    "pixels fit within 0.20 degrees"
)


@pytest.mark.parametrize(
    ("kind", "shown"),
    [("points", POINTS), ("sphere", BALL), ("some lights", SOME), ("integrability", NOTHING)],
)
def test_what_was_known_of_a_loaded_shape_is_set_as_far_as_it_tells(
    view: ShapeView, kind: Kind, shown: str
) -> None:
    resolved = Resolved(np.eye(3), kind, 0.2, False, NOTE)
    view.recall(resolved, 0.25)
    assert view._known.value == shown
    assert view.px_mm() == 0.25
    assert view._sphere.pointed.guessed == (kind != "sphere")
    if kind == "sphere":
        assert view._sphere.pointed.outline == pytest.approx((59.5, -7.25e-05, 1.5e6))


def test_the_outline_in_a_note_is_that_of_the_sphere_that_was_given() -> None:
    known = Known((23.5, 31.5, 19.0625))
    found = outline_in_note(resolve_ambiguity(RESULT, known))
    assert found == known.sphere
    assert outline_in_note(resolve_ambiguity(RESULT)) is None


def test_a_misfit_asks_for_attention_before_the_sentence(view: ShapeView) -> None:
    view.draw(frame())
    assert ATTENTION not in view._note.content
    found = RECOVERED.shape
    for residual, doubted in ((1.4, False), (1.6, True)):
        resolved = Resolved(np.eye(3), "sphere", residual, False, NOTE)
        view.draw(frame(recovered=Recovered(replace(found, resolved=resolved), RESULT)))
        assert (ATTENTION in view._note.content) is doubted
    assert view._note.content.index("the outline may be wrong") < view._note.content.index(
        "Normals"
    )


def test_doubts_of_a_shape_ask_for_attention(view: ShapeView) -> None:
    doubted = replace(RECOVERED.shape.resolved, doubts=("the axes seem turned",))
    shape = replace(RECOVERED.shape, resolved=doubted)
    view.draw(frame(recovered=Recovered(shape, RESULT)))
    assert ATTENTION in view._note.content
    assert view._note.content.index("The axes seem turned") < view._note.content.index("Normals")


def test_lights_of_the_stack_are_offered_first_where_there_are_some() -> None:
    lit = replace(STACK, lights=np.random.default_rng(0).normal(size=(9, 3)))
    server = open_server(port=0)
    view = ShapeView(server.server.gui, lit, nothing, nothing, nothing, nothing, nothing)
    assert view.given_lights()
    view._known.value = NOTHING
    assert not view.given_lights()
    server.stop()


def test_many_lights_are_not_drawn_unless_asked_for(view: ShapeView) -> None:
    assert view.read(ViewState()).arrows
    many = render_scene("sphere_obstacles", size=(24, 32), images=MANY + 1).stack
    server = open_server(port=0)
    other = ShapeView(server.server.gui, many, nothing, nothing, nothing, nothing, nothing)
    assert not other.read(ViewState()).arrows
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
