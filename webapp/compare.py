"""Two pictures in one: split at a line, or their difference. Pure."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .difference import render_difference
from .frame import Frame
from .layers import hides_labels, render_layer
from .patterns import add_marks
from .render import tabulate_colours
from .state import SURFACE, TRUTH

Picture = NDArray[np.uint8]

LINE = (255, 255, 255)
"""Colour of the dividing line, on black."""


def other_frame(frame: Frame) -> Frame | None:
    """The frame of the right picture: another layer, by the method beside where there is one.

    That of the truth has no analysis. None where nothing is compared, and where there is no truth
    or no shape to compare with.
    """
    state = frame.state
    if state.against is None or (state.against in SURFACE and frame.shape is None):
        return None
    if state.against == TRUTH:
        if frame.truth is None:
            return None
        told = replace(state, layer="labels", against=None)
        labels = frame.truth[state.image]
        return replace(frame, state=told, analysis=None, labels=labels, preview=None)
    shown = replace(state, layer=state.against, against=None)
    if frame.beside is None:
        return replace(frame, state=shown)
    return replace(
        frame,
        state=shown,
        analysis=frame.beside,
        labels=frame.beside_labels,
        often=frame.beside_often,
        preview=None,
    )


def mixture(frame: Frame, other: Frame) -> tuple[object, ...]:
    """What decides a picture of two frames, besides the first one's own picture."""
    s = frame.state
    divider = s.divider if s.arrangement == "split" else None
    how = (s.against, s.arrangement, divider, s.shown, s.opacity, s.patterns, s.thresholds, s.light)
    return (*how, s.often, frame.analysis, other.analysis, frame.preview, frame.shape)


def lay_together(frame: Frame, other: Frame) -> tuple[NDArray[np.uint8], str]:
    """Both in one picture (H,W,3), with their labels, and its legend."""
    state = frame.state
    if state.arrangement == "difference":
        found = render_difference(frame, other)
        if found is not None:
            return found
        one, two = (lay_over(render_layer(f)[0], f, hidden=True) for f in (frame, other))
        return differ(one, two), "difference of both pictures, black is equal"
    (one, first), (two, second) = render_layer(frame), render_layer(other)
    one = lay_over(one, frame, hides_labels(frame))
    two = lay_over(two, other, hides_labels(other))
    divider = {"left": 1.0, "right": 0.0}.get(state.arrangement, state.divider)
    return split(one, two, divider), f"left: {first}\nright: {second}"


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
