"""How a new tab begins: what was kept, what the command line asks, and which of them decides."""

from dataclasses import replace

import pytest

from photolin.analysis import Options
from photolin.factors import Thresholds
from photolin.load import LoadOptions
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp.saved import Saved
from webapp.source import Source
from webapp.start import FIRST, start_from
from webapp.state import ViewState

STACK = render_scene("sphere_cone", size=(16, 20), images=8).stack
RESULT = analyze(STACK, Options(T=0.03, Ts=0.01, samples=50))
KEPT = Saved(
    ViewState(T=0.07, Ts=0.04, image=7, method="statistical", layer="residual"), notes="mine"
)


def test_without_a_session_thresholds_are_the_first_or_those_given_or_of_the_result() -> None:
    assert start_from(Source(STACK), None).state.thresholds == FIRST
    given = start_from(Source(STACK, options=Options(T=0.1)), None)
    assert given.state.thresholds == Thresholds(0.1, FIRST.Ts)
    shown = start_from(Source(STACK, RESULT, RESULT.options), None)
    assert shown.state.thresholds == RESULT.thresholds
    other = start_from(Source(STACK, options=Options(method="statistical")), None)
    assert other.state.method == "statistical"
    without = start_from(Source(STACK, reading=LoadOptions(exclude=(2, 5))), None)
    assert without.exclusions == (2, 5)


def test_a_session_is_taken_as_it_was_kept() -> None:
    assert start_from(Source(STACK), KEPT) == KEPT
    assert start_from(Source(STACK, RESULT, RESULT.options), KEPT) == KEPT


def test_what_the_command_line_says_of_a_stack_goes_before_the_session() -> None:
    asked = Source(
        STACK,
        options=Options(T=0.2, method="classification"),
        reading=LoadOptions(exclude=(1, 2, 3)),
    )
    begun = start_from(asked, KEPT)
    assert begun.state.thresholds == Thresholds(0.2, 0.04)
    assert begun.state.method == "classification"
    assert begun.exclusions == (1, 2, 3)
    assert begun.state.image == 4  # the last of five
    assert (begun.notes, begun.state.layer) == ("mine", "residual")


@pytest.mark.parametrize("exclude", [(), (4,)])
def test_the_session_of_a_result_goes_before_its_own_exclusions(exclude: tuple[int, ...]) -> None:
    kept = replace(KEPT, exclusions=exclude)
    source = Source(STACK, RESULT, RESULT.options, reading=LoadOptions(exclude=(0,)))
    assert start_from(source, kept) == kept


def test_the_image_that_was_shown_stays_when_others_are_left_out() -> None:
    kept = replace(KEPT, state=replace(KEPT.state, image=3), exclusions=(0,))  # image 4 of all
    begun = start_from(Source(STACK, reading=LoadOptions(exclude=(1, 2))), kept)
    assert (begun.state.image, begun.exclusions) == (2, (1, 2))
