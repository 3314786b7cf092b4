"""Draws frames on the canvas, each part only when it differs from what is there."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .canvas import Canvas
from .compare import differ, lay_over, other_frame, split
from .frame import Frame
from .readout import status_line
from .render import (
    choose_scale,
    encode_jpeg,
    encode_labels,
    encode_png,
    render_input,
    render_linearized,
    render_residual,
)
from .state import ENCODINGS, SURFACE, Layer, Pixel
from .surface import render_surface

SIGNED = ("linearized", "residual")
"""Layers of a result with colours of their own."""
KEPT = 32
"""Encoded pictures kept for stepping back and forth."""
Marks = Sequence[tuple[int, int, str]]
LARGE = 400_000
"""Pixels above which a picture is first sent as JPEG, and without loss once nothing changes."""

HIDDEN = "; labels hidden here, outlines show them"
"""End of the caption of a picture without its labels."""


class Painter:
    """Picture, overlay, marker and readout of one tab."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._drawn: dict[str, object] = {
            "marks": ((),),
            "orbit": (False,),
            "arrows": (None, 0),
            "light": (None,),
        }
        """The key by which each part was drawn; at first, what an empty canvas shows."""
        self._legend = ""
        self._rough = False
        self._encoded: dict[tuple[object, ...], tuple[bytes, str]] = {}

    def paint(
        self, frame: Frame, pointer: Pixel | None, marks: Marks = (), *, rested: bool
    ) -> bool:
        """Show a frame.

        Args:
            pointer: (row, column) under the pointer, whose values the readout says.
            marks: (row, column, text) that are put on the picture.
            rested: nothing has changed for a while: send the picture without loss.

        Returns:
            Whether the picture on screen is still a lossy one.
        """
        state = frame.state
        result = frame.analysis if state.layer in SIGNED else None
        shape = frame.shape if state.layer in SURFACE else None
        light = state.light if state.layer == "relit" else None
        look = (frame.excluded, state.image, state.layer, state.gain, result, shape, light)
        compared = compared_with(frame)
        choice = ENCODINGS.index(state.encoding)
        exact = choice == 1 or (choice == 0 and (frame.stack.mask.size <= LARGE or rested))
        if self._is_new("picture", *look, compared, choice) or (exact and self._rough):
            encoded, self._legend = self._encode(frame, (*look, compared, exact), exact)
            self._canvas.set_base(encoded, "png" if exact else "jpeg")
            self._rough = not exact and choice == 0
        self._paint_overlay(frame)
        if self._is_new("marker", state.pixel):
            self._canvas.set_marker(state.pixel)
        if self._is_new("marks", marks):
            self._canvas.set_pins(marks)
        self._paint_surface(frame)
        told = hides_labels(frame) and state.layer in SIGNED  # who sees a shape expects no labels
        caption = self._legend + (HIDDEN if told else "")
        self._canvas.set_readout(caption if pointer is None else describe(frame, pointer))
        return self._rough

    def _encode(self, frame: Frame, key: tuple[object, ...], exact: bool) -> tuple[bytes, str]:
        """Bytes and legend of a picture; an input is encoded once, as long as it is a late one."""
        found = self._encoded.pop(key, None)
        if found is None:
            picture, legend = render_layer(frame)
            if frame.state.against is not None:
                picture = lay_beside(frame, picture, frame.state.against)
            found = (encode_png(picture) if exact else encode_jpeg(picture), legend)
        # others would keep results alive
        if frame.state.layer not in (*SIGNED, *SURFACE) and frame.state.against is None:
            self._encoded[key] = found  # the latest are last
        for oldest in list(self._encoded)[:-KEPT]:
            del self._encoded[oldest]
        return found

    def _paint_overlay(self, frame: Frame) -> None:
        state = frame.state
        solid = state.layer == "labels"
        hidden = hides_labels(frame) or state.against is not None
        look = (state.shown, state.opacity, state.outlines, state.patterns, solid, hidden)
        if not self._is_new(
            "overlay", state.image, state.thresholds, frame.analysis, frame.preview, look
        ):
            return
        overlay = None
        if frame.labels is not None and not hidden:
            overlay = encode_labels(
                frame.labels,
                state.shown,
                state.opacity,
                outlines=state.outlines,
                solid=solid,
                patterns=state.patterns,
            )
        self._canvas.set_overlay(overlay)

    def _paint_surface(self, frame: Frame) -> None:
        """The surface, whether the picture lies on it, and the lights around it."""
        state, shape = frame.state, frame.shape
        turning = state.relief and shape is not None
        if turning and self._is_new("surface", shape):
            self._canvas.set_surface(shape)
        if self._is_new("orbit", turning):
            self._canvas.set_orbit(turning)
        arrows = (shape, state.image) if turning and state.arrows else (None, 0)
        if self._is_new("arrows", *arrows):
            self._canvas.set_arrows(*arrows)
        light = state.light if state.layer == "relit" and shape is not None else None
        if self._is_new("light", light):
            self._canvas.set_light(light)

    def _is_new(self, part: str, *key: object) -> bool:
        if self._drawn.get(part) == key:
            return False
        self._drawn[part] = key
        return True


def compared_with(frame: Frame) -> tuple[object, ...] | None:
    """What decides the second picture and the labels of both; None without one."""
    s = frame.state
    if s.against is None:
        return None
    how = (
        s.against,
        s.divider,
        s.difference,
        s.shown,
        s.opacity,
        s.patterns,
        s.thresholds,
        s.light,
    )
    return (*how, frame.analysis, frame.beside, frame.preview, frame.shape)


def lay_beside(frame: Frame, picture: NDArray[np.uint8], layer: Layer) -> NDArray[np.uint8]:
    """The picture shown with another one beside it, each with its labels, (H,W,3)."""
    other = other_frame(frame, layer)
    one = lay_over(picture, frame, hides_labels(frame))
    two = lay_over(render_layer(other)[0], other, hides_labels(other))
    state = frame.state
    return differ(one, two) if state.difference else split(one, two, state.divider)


def hides_labels(frame: Frame) -> bool:
    """Whether labels are left out because they would hide the signed picture's own colours.

    Outlines leave enough of it to be seen.
    """
    state = frame.state
    coloured = state.layer in SIGNED or (state.layer in SURFACE and frame.shape is not None)
    return coloured and frame.labels is not None and not state.outlines


def render_layer(frame: Frame) -> tuple[NDArray[np.uint8], str]:
    """The picture under the overlay, (H,W) or (H,W,3), and what its greys or colours mean."""
    state, stack = frame.state, frame.stack
    if state.layer in SURFACE and frame.shape is not None:
        return render_surface(frame.shape, state.layer, state.light, stack.mask)
    if frame.analysis is None or state.layer not in SIGNED:
        gain = state.gain or 1.0
        shown = "" if gain == 1 else f", shown {gain:g} times brighter"
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


def describe(frame: Frame, pixel: Pixel) -> str:
    """The values of a pixel (row, column) in the image shown, in one line."""
    row, column = pixel
    k = frame.state.image
    i = float(frame.stack.images[k, row, column])
    if frame.analysis is None or frame.labels is None:
        return f"row {row}  column {column}  i {i:.3f}"
    l = float(frame.analysis.coefficients[k] @ frame.analysis.linearized_bases[:, row, column])
    return status_line(row, column, i, l, int(frame.labels[row, column]))
