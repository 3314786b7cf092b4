"""Rectangles of pixels: what the page may say, and what a click reaches."""

import pytest

from webapp.box import Box, box_around, box_in_text


@pytest.mark.parametrize(
    "text",
    [
        "",
        "0,1,2",
        "0,1,2,3,4",
        "-1,5,0,5",
        "0,61,0,80",
        "0,60,0,81",
        "5,5,0,80",
        "6,5,0,80",
        "0,60,80,80",
        "0,60,9,3",
        "0,60,0,8e1",
        "0,60,0,8.5",
        " 0,60,0,80",
        "0,60,0,80\n",
        "0,60,0,٣",
        "0,nan,0,80",
        "0,60,0,9999999",
        "9" * 4000,
    ],
)
def test_a_text_that_is_no_box_of_the_picture_is_none(text: str) -> None:
    assert box_in_text(text, (60, 80)) is None


@pytest.mark.parametrize("box", [Box(0, 60, 0, 80), Box(59, 60, 79, 80), Box(3, 7, 2, 5)])
def test_a_box_is_read_as_the_page_writes_it(box: Box) -> None:
    assert box_in_text(",".join(map(str, box)), (60, 80)) == box


def test_a_click_reaches_as_far_on_all_sides_up_to_the_border() -> None:
    assert box_around((20, 30), 2, (60, 80)) == Box(18, 23, 28, 33)
    assert box_around((20, 30), 0, (60, 80)) == Box(20, 21, 30, 31)
    assert box_around((0, 79), 7, (60, 80)) == Box(0, 8, 72, 80)
    assert box_around((59, 0), 100, (60, 80)) == Box(0, 60, 0, 80)
