"""The three channels of a colour stack, one after another."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..analysis import Progress
from ..errors import InputError
from .assemble import find_layout, with_options
from .decode import make_plan, read_values
from .options import Channel, LoadOptions

CHANNELS: tuple[Channel, ...] = ("r", "g", "b")
DEFAULT = LoadOptions()
SLACK = 1e-6


class ChannelImages(NamedTuple):
    """One channel of all images."""

    channel: Channel
    images: NDArray[np.float32]
    """(K,H,W) linear, 1 = full scale of the files, the same for all channels; at least 0, above 1
    where light powers are divided by."""
    white: NDArray[np.float32]
    """(K,) value from which an observation is saturated; infinity for files of floats."""


def load_channels(
    path: str | Path, options: LoadOptions = DEFAULT, progress: Progress | None = None
) -> Iterator[ChannelImages]:
    """Red, green and blue of the stack at `path`, each read when its turn comes.

    Only one channel is held at a time if the caller lets go of those before.

    Args:
        path: as `load_stack` takes it.
        options: as it was read; their channel does not matter, their offset is a fraction of the
            files' full scale.
        progress: called with "load" and the fraction of images read, from 0 to 1 for each channel.

    Raises:
        InputError: a file cannot be used, or the images are gray.
        OptionError: the region lies outside the images.
    """
    layout = with_options(find_layout(Path(path)), options)
    plan = make_plan(layout, options)
    if plan.first.pixels.shape[2] == 1:
        raise InputError(
            f"{plan.where}: is gray; images of red, green and blue are accepted for colour"
        )
    powers = np.ones((len(layout.frames), 3)) if layout.powers is None else layout.powers
    for number, channel in enumerate(CHANNELS):
        images, _ = read_values(layout, replace(plan, channel=channel, black=True), progress)
        if plan.offset:
            images -= np.float32(plan.offset)
        np.maximum(images, 0, out=images)
        dark = 0.0 if plan.dark is None else float(plan.dark[number].max())
        # floats have no full scale; others may be rounded down on the way
        full = np.inf if plan.first.pixels.dtype.kind == "f" else 1 - SLACK
        white = (full - dark) / powers[:, number] - plan.offset
        yield ChannelImages(channel, images, white.astype(np.float32))
