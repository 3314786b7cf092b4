"""Analyses shared by all tabs: computed once for each set of options, one at a time."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from photolin.analysis import Analysis, Cancel, Options, Progress
from photolin.compiling import tell_compiling
from photolin.errors import Cancelled
from photolin.factors import Thresholds
from photolin.pipeline import analyze
from photolin.stack import ImageStack
from photolin.thresholds import suggest_thresholds

KEPT = 2
"""Results kept for other tabs; a tab keeps its own for as long as it is open."""
PATIENCE = 0.05
"""Seconds between two looks at whether a tab still wants to wait for its turn."""


class Runs:
    """The results of one stack."""

    def __init__(
        self,
        stack: ImageStack,
        options: Options,
        result: Analysis | None = None,
        *,
        excluded: tuple[int, ...] = (),
        truth: NDArray[np.uint8] | None = None,
    ) -> None:
        """Start with `result`, if there is one; `options` are what a new tab asks for.

        Args:
            excluded: images that `stack` is without, numbers of the whole stack.
            truth: (K,H,W) true Factor codes, where they are known.
        """
        self.stack = stack
        self.excluded = excluded
        self.truth = truth
        self.options = options
        self.result = result
        self._done: dict[Options, Analysis] = {}
        self._lock = Lock()

    def run(self, options: Options, progress: Progress, cancel: Cancel) -> Analysis:
        """The analysis by `options`: computed now, or by another tab before.

        Raises:
            PhotolinError: as `analyze`; Cancelled also while another tab computes.
        """
        if (done := self._done.get(options)) is not None:
            return done
        with self._turn(progress, cancel):
            if (done := self._done.get(options)) is None:
                with tell_compiling(progress) as told:
                    done = analyze(self.stack, options, progress=told, cancel=cancel)
                for oldest in list(self._done)[: len(self._done) + 1 - KEPT]:
                    del self._done[oldest]
                self._done[options] = done
        return done

    def suggest(self, progress: Progress, cancel: Cancel) -> Thresholds:
        """Suggested T and Ts.

        Raises:
            DegenerateError: the images do not determine coefficients.
            Cancelled: `cancel` returned true.
        """
        free = replace(self.options, T=None, Ts=None)
        with tell_compiling(progress) as told:
            told("finding thresholds", 0.5)
            return suggest_thresholds(self.stack, free, cancel).thresholds

    @contextmanager
    def _turn(self, progress: Progress, cancel: Cancel) -> Iterator[None]:
        """Wait until no other tab computes."""
        while not self._lock.acquire(timeout=PATIENCE):
            progress("waiting for another tab", 0.0)
            if cancel():
                raise Cancelled("the run was cancelled before it began")
        try:
            yield
        finally:
            self._lock.release()
