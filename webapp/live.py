"""The linearization that follows the sliders: of what the screen shows, until a run catches up."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from photolin.analysis import Analysis, Cancel
from photolin.errors import DegenerateError
from photolin.factors import Thresholds
from photolin.follow import Ground, follow_thresholds, prepare_ground
from photolin.stack import ImageStack

from .canvas import Window
from .state import ViewState

Value = TypeVar("Value", bound=np.generic)

MOST_PIXELS = 300_000
"""Pixels that are linearized at once, about; more are thinned out."""
MOST_OBSERVATIONS = 26 * MOST_PIXELS
"""Pixels times images; stacks of many images are thinned out more."""
ANYWAY = 20_000
"""Pixels that cost as much as what is done for coefficients and highlights, whatever is shown."""


@dataclass(frozen=True)
class Part:
    """Every `step`-th pixel of some rows and columns, half-open."""

    row0: int
    row1: int
    column0: int
    column1: int
    step: int

    @property
    def place(self) -> tuple[slice, slice]:
        """As an index of rows and columns."""
        return (
            slice(self.row0, self.row1, self.step),
            slice(self.column0, self.column1, self.step),
        )


@dataclass(frozen=True, eq=False)
class Preview:
    """A linearization of a part of a stack, for thresholds that no run has caught up with."""

    analysis: Analysis
    """Of the part alone."""
    part: Part
    near: Analysis
    """The result of the whole stack it was followed from."""

    @cached_property
    def whole(self) -> Analysis | None:
        """The result of the whole stack, where every pixel has been followed; None otherwise."""
        a, near = self.analysis, self.near
        if self.part.step > 1 or a.mask.shape != near.mask.shape:
            return None
        return replace(
            near,
            options=a.options,
            thresholds=a.thresholds,
            coefficients=a.coefficients,
            linearized_bases=a.linearized_bases,
            labels=a.labels,
            seconds=a.seconds,
        )

    def paint(self, labels: NDArray[np.uint8], image: int) -> NDArray[np.uint8]:
        """Labels (H,W) of an image with those of the part laid over them."""
        return self.lay(labels, self.analysis.labels[image])

    def lay(self, whole: NDArray[Value], own: NDArray[Value]) -> NDArray[Value]:
        """Values (H,W) with those (h,w) of the part laid over them, inside the mask of both."""
        place = self.place
        laid = whole.copy()
        laid[place] = np.where(self.covered[place], self._widen(own), whole[place])
        return laid

    @cached_property
    def covered(self) -> NDArray[np.bool_]:
        """(H,W) where the values of the part are shown."""
        covered = np.zeros(self.near.mask.shape, np.bool_)
        # a pixel that stands for its neighbours may lie outside the mask, or they
        covered[self.place] = self._widen(self.analysis.mask) & self.near.mask[self.place]
        return covered

    @property
    def place(self) -> tuple[slice, slice]:
        """Rows and columns that hold all that is on screen."""
        part = self.part
        return slice(part.row0, part.row1), slice(part.column0, part.column1)

    def _widen(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values (h,w) of the part for all its rows and columns."""
        part = self.part
        wide = values.repeat(part.step, axis=0)[: part.row1 - part.row0]
        return wide.repeat(part.step, axis=1)[:, : part.column1 - part.column0]


class Live:
    """What the sliders of one tab have been followed to."""

    def __init__(self, stack: ImageStack) -> None:
        self._stack = stack
        self._ground: Ground | None = None
        self._part: Part | None = None
        self._cut = (stack.images, stack.mask)
        self._preview: Preview | None = None
        self._refused: tuple[Analysis, Part, Thresholds] | None = None
        """What gave no result the last time."""

    def follow(
        self, state: ViewState, near: Analysis, window: Window | None, cancel: Cancel
    ) -> Preview | None:
        """Linearize what the window shows, at the screen's resolution, by the state's thresholds.

        Args:
            near: the latest result of the whole stack.

        Returns:
            None where `near` is right already, or the thresholds cannot be followed.

        Raises:
            Cancelled: `cancel` returned true.
        """
        if not is_behind(state, near):
            self._preview = None
            return None
        part = choose_part(self._stack.shape, window)
        last = self._preview
        now = (near, part, state.thresholds)
        if last is not None and (last.near, last.part, last.analysis.thresholds) == now:
            return last
        if now == self._refused:
            return None
        if self._ground is None:
            self._ground = prepare_ground(self._stack, near.options.seed)
        if part != self._part:
            self._part, self._cut = part, cut(self._stack, part)
        try:
            found = follow_thresholds(
                *self._cut, self._ground, near, state.thresholds, cancel=cancel
            )
        except DegenerateError:
            self._refused = now
            return None
        self._preview = Preview(found, part, near)
        return self._preview


def is_behind(state: ViewState, near: Analysis) -> bool:
    """Whether a result is of other thresholds than those shown, and is to follow them."""
    return state.live and near.options.method == "robust" and near.thresholds != state.thresholds


def choose_part(shape: tuple[int, int, int], window: Window | None) -> Part:
    """The part of a stack (K,H,W) worth linearizing: all of a small one, else what is seen."""
    K, H, W = shape
    share = max(1, MOST_OBSERVATIONS // K)
    most = min(MOST_PIXELS, share, max(share - ANYWAY, ANYWAY))
    if window is None or most >= H * W:
        window = Window(0, H, 0, W, 1.0)
    row0, row1, column0, column1, scale = window
    # one pixel for each of the screen, and no more than can be followed
    step = min(max(1, int(1 / scale) if scale < 1 else 1), max(H, W))
    while True:
        # on one grid for all windows: a moved one keeps the pixels it looks at
        part = Part(row0 // step * step, row1, column0 // step * step, column1, step)
        rows, columns = (range(*s.indices(max(H, W))) for s in part.place)
        if len(rows) * len(columns) <= most:
            return part
        step += 1


def cut(stack: ImageStack, part: Part) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Images and mask of a part, contiguous; those of the stack itself where that is all of it."""
    if part == Part(0, stack.shape[1], 0, stack.shape[2], 1):
        return stack.images, stack.mask
    images = np.ascontiguousarray(stack.images[:, *part.place])
    return images, np.ascontiguousarray(stack.mask[part.place])
