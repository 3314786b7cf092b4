"""A few thousand pixels that stand for all: where `robust` does its searching."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .stack import ImageStack

SAMPLE_PIXELS = 8000


@dataclass(frozen=True, eq=False)
class Sample:
    """Observations of some pixels in all images."""

    images: NDArray[np.float32]
    """(K,M) one row an image, fraction of full scale."""
    pixels: NDArray[np.float32]
    """(M,K) the same, one row a pixel."""
    places: NDArray[np.intp]
    """(M,) flat indices (row * W + column) of the pixels."""

    def thin(self, count: int) -> "Sample":
        """About `count` of the pixels, evenly spaced."""
        step = max(1, self.images.shape[1] // count)
        images, pixels = self.images[:, ::step], self.pixels[::step]
        return Sample(
            np.ascontiguousarray(images), np.ascontiguousarray(pixels), self.places[::step]
        )


def choose_pixels(stack: ImageStack, seed: int, count: int = SAMPLE_PIXELS) -> NDArray[np.intp]:
    """Flat indices of at most `count` mask pixels, drawn without replacement, ascending."""
    size = int(np.count_nonzero(stack.mask))
    if size <= count:
        return stack.pixels
    return stack.pick(np.sort(np.random.default_rng(seed).choice(size, count, replace=False)))


def draw_sample(
    stack: ImageStack,
    seed: int,
    white: NDArray[np.float32] | None = None,
    count: int = SAMPLE_PIXELS,
) -> Sample:
    """At most `count` mask pixels, drawn without replacement, in image order.

    Args:
        white: (K,) values from which observations are saturated: those are set to 0, so that they
            have no say; none when left out.
    """
    pixels = choose_pixels(stack, seed, count)
    images = stack.images.reshape(len(stack.images), -1)[:, pixels]
    if white is not None:
        images = np.where(images < white[:, None], images, np.float32(0))
    return Sample(np.ascontiguousarray(images), np.ascontiguousarray(images.T), pixels)
