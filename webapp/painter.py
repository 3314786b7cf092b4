"""Draws frames on the canvas, each part only when it differs from what is there."""

from collections.abc import Sequence

from photolin.analysis import Analysis
from photolin.factors import LETTERS, OUTSIDE, Factor

from .canvas import Canvas
from .compare import lay_together, mixture, other_frame
from .frame import Frame
from .layers import SIGNED, counts, hides_labels, render_layer
from .readout import status_line
from .render import encode_jpeg, encode_labels, encode_png
from .second import Second
from .state import ENCODINGS, SURFACE, TRUTH, Pixel, ViewState

KEPT = 32
"""Encoded pictures kept for stepping back and forth."""
Marks = Sequence[tuple[int, int, str]]
Encoded = dict[tuple[object, ...], tuple[bytes, str]]
LARGE = 400_000
"""Pixels above which a picture is first sent as JPEG, and without loss once nothing changes."""

HIDDEN = "; labels hidden here, outlines show them"
"""End of the caption of a picture without its labels."""


class Sheet:
    """A picture and its overlay, on the planes of either picture that a canvas has."""

    def __init__(self, planes: Canvas | Second, encoded: Encoded) -> None:
        """Draw on `planes`; pictures of input are kept in `encoded` for stepping back and forth."""
        self._planes, self._encoded = planes, encoded
        self._drawn: dict[str, object] = {}
        self.legend = ""
        """What the picture's greys or colours mean."""
        self.rough = False
        """Whether the picture on screen is a lossy one."""

    def paint(self, frame: Frame, other: Frame | None = None, *, rested: bool) -> None:
        """Show a frame.

        Args:
            other: is laid into the same picture, as the frame's state arranges both.
        """
        state = frame.state
        result = frame.analysis if state.layer in SIGNED else None
        shape = frame.shape if state.layer in SURFACE else None
        light = state.light if state.layer == "relit" else None
        look = (frame.excluded, state.image, state.layer, state.gain, result, shape, light)
        if counts(frame):  # of all images, whichever is shown
            look = (state.layer, frame.analysis, frame.preview, state.thresholds, state.often)
        both = None if other is None else mixture(frame, other)
        choice = ENCODINGS.index(state.encoding)
        exact = choice == 1 or (choice == 0 and (frame.stack.mask.size <= LARGE or rested))
        if is_new(self._drawn, "picture", *look, both, choice) or (exact and self.rough):
            encoded, self.legend = self._encode(frame, other, (*look, exact), exact)
            self._planes.set_base(encoded, "png" if exact else "jpeg")
            self.rough = not exact and choice == 0
        self._paint_overlay(frame, hidden=other is not None or hides_labels(frame))

    def _encode(
        self, frame: Frame, other: Frame | None, key: tuple[object, ...], exact: bool
    ) -> tuple[bytes, str]:
        """Bytes and legend of a picture; an input is encoded once, as long as it is a late one."""
        # others would keep results alive
        kept = frame.state.layer not in (*SIGNED, *SURFACE) and not counts(frame) and other is None
        found = self._encoded.pop(key, None) if kept else None
        if found is None:
            picture, legend = render_layer(frame) if other is None else lay_together(frame, other)
            found = (encode_png(picture) if exact else encode_jpeg(picture), legend)
        if kept:
            self._encoded[key] = found  # the latest are last
        for oldest in list(self._encoded)[:-KEPT]:
            del self._encoded[oldest]
        return found

    def _paint_overlay(self, frame: Frame, *, hidden: bool) -> None:
        state = frame.state
        solid = state.layer == "labels"
        look = (state.shown, state.opacity, state.outlines, state.patterns, solid, hidden)
        how = (state.image, state.thresholds, frame.analysis, frame.preview, frame.labels is None)
        how = (frame.excluded, *how)  # the truth of another image has no analysis to tell it by
        if not is_new(self._drawn, "overlay", *how, look):
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
        self._planes.set_overlay(overlay)


class Painter:
    """Pictures, overlays, markers and readout of one tab."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._drawn: dict[str, object] = {
            "marks": ((),),
            "orbit": (False,),
            "arrows": (None, 0),
            "light": (None,),
            "arrangement": (None, 0.0),
        }
        """The key by which each part was drawn; at first, what an empty canvas shows."""
        self._encoded: Encoded = {}
        self._first = Sheet(canvas, self._encoded)
        self._second = Sheet(canvas.second, self._encoded)

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
        other = other_frame(frame)
        # the surface carries one picture only
        joined = state.arrangement == "difference" or (state.relief and frame.shape is not None)
        apart = None if joined else other
        self._first.paint(frame, other if joined else None, rested=rested)
        if apart is not None:
            self._second.paint(apart, rested=rested)
        self._arrange(None if apart is None else state)
        if self._is_new("marker", state.pixel):
            self._canvas.set_marker(state.pixel)
        if self._is_new("marks", marks):
            self._canvas.set_pins(marks)
        self._paint_surface(frame)
        self._canvas.set_readout(
            self._caption(frame, apart) if pointer is None else describe(frame, pointer, other)
        )
        return self._first.rough or (apart is not None and self._second.rough)

    def _arrange(self, state: ViewState | None) -> None:
        how = (None, 0.0) if state is None else (state.arrangement, state.divider)
        if self._is_new("arrangement", *how):
            self._canvas.second.arrange(*how)

    def _caption(self, frame: Frame, apart: Frame | None) -> str:
        """What the greys or colours of the pictures mean."""
        hidden = hides_labels(frame) and frame.state.layer in SIGNED
        # who sees a shape expects no labels, nor does who sees a difference
        told = hidden and (apart is not None or other_frame(frame) is None)
        first = self._first.legend + (HIDDEN if told else "")
        if apart is None:
            return first
        by = frame.state.method if apart.analysis is None else apart.analysis.options.method
        right = TRUTH if frame.state.against == TRUTH else f"{by}, {self._second.legend}"
        names = {"left": f"left: {frame.state.method}, {first}", "right": f"right: {right}"}
        alone = names.get(frame.state.arrangement)
        return "\n".join(names.values()) if alone is None else alone

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
        return is_new(self._drawn, part, *key)


def is_new(drawn: dict[str, object], part: str, *key: object) -> bool:
    """Whether a part is to be drawn by another key than before, which is noted."""
    if drawn.get(part) == key:
        return False
    drawn[part] = key
    return True


def describe(frame: Frame, pixel: Pixel, other: Frame | None = None) -> str:
    """The values of a pixel (row, column) in the image shown, in one line; of `other` in another.

    The picture is told first, and what it is compared with next.
    """
    row, column = pixel
    if counts(frame) and frame.often is not None:
        if not frame.stack.mask[pixel]:
            return f"row {row}  column {column}  outside the mask"
        n, K = frame.often[pixel], len(frame.stack.images)
        return f"row {row}  column {column}  {frame.state.often} in {n} of {K} images"
    i = float(frame.stack.images[frame.state.image, row, column])
    if frame.analysis is None or frame.labels is None:
        first = f"row {row}  column {column}  i {i:.3f}"
    else:
        l = _linearized_at(frame.analysis, frame.state.image, pixel)
        first = status_line(row, column, i, l, int(frame.labels[row, column]))
    if other is None:
        return first
    letter = ""
    if other.labels is not None and (label := int(other.labels[row, column])) != OUTSIDE:
        letter = LETTERS[Factor(label)]
    if frame.state.against == TRUTH:
        return f"left:  {first}\nright: truth {letter}"
    if other.analysis is None:
        return first
    l = _linearized_at(other.analysis, other.state.image, pixel)
    values = f"i {i:.3f}  l {l:z.3f}  residual {i - l:+z.3f}  {letter}"
    return f"left:  {first}\nright: row {row}  column {column}  {values}"


def _linearized_at(analysis: Analysis, k: int, pixel: Pixel) -> float:
    row, column = pixel
    return float(analysis.coefficients[k] @ analysis.linearized_bases[:, row, column])
