"""A stack without some of its images: while it is read, and once it is in memory."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import OptionError
from ..stack import MIN_IMAGES, ImageStack
from .layout import Layout
from .options import LoadOptions


def exclude_images(stack: ImageStack, exclude: Sequence[int]) -> ImageStack:
    """`stack` without some images: the images, names and lights that reading it anew with
    `LoadOptions.exclude` would give, from memory.

    Counts of observations in its notes stay those of all images.

    Args:
        exclude: image numbers of `stack`, from 0.

    Returns:
        The stack itself where nothing is excluded, else a copy of what is left.

    Raises:
        OptionError: an image that is not there or is named twice, or too few are left.
        DegenerateError: the lights of those left lie in one plane.
    """
    gone = LoadOptions(exclude=tuple(exclude)).exclude
    if not gone:
        return stack
    kept = kept_images(gone, len(stack.names), stack.title)
    paths = [path for path, _ in stack.files]
    files = stack.files
    if _one_each(paths, stack.names):
        files = (*(files[k] for k in kept), *files[len(stack.names) :])
    return replace(
        stack,
        images=stack.images[kept],
        names=tuple(stack.names[k] for k in kept),
        lights=None if stack.lights is None else stack.lights[kept],
        files=files,
        notes=(*stack.notes, describe_excluded(stack.names[k] for k in gone)),
    )


def kept_images(exclude: Sequence[int], count: int, where: str) -> NDArray[np.intp]:
    """Numbers of the images, of `count`, that are not in `exclude`, ascending.

    Raises:
        OptionError: an image that is not there, or fewer are left than linearization needs.
    """
    if exclude and max(exclude) >= count:
        raise OptionError(f"exclude is {max(exclude)}; {where} has images 0 to {count - 1}")
    kept = np.setdiff1d(np.arange(count), exclude)
    if exclude and len(kept) < MIN_IMAGES:
        raise OptionError(
            f"exclude leaves {len(kept)} of {count} images of {where}; at least {MIN_IMAGES} are "
            "needed (three base images and three to linearize them)"
        )
    return kept


def pick_frames(layout: Layout, images: Sequence[int] | NDArray[np.intp]) -> Layout:
    """`layout` with these of its images alone, and their files; its lights stay those of all."""
    paths, frames = list(layout.files), layout.frames
    if _one_each(map(str, paths), [frame.name for frame in frames]):
        paths = [*(paths[k] for k in images), *paths[len(frames) :]]
    return replace(
        layout,
        frames=tuple(frames[k] for k in images),
        files=tuple(paths),
        powers=None if layout.powers is None else layout.powers[list(images)],
    )


def describe_excluded(names: Iterable[str]) -> str:
    """The note on images that were left out."""
    return f"excluded: {', '.join(names)} (as asked)"


def _one_each(paths: Iterable[str], names: Sequence[str]) -> bool:
    """Whether the first files are the images, one each; not so for pages and arrays."""
    first = [Path(path).name for path in paths][: len(names)]
    return first == list(names)
