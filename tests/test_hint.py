"""What a first visitor is told."""

from photolin.factors import LETTERS, TITLES, css_colour
from webapp.hint import HINT


def test_each_class_is_named_once_in_its_own_colour() -> None:
    assert [part for part in HINT if part[1] is not None] == [
        (TITLES[factor], css_colour(factor)) for factor in LETTERS
    ]


def test_three_sentences_say_what_colours_mean_what_to_move_and_what_to_click() -> None:
    sentences = "".join(text for text, _ in HINT).rstrip(".").split(". ")
    assert [sentence.split()[0] for sentence in sentences] == ["Colours", "Move", "Click"]
