"""What the overview of one tab shows, made in a thread while somebody looks at it."""

from collections.abc import Callable, Mapping
from threading import RLock
from time import monotonic

import numpy as np
from numpy.typing import NDArray

from photolin.analysis import Analysis
from photolin.errors import Cancelled
from photolin.factors import Thresholds
from photolin.overview import review_images
from photolin.stack import ImageStack

from .frame import Frame
from .job import Job
from .often import label_all, share_classes
from .selections import left_images
from .strip import Health, judge
from .thumbnails import Sheet, make_sheet

KEPT = 4
"""Reviews kept, for results that are shown again."""
PATIENCE = 0.3
"""Seconds after which progress is told."""


class Reviewer:
    """Thumbnails once, shares of classes for each T and Ts, a review for each result.

    One result is reviewed at a time; of those that arrive meanwhile only the latest is. What is
    there stays there until something newer takes its place.
    """

    def __init__(
        self,
        whole: ImageStack,
        changed: Callable[[], None],
        tell: Callable[[Exception], None],
    ) -> None:
        """Begin nothing yet; what is given is called from a thread.

        Args:
            whole: the stack with all its images.
            changed: called when there is more to show.
            tell: called with what went wrong.
        """
        self._whole, self._changed, self._tell = whole, changed, tell
        self.sheet: Sheet | None = None
        """All thumbnails; None until they are there."""
        self.shares: Mapping[int, NDArray[np.float64]] = {}
        """(5,) share of each Factor code, by number of the whole stack."""
        self.health: Mapping[int, Health] = {}
        """By number of the whole stack; of images left out as they were when they were there."""
        self.fraction: float | None = None
        """Of the review, where it takes long; else None."""
        self._lock = RLock()
        self._frame: Frame | None = None
        self._counted: tuple[Analysis, Thresholds] | None = None
        """What `shares` are of."""
        self._reviews: list[tuple[Analysis, dict[int, Health]]] = []
        self._declined: Analysis | None = None
        """The result whose review was cancelled or failed; not tried again until asked anew."""
        self._failed: Frame | None = None
        self._making: Frame | None = None
        self._began = 0.0
        self._job = Job(lambda work: work(), self._ended)

    def look_at(self, frame: Frame | None) -> None:
        """Make what is lacking for a frame; None while nobody looks."""
        with self._lock:
            self._frame = frame
            if frame is None:
                self._declined = None
        self._pursue()

    def cancel(self) -> None:
        """Stop the review that is being made."""
        with self._lock:
            self._declined = None if self._making is None else reviewed_of(self._making)
        self._job.stop()

    def close(self) -> None:
        """Stop, and make nothing any more."""
        self._job.close()

    def is_reviewed(self, frame: Frame) -> bool:
        """Whether `health` is of the result of a frame."""
        wanted = reviewed_of(frame)
        return any(result is wanted for result, _ in self._reviews)

    def is_declined(self, frame: Frame) -> bool:
        """Whether the review of a frame's result was cancelled, or failed."""
        wanted = reviewed_of(frame)
        return wanted is not None and wanted is self._declined

    def _pursue(self) -> None:
        """Make what is lacking, unless something is being made: if overtaken, that is stopped."""
        with self._lock:
            frame, making = self._frame, self._making
            if making is not None:
                if frame is None or reviewed_of(frame) is not reviewed_of(making):
                    self._job.stop()
                return
            if frame is None or frame is self._failed:
                return
            wanted = reviewed_of(frame)
            for result, health in self._reviews:
                if result is wanted:
                    self.health = {**self.health, **health}
            if not (self.sheet is None or self._is_uncounted(frame) or self._is_open(frame)):
                return
            self._making, self._began = frame, monotonic()
            if not self._job.start(lambda: self._make(frame)):
                self._making = None  # the last is just ending, and comes back here

    def _is_open(self, frame: Frame) -> bool:
        """Whether the result of a frame is to be reviewed."""
        wanted = reviewed_of(frame)
        return wanted is not None and wanted is not self._declined and not self.is_reviewed(frame)

    def _is_uncounted(self, frame: Frame) -> bool:
        now = None if frame.analysis is None else (frame.analysis, frame.state.thresholds)
        return now is not None and now != self._counted

    def _make(self, frame: Frame) -> None:
        try:
            if self.sheet is None:
                self.sheet = make_sheet(self._whole, lambda: self._job.closed)
                self._changed()
            self._count()
            if self._is_open(frame) and not self._job.stopping():
                self._review(frame)
        except Cancelled:
            pass
        except Exception as error:
            with self._lock:
                self._declined, self._failed = reviewed_of(frame), frame
            self._tell(error)
        finally:
            with self._lock:
                self._making = self.fraction = None

    def _review(self, frame: Frame) -> None:
        analysis = reviewed_of(frame)
        assert analysis is not None
        found = review_images(frame.stack, analysis, self._step, self._job.stopping)
        health = judge(found, kept_images(frame, self._whole))
        with self._lock:
            self._reviews = [(analysis, health), *self._reviews][:KEPT]

    def _step(self, _: str, fraction: float) -> None:
        """Between two images: the shares follow T and Ts meanwhile."""
        self._count()
        if monotonic() - self._began > PATIENCE:
            self.fraction = fraction
            self._changed()

    def _count(self) -> None:
        frame = self._frame
        if frame is None or frame.analysis is None or not self._is_uncounted(frame):
            return
        stack, T = frame.stack, frame.state.thresholds
        labels = label_all(stack, frame.analysis, T, self._job.stopping)
        shares = share_classes(labels, stack.mask, kept_images(frame, self._whole))
        with self._lock:
            self.shares, self._counted = {**self.shares, **shares}, (frame.analysis, T)
        self._changed()

    def _ended(self) -> None:
        self._pursue()
        self._changed()


def reviewed_of(frame: Frame) -> Analysis | None:
    """The result of a frame that is reviewed; of a preview, the run that it is made from."""
    return frame.analysis if frame.preview is None else frame.preview.near


def kept_images(frame: Frame, whole: ImageStack) -> list[int]:
    """Numbers in the whole stack of the images of a frame."""
    return left_images(len(whole.images), frame.excluded)
