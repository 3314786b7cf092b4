"""A rectangle of pixels, as the page tells of it."""

import re
from typing import NamedTuple

from .state import Pixel


class Box(NamedTuple):
    """Rows row0 to row1 and columns column0 to column1, half-open."""

    row0: int
    row1: int
    column0: int
    column1: int


def box_in_text(text: str, shape: tuple[int, int]) -> Box | None:
    """The box that the page wrote as "row0,row1,column0,column1"; None unless of the picture."""
    found = re.fullmatch(r"([0-9]{1,6}),([0-9]{1,6}),([0-9]{1,6}),([0-9]{1,6})", text, re.ASCII)
    if found is None:
        return None
    row0, row1, column0, column1 = map(int, found.groups())
    inside = row0 < row1 <= shape[0] and column0 < column1 <= shape[1]
    return Box(row0, row1, column0, column1) if inside else None


def box_around(pixel: Pixel, reach: int, shape: tuple[int, int]) -> Box:
    """The pixels within `reach` rows and columns of one, as far as there are any."""
    (row, column), (rows, columns) = pixel, shape
    return Box(
        max(row - reach, 0),
        min(row + reach + 1, rows),
        max(column - reach, 0),
        min(column + reach + 1, columns),
    )
