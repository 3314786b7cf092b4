"""All images of a stack as one small picture, for a grid of thumbnails. Pure."""

import base64
from dataclasses import dataclass
from math import ceil, isqrt

import numpy as np
from numpy.typing import NDArray

from photolin.analysis import Cancel
from photolin.errors import Cancelled
from photolin.stack import ImageStack

from .render import choose_gain, encode_jpeg, render_input

SIDE, LEAST = 96, 16
"""Pixels of the longer side of a thumbnail, at most and at least."""
MOST = 1_000_000
"""Pixels of all thumbnails together; large stacks get smaller ones."""
COLUMNS = 16
QUALITY = 75
"""Of the JPEG."""


@dataclass(frozen=True)
class Sheet:
    """Thumbnails side by side, up to COLUMNS in a row."""

    url: str
    """Of the picture, with all its data."""
    size: tuple[int, int]
    """(rows, columns) of one thumbnail, pixels."""
    grid: tuple[int, int]
    """Thumbnails (below each other, beside each other)."""
    gain: float
    """How many times brighter than stored all are."""

    def place(self, image: int) -> str:
        """Where an image is, as CSS says it of a background that `self.css` sizes."""
        parts = (image % self.grid[1], self.grid[1]), (image // self.grid[1], self.grid[0])
        return " ".join(f"{100 * n / max(count - 1, 1):.5g}%" for n, count in parts)

    @property
    def css(self) -> str:
        """Declarations that make the sheet the background of an element, one thumbnail large."""
        down, across = (100 * count for count in self.grid)
        height, width = self.size
        return (
            f"background-image:url({self.url});background-size:{across}% {down}%;"
            f"aspect-ratio:{width}/{height}"
        )


def make_sheet(stack: ImageStack, cancel: Cancel | None = None) -> Sheet:
    """Means of square blocks of pixels, all images equally bright.

    Raises:
        Cancelled: `cancel` returned true.
    """
    K, H, W = stack.shape
    side = min(SIDE, max(LEAST, isqrt(MOST // K)))
    step = ceil(max(H, W) / side)
    gain = choose_gain(stack.images, stack.mask)
    h, w = ceil(H / step), ceil(W / step)
    grid = ceil(K / COLUMNS), min(K, COLUMNS)
    sheet = np.zeros((grid[0], h, grid[1], w), np.uint8)
    for k, image in enumerate(stack.images):
        if cancel is not None and cancel():
            raise Cancelled("the thumbnails were cancelled")
        small = render_input(shrink(image, step), gain)
        sheet[k // COLUMNS, :, k % COLUMNS] = small
    data = encode_jpeg(sheet.reshape(grid[0] * h, grid[1] * w), QUALITY)
    url = f"data:image/jpeg;base64,{base64.b64encode(data).decode('ascii')}"
    return Sheet(url, (h, w), grid, gain)


def shrink(image: NDArray[np.float32], step: int) -> NDArray[np.float32]:
    """Means of blocks of `step` x `step` pixels of (H,W); those at the border may be smaller."""
    for axis in (0, 1):
        starts = np.arange(0, image.shape[axis], step)
        widths = np.diff(np.append(starts, image.shape[axis])).astype(np.float32)
        image = np.add.reduceat(image, starts, axis=axis)
        image = image / (widths[:, None] if axis == 0 else widths)
    return image
