"""Albedo in colour of a whole stack, from its files."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..analysis import Analysis, Progress
from ..errors import InputError
from ..load import LoadOptions, load_channels
from .colour import colour_albedo
from .recover import Shape


def measure_colour(
    path: Path, reading: LoadOptions, analysis: Analysis, found: Shape, progress: Progress
) -> NDArray[np.float32] | None:
    """Albedo (H,W,3) of a colour stack, gray where no observation is D; None where the images are
    gray or arrays.

    Args:
        path: of the stack.
        reading: as it was read.
        analysis: of the stack.
        found: the shape that was recovered from it.
    """
    try:
        channels = load_channels(path, reading, progress)
        planes = [
            colour_albedo(found.normals, found.lights, analysis.labels, each.images, each.white)
            for each in channels
        ]
    except InputError:
        return None
    colour = np.stack(planes, axis=2)
    # where no observation is D, as in dark creases, nothing tells the colour
    return np.where(np.isnan(colour).any(axis=2, keepdims=True), found.albedo[..., None], colour)
