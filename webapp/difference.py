"""What differs between two pictures of one image: values by sign, labels by class. Pure."""

import numpy as np
from numpy.typing import NDArray

from photolin.factors import OUTSIDE, PALETTE, Factor

from .frame import Frame
from .render import choose_scale, render_input, render_residual

GREYS = ("input", "linearized", "residual")
"""Layers of one value for each pixel."""
DIM = 0.35
"""Brightness of a photograph under labels that differ."""


def render_difference(frame: Frame, other: Frame) -> tuple[NDArray[np.uint8], str] | None:
    """The difference of two frames of one image, (H,W,3), and what its colours mean.

    Where either is a label map, the classes of `frame` where those of `other` are not the same, on
    a dim photograph; of two layers of values, `frame` minus `other`.

    Returns:
        None where the layers have nothing to subtract, or labels are not there yet.
    """
    layers = (frame.state.layer, other.state.layer)
    if "labels" in layers:
        return _differing_labels(frame, other)
    if not set(layers) <= set(GREYS) or None in (frame.analysis, other.analysis):
        return None
    mask = frame.stack.mask
    gap = np.where(mask, layer_values(frame) - layer_values(other), np.float32(0))
    scale = choose_scale(gap, mask)
    text = f"left minus right, blue -{scale:.3f} to red +{scale:.3f} of full scale, zero white"
    return render_residual(gap, scale), text


def layer_values(frame: Frame) -> NDArray[np.float32]:
    """(H,W) of a layer of GREYS, fraction of full scale; the input where there is no result."""
    k, layer = frame.state.image, frame.state.layer
    image = frame.stack.images[k]
    if frame.analysis is None or layer == "input":
        return image
    linearized = frame.analysis.linearized(k)
    return linearized if layer == "linearized" else image - linearized


def differing(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Where two label maps give classes, and not the same ones; any shape."""
    return (one != other) & (one != np.uint8(OUTSIDE)) & (other != np.uint8(OUTSIDE))


def _differing_labels(frame: Frame, other: Frame) -> tuple[NDArray[np.uint8], str] | None:
    if frame.labels is None or other.labels is None:
        return None
    image = frame.stack.images[frame.state.image]
    grey = render_input(image, (frame.state.gain or 1.0) * DIM)
    picture = np.repeat(grey[:, :, None], 3, axis=2)
    where = differing(frame.labels, other.labels)
    for factor in Factor:
        picture[where & (frame.labels == factor)] = PALETTE[factor]
    return picture, "labels that differ, in the colour of the left one; the rest is dim"
