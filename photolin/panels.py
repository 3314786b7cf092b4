"""Panels with captions under them on one white sheet."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from PIL.PngImagePlugin import PngInfo

from .factors import LETTERS, PALETTE, TITLES

GAP, SIZE, LINE = 16, 14, 18
"""Space between panels, height of letters and of lines, pixels."""
FRAME = (160, 160, 160)
"""Colour of the line around a panel, which may be white at its borders."""

Picture = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Panel:
    """A part of a figure."""

    picture: Picture
    """(h,w,3)"""
    caption: str


def compose_sheet(rows: Sequence[Sequence[Panel]], text: str, *, legend: bool) -> bytes:
    """PNG of rows of panels, each with its caption under it, and of a text under all.

    Text and captions are in the chunk Description too.

    Args:
        rows: panels from left to right; those in one column are equally wide.
        legend: tell the colours of the classes before the text.
    """
    font = ImageFont.load_default(SIZE)
    sizes = [[panel.picture.shape for panel in row] for row in rows]
    columns = [max(row[n][1] for row in sizes if n < len(row)) for n in range(max(map(len, rows)))]
    width = sum(columns) + GAP * (len(columns) + 1)
    captions = [[wrap_text(p.caption, font, columns[n]) for n, p in enumerate(row)] for row in rows]
    below = wrap_text(text, font, width - 2 * GAP)
    keys = [f"{LETTERS[factor]} {TITLES[factor]}" for factor in LETTERS] if legend else []
    places = _flow([font.getlength(key) + 2 * SIZE for key in keys], width - 2 * GAP)
    heights = [
        max(p.picture.shape[0] for p in row) + LINE * max(map(len, lines)) + GAP
        for row, lines in zip(rows, captions, strict=True)
    ]
    keyed = LINE * (places[-1][1] + 1) + GAP // 2 if places else 0
    height = GAP + sum(heights) + keyed + LINE * len(below) + GAP
    sheet = Image.new("RGB", (width, height), "white")
    draw = ImageDraw.Draw(sheet)
    y = GAP
    for row, lines, tall in zip(rows, captions, heights, strict=True):
        for n, panel in enumerate(row):
            h, w, _ = panel.picture.shape
            x = GAP + sum(columns[:n]) + GAP * n
            sheet.paste(Image.fromarray(panel.picture), (x, y))
            draw.rectangle((x - 1, y - 1, x + w, y + h), outline=FRAME)
            _write(draw, (x, y + h + 2), lines[n], font)
        y += tall
    for factor, key, (x, line) in zip(LETTERS, keys, places, strict=False):
        left, top = GAP + x, y + line * LINE
        draw.rectangle((left, top + 3, left + 10, top + 13), fill=PALETTE[factor])
        _write(draw, (left + SIZE, top), [key], font)
    _write(draw, (GAP, y + keyed), below, font)
    told = PngInfo()
    told.add_itxt("Description", " ".join([text, *(p.caption for row in rows for p in row)]))
    buffer = io.BytesIO()
    sheet.save(buffer, "PNG", pnginfo=told)
    return buffer.getvalue()


def wrap_text(text: str, font: Any, width: int) -> list[str]:
    """Lines of a text no wider than `width` pixels, as far as its words are not."""
    lines = [""]
    for word in text.replace(" %", "\xa0%").split(" "):
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and font.getlength(longer) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


def _write(draw: ImageDraw.ImageDraw, at: tuple[int, int], lines: Sequence[str], font: Any) -> None:
    for n, line in enumerate(lines):
        draw.text((at[0], at[1] + n * LINE), line, "black", font)


def _flow(widths: Sequence[float], width: int) -> list[tuple[int, int]]:
    """(x, line) of things that are set one after the other, and on the next line where one ends."""
    places: list[tuple[int, int]] = []
    x, line = 0.0, 0
    for one in widths:
        if x and x + one > width:
            x, line = 0.0, line + 1
        places.append((round(x), line))
        x += one
    return places
