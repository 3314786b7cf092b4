"""A sphere that is pointed out, step by step."""

from dataclasses import replace

import pytest

from photolin.analysis import Options
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp.pointed import ENOUGH, FIRST, LINE, ON, RIM, WHOLE, Part, Pointed
from webapp.state import Pixel

GUESS = (30.0, 40.0, 25.0)
THREE = ((4, 32), (44, 32), (24, 12))
OUTLINE = (24.0, 32.0, 20.0)
FIVE = ((24, 32), (18, 26), (18, 38), (32, 27), (31, 38))


def click(pointed: Pointed, *pixels: Pixel) -> Pointed:
    for pixel in pixels:
        pointed = pointed.click(pixel, None)
        assert not pointed.refused
    return pointed


def begin(wanted: Part = ON) -> Pointed:
    return Pointed(GUESS).want(wanted)


def now(pointed: Pointed) -> list[str]:
    return [text for text, do in pointed.steps(flat=True) if do]


# The way through


def test_three_clicks_on_the_rim_set_the_outline_and_points_follow() -> None:
    pointed = begin()
    assert now(pointed) == ["1. Click the rim of the sphere three times: 0 of 3."]
    pointed = click(pointed, *THREE[:2])
    assert (pointed.outline, pointed.guessed, pointed.picking) == (GUESS, True, RIM)
    assert "2 of 3" in now(pointed)[0]
    pointed = click(pointed, THREE[2])
    assert pointed.outline == pytest.approx(OUTLINE)
    assert (pointed.guessed, pointed.picking) == (False, ON)
    for n, pixel in enumerate(FIVE):
        assert now(pointed) == [f"2. Click five points on it, spread wide: {n} of {ENOUGH}."]
        assert not pointed.is_enough
        pointed = click(pointed, pixel)
    assert pointed.is_enough
    assert pointed.points == FIVE
    assert pointed.rim == THREE
    assert now(pointed)[0].startswith("2. 5 points clicked. Each further one recovers")


def test_of_a_whole_sphere_the_rim_is_all_and_more_clicks_correct_it() -> None:
    pointed = click(begin(RIM), *THREE)
    assert pointed.picking == RIM
    assert now(pointed)[-1] == "2. Press Recover shape."
    corrected = click(pointed, (24, 54))
    assert corrected.outline[2] > OUTLINE[2]
    assert corrected.rim == (*THREE, (24, 54))
    refused = corrected.pick(ON)
    assert (refused.picking, refused.refused) == (RIM, WHOLE)


def test_a_guess_is_said_to_be_one_until_it_is_kept_or_corrected() -> None:
    guess = "The dashed outline is a guess from the mask."
    pointed = begin()
    assert guess in dict(pointed.steps(flat=True))
    kept = pointed.keep()
    assert (kept.outline, kept.guessed, kept.picking) == (GUESS, False, ON)
    typed = pointed.set(OUTLINE)
    assert (typed.outline, typed.guessed) == (OUTLINE, False)
    for known in (kept, typed):
        assert guess not in dict(known.steps(flat=True))


def test_points_wait_for_an_outline() -> None:
    pointed = begin().pick(ON)
    assert (pointed.picking, pointed.refused) == (RIM, FIRST)
    assert click(pointed, THREE[0]).points == ()


def test_asking_again_goes_on_where_it_was_left() -> None:
    pointed = click(begin(), *THREE, FIVE[0])
    away = pointed.want(None)
    assert away.picking is None
    assert away.want(ON) == pointed
    assert away.want(RIM).picking is None
    assert away.want(RIM).points == pointed.points


def test_in_3d_it_is_said_that_clicks_select() -> None:
    lines = begin().steps(flat=False)
    assert ("In 3D clicks select pixels.", False) in lines
    assert not any(do for _, do in lines)
    selecting = click(begin(), *THREE).pick(None)
    assert "Clicks on the picture select pixels." in dict(selecting.steps(flat=True))


# One step back


def test_undo_takes_back_click_by_click_to_the_beginning() -> None:
    states = [begin()]
    for pixel in (*THREE, *FIVE):
        states.append(click(states[-1], pixel))
    pointed = states[-1]
    for earlier in reversed(states[:-1]):
        pointed = pointed.undo()
        assert (pointed.outline, pointed.guessed) == (earlier.outline, earlier.guessed)
        assert pointed.clicks == earlier.clicks
    assert pointed.picking == RIM
    assert pointed.undo() == pointed


def test_undo_of_a_click_on_the_rim_gives_back_what_was_typed_before() -> None:
    pointed = click(begin().set(OUTLINE), *THREE[:2], (24, 54))
    assert pointed.outline != OUTLINE
    assert (pointed.undo().outline, pointed.undo().guessed) == (OUTLINE, False)


# What is refused


@pytest.mark.parametrize("pixel", [(2, 2), (24, 52), (44, 32), (24, 12)])
def test_a_point_on_or_outside_the_outline_is_refused_and_not_kept(pixel: Pixel) -> None:
    pointed = click(begin(), *THREE, FIVE[0])
    refused = pointed.click(pixel, None)
    assert refused.clicks == pointed.clicks
    assert refused.refused.startswith(f"Row {pixel[0]}, column {pixel[1]} is outside the outline.")
    assert not click(refused, FIVE[1]).refused


def test_the_same_pixel_is_taken_once() -> None:
    pointed = click(begin(), THREE[0])
    assert "was clicked before" in pointed.click(THREE[0], None).refused
    pointed = click(begin(), *THREE, FIVE[0])
    again = pointed.click(FIVE[0], None)
    assert "was clicked before" in again.refused
    assert again.points == (FIVE[0],)


def test_clicks_on_a_line_set_no_outline_and_a_fourth_beside_it_does() -> None:
    pointed = click(begin(), (5, 10), (5, 20)).click((5, 30), None)
    assert pointed.refused == LINE
    assert (pointed.outline, pointed.guessed, pointed.picking) == (GUESS, True, RIM)
    pointed = click(pointed, (15, 20))
    assert (pointed.guessed, pointed.picking) == (False, ON)


def test_a_pixel_without_linearized_values_is_no_point() -> None:
    stack = render_scene("sphere_obstacles", size=(48, 64), images=9).stack
    result = analyze(stack, Options(T=0.05, Ts=0.02, samples=50))
    bases = result.linearized_bases.copy()
    bases[:, 24, 32], bases[:, 18, 26] = float("nan"), 0
    pointed = click(begin(), *THREE)
    for pixel in FIVE[:2]:
        found = pointed.click(pixel, replace(result, linearized_bases=bases))
        assert "has no value: it is masked, or lit in too few images" in found.refused
        assert found.points == ()
        assert pointed.click(pixel, result).points == (pixel,)
