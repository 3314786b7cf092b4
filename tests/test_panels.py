"""Sheets of panels: every panel pixel by pixel, captions under them, the same bytes each time."""

import io

import numpy as np
from PIL import Image, ImageFont

from photolin.factors import PALETTE, Factor
from photolin.panels import GAP, SIZE, Panel, compose_sheet, wrap_text

RNG = np.random.default_rng(0)


def panel(h: int, w: int, caption: str) -> Panel:
    return Panel(RNG.integers(0, 256, (h, w, 3)).astype(np.uint8), caption)


def test_panels_are_on_the_sheet_unchanged_from_left_to_right_and_down() -> None:
    rows = [[panel(40, 200, "(a) one"), panel(40, 210, "(b) two")], [panel(50, 200, "(c) three")]]
    data = compose_sheet(rows, "Words under all.", legend=False)
    assert data == compose_sheet(rows, "Words under all.", legend=False)
    image = Image.open(io.BytesIO(data))
    sheet = np.asarray(image)
    assert sheet.shape[1] == 200 + 210 + 3 * GAP
    np.testing.assert_array_equal(sheet[GAP : GAP + 40, GAP : GAP + 200], rows[0][0].picture)
    left = 2 * GAP + 200
    np.testing.assert_array_equal(sheet[GAP : GAP + 40, left : left + 210], rows[0][1].picture)
    found = [
        top
        for top in range(GAP + 40, len(sheet) - 50)
        if np.array_equal(sheet[top : top + 50, GAP : GAP + 200], rows[1][0].picture)
    ]
    assert len(found) == 1
    assert image.info["Description"] == "Words under all. (a) one (b) two (c) three"


def test_a_caption_is_ink_under_its_own_panel_and_nowhere_else() -> None:
    rows = [[panel(30, 200, "(a) words"), panel(30, 200, "")]]
    sheet = np.asarray(Image.open(io.BytesIO(compose_sheet(rows, "", legend=False))))
    below = sheet[GAP + 30 + 1 :]
    assert (below[:, GAP : GAP + 200] < 100).any()
    assert (below[:, 2 * GAP + 200 :] == 255).all()
    assert (sheet[-1] == 255).all()  # nothing is cut off


def test_a_legend_has_every_class_in_its_colour() -> None:
    rows = [[Panel(np.full((30, 120, 3), 255, np.uint8), "")]]
    for legend in (True, False):
        sheet = np.asarray(Image.open(io.BytesIO(compose_sheet(rows, "", legend=legend))))
        for factor in Factor:
            assert (sheet == PALETTE[factor]).all(axis=2).any() == legend


def test_lines_are_no_wider_than_asked_and_lose_no_word() -> None:
    font = ImageFont.load_default(SIZE)
    text = "Many words of several lengths, 12.50 % of them long"
    lines = wrap_text(text, font, 120)
    assert len(lines) > 2
    assert all(font.getlength(line) <= 120 for line in lines)
    assert " ".join(lines).replace("\xa0", " ") == text
    assert wrap_text("unbreakable-and-wide", font, 10) == ["unbreakable-and-wide"]
