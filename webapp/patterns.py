"""Patterns that tell the classes apart without colours. Pure.

Each class has a tile that is repeated over the picture: S dots, A horizontal lines, C vertical
lines, U crossed diagonals, D nothing. Marks are white in shadows, which are dark, and black in
highlights and what is undefined, so that they are seen on the pixels that have these labels.
"""

import functools

import numpy as np
from numpy.typing import NDArray

from photolin.factors import Factor

MARK = 8
"""Added to the code of a class where its pattern has a mark."""
MARKS = {
    Factor.SPECULAR: (0, 0, 0),
    Factor.ATTACHED: (255, 255, 255),
    Factor.CAST: (255, 255, 255),
    Factor.UNDEFINED: (0, 0, 0),
}
"""sRGB of the marks of each class that has some."""
STRENGTH = 1.6
"""Opacity of marks, of that of their class; 1 at the most."""
TILE = 8
FINEST = 640
"""Length of a picture's longer side, pixels, up to which a mark is one pixel wide."""


def add_marks(labels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(H,W): labels, plus MARK at the marks of their classes; other codes stay as they are.

    Tiles are 8 by 8 pixels; in pictures longer than FINEST they are as many times larger as they
    must be to look the same when the picture is fitted into a window.
    """
    H, W = labels.shape
    return labels + (_bits(H, W) >> labels & np.uint8(1)) * np.uint8(MARK)


@functools.lru_cache(maxsize=2)
def _bits(H: int, W: int) -> NDArray[np.uint8]:
    """(H,W): at each pixel the classes that have a mark there, class f as bit f."""
    row, column = np.mgrid[:TILE, :TILE]
    marks = {
        Factor.SPECULAR: (row % 4 < 2) & (column % 4 < 2) & ((row // 4 + column // 4) % 2 == 0),
        Factor.ATTACHED: row % 4 == 0,
        Factor.CAST: column % 4 == 0,
        Factor.UNDEFINED: (row == column) | (row == (TILE - column) % TILE),
    }
    tile = np.zeros((TILE, TILE), np.uint8)
    for factor, marked in marks.items():
        tile[marked] |= 1 << factor
    width = max(1, round(max(H, W) / FINEST))
    tile = tile.repeat(width, axis=0).repeat(width, axis=1)
    side = len(tile)
    return np.tile(tile, (-(-H // side), -(-W // side)))[:H, :W]
