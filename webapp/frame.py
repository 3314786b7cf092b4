"""What one view shows, computed once for all panels. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from photolin.analysis import Analysis, Method
from photolin.factors import Thresholds, classify
from photolin.label import label_images
from photolin.overview import count_classes
from photolin.shape.recover import Shape
from photolin.stack import ImageStack

from .live import Preview
from .often import CLASSES, count_often
from .runs import Runs
from .selections import left_images
from .state import ViewState


@dataclass(frozen=True, eq=False)
class Recovered:
    """A shape and the result it was recovered from."""

    shape: Shape
    analysis: Analysis


@dataclass(frozen=True, eq=False)
class Frame:
    """One image of one result at the thresholds of one view."""

    stack: ImageStack
    state: ViewState
    analysis: Analysis | None
    """Result of the method shown; None while there is none."""
    beside: Analysis | None
    """Result of the method compared with; None where none is wanted or there yet."""
    labels: NDArray[np.uint8] | None
    """(H,W) of the image shown, by the view's thresholds."""
    beside_labels: NDArray[np.uint8] | None
    """The same by the method compared with."""
    preview: Preview | None = None
    """What the labels are by, where no run has caught up with the view's thresholds."""
    recovered: Recovered | None = None
    """The latest shape; None while there is none."""
    excluded: tuple[int, ...] = ()
    """Images that the stack is without, numbers of the whole one."""
    truth: NDArray[np.uint8] | None = None
    """(K,H,W) true Factor codes; None where they are not known."""
    often: NDArray[np.uint16] | None = None
    """(H,W): in how many images a pixel is what `state.often` says; None where nobody looks."""
    beside_often: NDArray[np.uint16] | None = None
    """The same by the method compared with."""

    @property
    def number(self) -> int:
        """Number of the image shown among all images, those too that are left out."""
        count = len(self.stack.images) + len(self.excluded)
        return left_images(count, self.excluded)[self.state.image]

    @property
    def shape(self) -> Shape | None:
        """The latest shape; None while there is none."""
        return None if self.recovered is None else self.recovered.shape


@dataclass(frozen=True, eq=False)
class PixelValues:
    """One pixel in all images."""

    i: NDArray[np.float32]
    """(K,) input, fraction of full scale."""
    l: NDArray[np.float32]
    """(K,) linearized, signed."""
    labels: NDArray[np.uint8]
    """(K,) Factor codes."""


def compose(
    runs: Runs,
    results: Mapping[Method, Analysis],
    state: ViewState,
    preview: Preview | None = None,
    recovered: Recovered | None = None,
    before: Frame | None = None,
) -> Frame:
    """The frame of a view.

    Args:
        runs: where the results come from.
        preview: takes the place of the result of the method shown, as far as it goes.
        before: an earlier frame, whose counts over all images are taken where they are right.
    """
    stack, analysis = runs.stack, results.get(state.method)
    if preview is not None and (whole := preview.whole) is not None:
        analysis = whole
    beside = results.get(state.beside) if state.beside is not None else None
    labels, beside_labels = (
        None if a is None else _label(stack, a, state) for a in (analysis, beside)
    )
    if preview is not None and analysis is preview.near and labels is not None:
        labels = preview.paint(labels, state.image)
    in_view = "how often" in (state.layer, state.against)
    return Frame(
        stack,
        state,
        analysis,
        beside,
        labels,
        beside_labels,
        preview,
        recovered,
        runs.excluded,
        runs.truth,
        _count(stack, analysis, state, before, preview, in_view),
        _count(stack, beside, state, before, None, in_view and state.against == "how often"),
    )


def _count(
    stack: ImageStack,
    analysis: Analysis | None,
    state: ViewState,
    before: Frame | None,
    preview: Preview | None,
    in_view: bool,
) -> NDArray[np.uint16] | None:
    """What the layer how often shows of one result, where it is in view."""
    if analysis is None or not in_view:
        return None
    wanted = (state.thresholds, state.often)
    if before is not None and (before.state.thresholds, before.state.often) == wanted:
        pairs = (
            (before.preview, before.analysis, before.often),
            (None, before.beside, before.beside_often),
        )
        for followed, result, counts in pairs:
            if result is analysis and followed is preview and counts is not None:
                return counts
    if preview is not None and analysis is preview.near:
        return _count_preview(stack, preview, state)
    return count_often(stack, analysis, *wanted)


def _count_preview(stack: ImageStack, preview: Preview, state: ViewState) -> NDArray[np.uint16]:
    """Counts of a preview of a part, and by the view's thresholds where it lacks a pixel.

    Off screen the last result has to do: to label all images anew would make a step a sixth slower,
    or more, for pixels that nobody sees.
    """
    near, beyond = preview.near, np.ones(stack.mask.shape, np.bool_)
    beyond[preview.place] = False
    off_screen = count_often(stack, near, near.thresholds, state.often, beyond)
    lacking = ~(beyond | preview.covered)
    on_screen = count_often(stack, near, state.thresholds, state.often, lacking)
    own = count_classes(preview.analysis.labels, *CLASSES[state.often])
    return preview.lay(np.where(beyond, off_screen, on_screen), own)


def _label(stack: ImageStack, analysis: Analysis, state: ViewState) -> NDArray[np.uint8]:
    """(H,W): labels of the image shown by one result and the view's thresholds."""
    one = slice(state.image, state.image + 1)
    return label_images(
        stack.images[one],
        analysis.linearized_bases,
        analysis.coefficients[one],
        stack.mask,
        state.thresholds,
    )[0]


def pixel_values(
    stack: ImageStack, analysis: Analysis, pixel: tuple[int, int], thresholds: Thresholds
) -> PixelValues:
    """Input, linearized value and label of pixel (row, column) in all K images."""
    row, column = pixel
    i = stack.images[:, row, column]
    c = analysis.coefficients.astype(np.float32)
    b = analysis.linearized_bases[:, row, column]
    # in the order and precision of the label loop, so that both always agree
    l = c[:, 0] * b[0] + c[:, 1] * b[1] + c[:, 2] * b[2]
    return PixelValues(i, l, classify(i, l, thresholds))
