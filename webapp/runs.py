"""Analyses shared by all tabs: computed once for each set of options, one at a time."""

from collections import OrderedDict
from dataclasses import replace
from threading import Lock

from photolin.analysis import Analysis, Cancel, Options, Progress
from photolin.factors import Thresholds
from photolin.kernels import consensus_rows
from photolin.pipeline import analyze
from photolin.sample import draw_sample
from photolin.stack import ImageStack
from photolin.thresholds import suggest_thresholds

KEPT = 8
"""Results kept for other tabs; a tab keeps its own for as long as it is open."""


class Runs:
    """The results of one stack."""

    def __init__(self, stack: ImageStack, options: Options, result: Analysis | None = None) -> None:
        """Start with `result`, if there is one; `options` are what a new tab asks for."""
        self.stack = stack
        self.options = options
        self.result = result
        self._done: OrderedDict[Options, Analysis] = OrderedDict()
        self._lock = Lock()

    def run(self, options: Options, progress: Progress, cancel: Cancel) -> Analysis:
        """The analysis by `options`: computed now, or by another tab before.

        Raises:
            PhotolinError: as `analyze`.
        """
        if not consensus_rows.signatures:
            progress("compiling, once on this machine", 0.0)
        with self._lock:
            if options not in self._done:
                self._done[options] = analyze(self.stack, options, progress=progress, cancel=cancel)
            self._done.move_to_end(options)
            while len(self._done) > KEPT:
                self._done.popitem(last=False)
            return self._done[options]

    def suggest(self) -> Thresholds:
        """Suggested T and Ts.

        Raises:
            DegenerateError: the images do not determine coefficients.
        """
        free = replace(self.options, T=None, Ts=None)
        sample = draw_sample(self.stack, free.seed)
        return suggest_thresholds(sample, free, self.stack.lights).thresholds
