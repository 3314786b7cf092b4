"""Two pictures in one: split at a line, or their difference. Pure."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .frame import Frame
from .patterns import add_marks
from .render import tabulate_colours
from .state import Layer

Picture = NDArray[np.uint8]

LINE = (255, 255, 255)
"""Colour of the dividing line, on black."""


def other_frame(frame: Frame, layer: Layer) -> Frame:
    """What is compared with: another layer, by the method beside where there is one."""
    analysis, labels = frame.analysis, frame.labels
    if frame.state.beside is not None and frame.beside is not None:
        analysis, labels = frame.beside, frame.beside_labels
    state = replace(frame.state, layer=layer)
    return replace(frame, state=state, analysis=analysis, labels=labels, preview=None)


def lay_over(picture: Picture, frame: Frame, hidden: bool) -> Picture:
    """(H,W,3): a picture (H,W) or (H,W,3) under the labels of its frame."""
    rgb = np.repeat(picture[:, :, None], 3, axis=2) if picture.ndim == 2 else picture
    state, labels = frame.state, frame.labels
    if labels is None or hidden:
        return rgb
    solid = state.layer == "labels"
    colours, alphas = tabulate_colours(state.shown, state.opacity, solid=solid)
    if state.patterns:
        labels = add_marks(labels)
    a = alphas[labels][:, :, None]
    return (rgb * (1 - a) + colours[labels] * a + 0.5).astype(np.uint8)


def split(left: Picture, right: Picture, divider: float) -> Picture:
    """(H,W,3): `left` up to the share `divider` of the width, then a line, then `right`."""
    W = left.shape[1]
    at = round(divider * W)
    both = np.concatenate([left[:, :at], right[:, at:]], axis=1)
    if 0 < at < W:
        both[:, at - 1 : at] = LINE
    return both


def differ(one: Picture, other: Picture) -> Picture:
    """(H,W,3): absolute difference of two pictures."""
    return np.abs(one.astype(np.int16) - other).astype(np.uint8)
