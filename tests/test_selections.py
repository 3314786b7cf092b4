"""The stack without some of its images, as tabs ask for it."""

import numpy as np
import pytest

from photolin.analysis import Options
from photolin.errors import OptionError
from photolin.load import LoadOptions
from photolin.load.exclude import exclude_images
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp.selections import KEPT, Selections, follow_image
from webapp.source import Source

SCENE = render_scene("sphere_cone", size=(16, 20), images=9)
OPTIONS = Options(T=0.05, Ts=0.02, samples=50)
RESULT = analyze(SCENE.stack, OPTIONS)


def test_without_exclusions_it_is_the_stack_itself_with_its_result() -> None:
    runs = Selections(Source(SCENE.stack, RESULT, OPTIONS)).without(())
    assert runs.stack is SCENE.stack
    assert runs.result is RESULT
    assert runs.excluded == ()


def test_what_is_left_has_its_own_images_and_truth_and_no_result_of_others() -> None:
    selections = Selections(Source(SCENE.stack, RESULT, OPTIONS, truth=SCENE.truth.labels))
    runs = selections.without((0, 4))
    left = [1, 2, 3, 5, 6, 7, 8]
    assert np.array_equal(runs.stack.images, SCENE.stack.images[left])
    assert runs.truth is not None
    assert np.array_equal(runs.truth, SCENE.truth.labels[left])
    assert runs.result is None
    assert runs.options == OPTIONS


def test_a_result_of_some_images_is_shown_with_these() -> None:
    result = analyze(exclude_images(SCENE.stack, [3]), OPTIONS)
    source = Source(SCENE.stack, result, OPTIONS, reading=LoadOptions(exclude=(3,)))
    selections = Selections(source)
    assert selections.without((3,)).result is result
    assert selections.without(()).result is None


def test_tabs_share_a_selection_and_old_ones_are_let_go() -> None:
    selections = Selections(Source(SCENE.stack))
    first = selections.without((1,))
    assert selections.without((1,)) is first
    for k in range(2, 2 + KEPT):
        selections.without((k,))
    assert selections.without((1,)) is not first


@pytest.mark.parametrize(
    ("excluded", "words"),
    [((9,), "images 0 to 8"), ((0, 1, 2, 3), "leaves 5 of 9 images")],
)
def test_too_many_or_unknown_images_are_refused(excluded: tuple[int, ...], words: str) -> None:
    with pytest.raises(OptionError, match=words):
        Selections(Source(SCENE.stack)).without(excluded)


@pytest.mark.parametrize(
    ("excluded", "expected"),
    [((0,), (0, 3, 5)), ((), (1, 4, 6)), ((2, 5), (1, 3, 4)), ((0, 1), None), ((6,), None)],
)
def test_base_images_that_were_asked_for_stay_the_same_images_or_are_chosen_anew(
    excluded: tuple[int, ...], expected: tuple[int, int, int] | None
) -> None:
    options = Options(T=0.05, Ts=0.02, base_images=(0, 3, 5))  # images 1, 4, 6 of all
    reading = LoadOptions(exclude=(0,))
    runs = Selections(Source(SCENE.stack, None, options, reading=reading)).without(excluded)
    assert runs.options.base_images == expected


def test_an_image_is_followed_to_its_new_number_or_to_that_of_the_next() -> None:
    assert follow_image(8, 3, (), (0, 2)) == 1
    assert follow_image(8, 1, (0, 2), ()) == 3
    assert follow_image(8, 3, (), (3,)) == 3
    assert follow_image(8, 7, (), (7,)) == 6
    assert follow_image(8, 99, (0,), (0,)) == 6
