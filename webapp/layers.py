"""The pictures of layers, without their labels. Pure."""

import numpy as np
from numpy.typing import NDArray

from .frame import Frame
from .often import caption_often, render_often
from .render import choose_scale, render_input, render_linearized, render_residual
from .state import SURFACE
from .surface import render_surface

SIGNED = ("linearized", "residual")
"""Layers of a result with colours of their own."""


def hides_labels(frame: Frame) -> bool:
    """Whether labels are left out because they would hide the signed picture's own colours.

    Outlines leave enough of it to be seen.
    """
    state = frame.state
    coloured = state.layer in SIGNED or (state.layer in SURFACE and frame.shape is not None)
    return (coloured or counts(frame)) and frame.labels is not None and not state.outlines


def counts(frame: Frame) -> bool:
    """Whether the picture is of all images at once, how often a pixel is something."""
    return frame.state.layer == "how often" and frame.often is not None


def render_layer(frame: Frame) -> tuple[NDArray[np.uint8], str]:
    """The picture under the overlay, (H,W) or (H,W,3), and what its greys or colours mean."""
    state, stack = frame.state, frame.stack
    if state.layer in SURFACE and frame.shape is not None:
        return render_surface(frame.shape, state.layer, state.light, stack.mask)
    if counts(frame) and frame.often is not None:
        caption = caption_often(frame.often, len(stack.images), state.often)
        return render_often(frame.often, len(stack.images), stack.mask), caption
    if frame.analysis is None or state.layer not in SIGNED:
        gain = state.gain or 1.0
        plain = gain == 1 or state.layer == "labels"  # which hide the picture
        shown = "" if plain else f", shown {gain:g} times brighter"
        return render_input(stack.images[state.image], gain), f"{state.layer}{shown}"
    signed = frame.analysis.linearized(state.image)
    if state.layer == "linearized":
        scale = choose_scale(signed, stack.mask)
        text = f"linearized, black -{scale:.3f} to white +{scale:.3f} of full scale, zero mid-grey"
        return render_linearized(signed, scale), text
    residual = np.where(stack.mask, stack.images[state.image] - signed, np.float32(0))
    scale = choose_scale(residual, stack.mask)
    text = f"residual, blue -{scale:.3f} to red +{scale:.3f} of full scale, zero white"
    return render_residual(residual, scale), text
