"""The stack without some of its images: made once for all tabs that leave the same ones out."""

from threading import Lock

from photolin.load.exclude import exclude_images, kept_images

from .runs import Runs
from .source import Source

KEPT = 3
"""Selections kept for other tabs: each is a copy of the stack; a tab keeps its own."""


class Selections:
    """The runs of a source, by the images that are left out."""

    def __init__(self, source: Source) -> None:
        """Nothing is made before it is asked for."""
        self.source = source
        self._lock = Lock()
        self._runs: dict[tuple[int, ...], Runs] = {}

    def without(self, excluded: tuple[int, ...]) -> Runs:
        """The runs of what is left, with the source's own result where it is of these images.

        Args:
            excluded: image numbers of the whole stack, ascending.

        Raises:
            PhotolinError: as `exclude_images`.
        """
        source = self.source
        with self._lock:
            runs = self._runs.pop(excluded, None)
            if runs is None:
                stack = exclude_images(source.stack, excluded)
                result = source.result if excluded == source.reading.exclude else None
                truth = source.truth
                if truth is not None and excluded:
                    truth = truth[kept_images(excluded, len(truth), source.stack.title)]
                runs = Runs(stack, source.options, result, excluded=excluded, truth=truth)
            self._runs[excluded] = runs  # the latest are last
            for oldest in list(self._runs)[:-KEPT]:
                del self._runs[oldest]
            return runs
