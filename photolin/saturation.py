"""Which observations are saturated: they say how bright a pixel was at least, not how bright."""

import numpy as np
from numpy.typing import NDArray

from .stack import ImageStack

PILE = 8
"""Pixels at exactly the maximum of an image that no smooth highlight has..."""
STEEP = 4
"""... when they are this many times as many as the pixels at the next five levels together."""


def find_white(stack: ImageStack) -> NDArray[np.float32]:
    """The value from which observations of each image are saturated.

    Full scale is; below it, a pile of pixels at exactly an image's maximum is, as a division by
    light powers or a dark frame leaves it.

    Returns:
        (K,) fraction of full scale; infinity for images without saturated pixels.
    """
    images = stack.images.reshape(len(stack.images), -1)
    white = np.full(len(images), np.inf, np.float32)
    pixels = slice(None) if stack.mask.all() else stack.pixels
    for k, image in enumerate(images):
        values = image[pixels]
        top = values.max()
        if top >= 1:
            white[k] = 1
            continue
        near = values[values >= 0.97 * top]
        counts = np.unique(near, return_counts=True)[1]
        if counts[-1] >= PILE and counts[-1] > STEEP * counts[-6:-1].sum():
            white[k] = top
    return white
