"""How often classes are, at each pixel and in each image; in pictures and in words. Pure."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from photolin.analysis import Analysis, Cancel
from photolin.factors import Factor, Thresholds
from photolin.label import label_images
from photolin.overview import count_classes
from photolin.stack import ImageStack

from .landscape_plot import colour
from .state import Often

CLASSES: dict[Often, tuple[Factor, ...]] = {
    "specular": (Factor.SPECULAR,),
    "lit": (Factor.DIFFUSE, Factor.SPECULAR),
    "attached shadow": (Factor.ATTACHED,),
    "cast shadow": (Factor.CAST,),
    "any shadow": (Factor.ATTACHED, Factor.CAST),
    "undefined": (Factor.UNDEFINED,),
}
"""What each choice counts."""


FEW = 0.1
"""Share of the pixels up to which it is quicker to gather those that are wanted."""


def count_often(
    stack: ImageStack,
    analysis: Analysis,
    thresholds: Thresholds,
    often: Often,
    where: NDArray[np.bool_] | None = None,
) -> NDArray[np.uint16]:
    """(H,W) in how many of the K images each pixel is so, by `thresholds`; 0 outside the mask.

    Args:
        where: (H,W) the pixels that are wanted; others may be 0.
    """
    wanted = stack.mask if where is None else stack.mask & where
    places = np.flatnonzero(wanted)
    if places.size > FEW * wanted.size:
        return count_classes(label_all(stack, analysis, thresholds), *CLASSES[often])
    counts = np.zeros(wanted.shape, np.uint16)
    labels = label_images(
        stack.images.reshape(len(stack.images), 1, -1)[..., places],
        analysis.linearized_bases.reshape(3, 1, -1)[..., places],
        analysis.coefficients,
        np.ones((1, places.size), np.bool_),
        thresholds,
    )
    counts.reshape(-1)[places] = count_classes(labels, *CLASSES[often])[0]
    return counts


def label_all(
    stack: ImageStack, analysis: Analysis, thresholds: Thresholds, cancel: Cancel | None = None
) -> NDArray[np.uint8]:
    """(K,H,W) Factor codes of all images by a result's bases and `thresholds`.

    Raises:
        Cancelled: `cancel` said so.
    """
    if thresholds == analysis.thresholds:
        return analysis.labels
    return label_images(
        stack.images,
        analysis.linearized_bases,
        analysis.coefficients,
        stack.mask,
        thresholds,
        cancel=cancel,
    )


def share_classes(
    labels: NDArray[np.uint8], mask: NDArray[np.bool_], kept: Sequence[int]
) -> dict[int, NDArray[np.float64]]:
    """(5,) share of each Factor code among the mask pixels, by number of the whole stack.

    Args:
        labels: (K,H,W) of the images that are left.
        mask: (H,W)
        kept: their numbers in the whole stack, K.
    """
    inside = int(mask.sum())
    return {
        k: np.array([np.count_nonzero(one == np.uint8(f)) for f in sorted(Factor)]) / inside
        for k, one in zip(kept, labels, strict=True)
    }


def render_often(
    counts: NDArray[np.uint16], count: int, mask: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """Colours (H,W,3) of counts (H,W): dark purple is none, yellow all `count` images; black
    outside.

    By the square root, so that what is rare shows; the same for all counts, so that pictures can be
    compared, and colours tell the same while T and Ts move.
    """
    picture = colour(np.sqrt(np.arange(count + 1) / count))[counts]
    picture[~mask] = 0
    return picture


def caption_often(counts: NDArray[np.uint16], count: int, often: Often) -> str:
    """What the colours span, and what is reached, for a stack of `count` images."""
    most = int(counts.max(initial=0))
    return (
        f"{often} in none (dark purple), a quarter (teal), all (yellow) of {count} images, "
        f"at most {most} here"
    )
