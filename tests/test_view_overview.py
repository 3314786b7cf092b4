"""The view of all images without a page: what it asks for."""

from collections.abc import Iterator
from unittest.mock import MagicMock

import pytest

from photolin.synthetic import render_scene
from webapp.frame import compose
from webapp.runs import Runs
from webapp.state import ViewState
from webapp.views.overview import OverviewView

STACK = render_scene("sphere_cone", size=(16, 20), images=8).stack


class Wishes:
    """What is left out, as a tab keeps it; the frame follows later."""

    def __init__(self) -> None:
        self.out: set[int] = set()

    def exclude(self, image: int, out: bool) -> None:
        (self.out.add if out else self.out.discard)(image)


def refuse(error: Exception) -> None:
    raise error


@pytest.fixture
def wishes() -> Wishes:
    return Wishes()


@pytest.fixture
def view(wishes: Wishes) -> Iterator[OverviewView]:
    made = OverviewView(
        *(MagicMock(), MagicMock(), STACK, MagicMock()),
        *(lambda: None, wishes.exclude, refuse),
    )
    made.draw(compose(Runs(STACK, MagicMock()), {}, ViewState(image=3)))
    yield made
    made.close()


def test_leaving_the_image_shown_out_twice_before_it_is_gone_is_leaving_it_out_once(
    view: OverviewView, wishes: Wishes
) -> None:
    view.leave_out()
    view.leave_out()
    assert wishes.out == {3}
    view._choose("toggle", 5)
    view._choose("toggle", 5)
    assert wishes.out == {3, 5}


def test_taking_all_in_takes_those_in_too_that_are_only_just_left_out(
    view: OverviewView, wishes: Wishes
) -> None:
    view.leave_out()
    view.take_all_in()
    assert wishes.out == set()
    view.take_all_in()
    assert wishes.out == set()
