"""The stack without some of its images: made once for all tabs that leave the same ones out."""

from collections.abc import Collection
from dataclasses import replace
from threading import Lock

from photolin.analysis import Options
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
                options = self._options(excluded)
                runs = Runs(stack, options, result, excluded=excluded, truth=truth)
            self._runs[excluded] = runs  # the latest are last
            for oldest in list(self._runs)[:-KEPT]:
                del self._runs[oldest]
            return runs

    def _options(self, excluded: tuple[int, ...]) -> Options:
        """What is asked of what is left: base images that were given stay the same images; they are
        chosen anew where one of them is left out."""
        source, given = self.source, self.source.options.base_images
        count = len(source.stack.images)
        counted = left_images(count, source.reading.exclude)
        if given is None or excluded == source.reading.exclude or max(given) >= len(counted):
            return source.options
        images, left = [counted[k] for k in given], left_images(count, excluded)
        if not set(images) <= set(left):
            return replace(source.options, base_images=None)
        a, b, c = (left.index(k) for k in images)
        return replace(source.options, base_images=(a, b, c))


def left_images(count: int, excluded: Collection[int]) -> list[int]:
    """Numbers of the images, of `count`, that are not left out, ascending."""
    gone = set(excluded)
    return [k for k in range(count) if k not in gone]


def follow_image(count: int, image: int, before: Collection[int], excluded: Collection[int]) -> int:
    """The number that an image has once others are left out; that of the next one, if it is.

    Args:
        count: of all images.
        image: counts those that are left without `before`; the last one where it is too great.
        before: images that were left out, numbers of the whole stack.
        excluded: those that are left out now.
    """
    was, left = left_images(count, before), left_images(count, excluded)
    shown = was[min(image, len(was) - 1)]
    return next((n for n, k in enumerate(left) if k >= shown), max(len(left) - 1, 0))
