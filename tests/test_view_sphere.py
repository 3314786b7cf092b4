"""The widgets with which a sphere is pointed out."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from photolin.synthetic import render_scene
from webapp.access import open_server
from webapp.pointed import FIRST, ON, RIM
from webapp.sketch import Sketch
from webapp.views import ATTENTION
from webapp.views.sphere import CLEAR, SELECT, UNDO, SphereView, outline_of

# what a widget's change calls may come when the server is gone
pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STACK = render_scene("sphere_obstacles", size=(48, 64), images=9).stack
THREE = ((4, 32), (44, 32), (24, 12))
FIVE = ((24, 32), (18, 26), (18, 38), (32, 27), (31, 38))


@dataclass
class Tab:
    """What the tab was told."""

    recovered: int = 0
    retracted: int = 0
    sketches: list[Sketch | None] = field(default_factory=list)

    def recover(self) -> None:
        self.recovered += 1

    def retract(self) -> None:
        self.retracted += 1


@pytest.fixture
def tab() -> Tab:
    return Tab()


@pytest.fixture
def view(tab: Tab) -> Iterator[SphereView]:
    server = open_server(port=0)
    made = SphereView(server.server.gui, STACK, tab.recover, tab.retract, tab.sketches.append)
    made.see(in_view=True)
    yield made
    server.stop()


def numbers(view: SphereView) -> tuple[float, ...]:
    return tuple(number.value for number in view._numbers)


def test_the_fifth_point_recovers_and_each_further_one_and_each_correction_again(
    view: SphereView, tab: Tab
) -> None:
    view.want(ON)
    for pixel in (*THREE, *FIVE):
        assert tab.recovered == 0
        assert view.take(pixel)
    assert tab.recovered == 1
    assert view.take((24, 40))
    assert tab.recovered == 2
    view.press(RIM)
    assert view.take((24, 53))
    assert tab.recovered == 3
    for _ in range(2):
        view.press(UNDO)
    assert tab.recovered == 5
    view.press(UNDO)
    assert tab.recovered == 5
    assert "4 of 5" in view._steps.content.replace("&#58;", ":")
    assert tab.retracted == 3 + 5 + 2 + 3


def test_a_refused_click_is_told_and_starts_nothing(view: SphereView, tab: Tab) -> None:
    view.want(ON)
    for pixel in (*THREE, *FIVE):
        view.take(pixel)
    before, calls = view.pointed, (tab.recovered, tab.retracted)
    assert view.take((2, 2))
    assert view.pointed.clicks == before.clicks
    assert (tab.recovered, tab.retracted) == calls
    assert ATTENTION in view._steps.content
    assert "Row 2, column 2 is outside the outline".replace(",", "&#44;") in view._steps.content
    assert view.take((24, 40))
    assert ATTENTION not in view._steps.content


def test_numbers_and_sketch_follow_the_rim_and_the_sketch_the_numbers(
    view: SphereView, tab: Tab
) -> None:
    view.want(ON)
    guess = outline_of(STACK)
    assert tab.sketches[-1] == Sketch(pytest.approx(guess, abs=0.05), True)  # type: ignore[arg-type]
    for pixel in THREE:
        view.take(pixel)
    assert numbers(view) == (24, 32, 20)
    assert tab.sketches[-1] == Sketch((24, 32, 20), False, THREE)
    view._numbers[2].value = 21.5
    view._measure()  # as when someone has typed it
    assert tab.sketches[-1] == Sketch((24, 32, 21.5), False, THREE)
    view.take(FIVE[0])
    assert tab.sketches[-1] == Sketch((24, 32, 21.5), False, THREE, (FIVE[0],))


def test_the_sketch_is_there_only_while_it_is_wanted_and_in_view(
    view: SphereView, tab: Tab
) -> None:
    assert tab.sketches == []
    view.want(ON)
    view.see(in_view=False)
    assert tab.sketches[-1] is None
    view.see(in_view=True)
    assert tab.sketches[-1] is not None
    for pixel in (*THREE, FIVE[0]):
        view.take(pixel)
    view.want(RIM)
    assert tab.sketches[-1] == Sketch((24, 32, 20), False, THREE)
    view.want(None)
    assert tab.sketches[-1] is None


def test_points_before_the_outline_ask_for_it(view: SphereView) -> None:
    view.want(ON)
    view.press(ON)
    assert FIRST.split(":")[0] in view._steps.content
    view.take(THREE[0])
    assert view.pointed.rim == (THREE[0],)


def test_the_guess_can_be_kept_as_long_as_it_is_one(view: SphereView) -> None:
    view.want(ON)
    assert view._keep.visible
    for pixel in THREE:
        view.take(pixel)
    assert not view._keep.visible
    for _ in THREE:
        view.press(UNDO)
    assert view._keep.visible
    assert numbers(view) == pytest.approx(outline_of(STACK), abs=0.05)


def test_select_gives_clicks_back_and_clear_begins_anew(view: SphereView, tab: Tab) -> None:
    view.want(ON)
    for pixel in (*THREE, FIVE[0]):
        view.take(pixel)
    view.press(SELECT)
    assert not view.take(FIVE[1])
    view.press(CLEAR)
    assert view.pointed.clicks == ()
    assert view.pointed.guessed
    assert numbers(view) == pytest.approx(outline_of(STACK), abs=0.05)
    assert tab.sketches[-1] == replace(tab.sketches[0], points=())  # type: ignore[type-var]
    assert view.take(THREE[0])
    assert view.pointed.rim == (THREE[0],)


def test_points_without_values_in_the_result_shown_are_refused(view: SphereView) -> None:
    view.want(ON)
    view.set((24.0, 32.0, 20.0))
    view.press(ON)
    bases = np.full((3, 48, 64), np.nan, np.float32)
    view.draw(SimpleNamespace(analysis=SimpleNamespace(linearized_bases=bases)))  # type: ignore[arg-type]
    view.take(FIVE[0])
    assert view.pointed.points == ()
    view.draw(SimpleNamespace(analysis=None))  # type: ignore[arg-type]
    view.take(FIVE[0])
    assert view.pointed.points == (FIVE[0],)


def test_the_outline_has_the_centre_and_the_area_of_the_mask() -> None:
    mask = np.zeros((48, 64), bool)
    rows, columns = np.mgrid[:48, :64]
    mask[(rows - 20) ** 2 + (columns - 30) ** 2 <= 15**2] = True
    row, column, radius = outline_of(replace(STACK, mask=mask))
    assert (row, column) == pytest.approx((20, 30))
    assert radius == pytest.approx(15, abs=0.2)
