"""The verbs of the command line, and what they share."""

import functools
import time
from collections.abc import Callable
from contextvars import ContextVar
from pathlib import Path

from ..analysis import Progress
from ..load import LoadOptions, load_stack
from ..stack import ImageStack

COMMAND: ContextVar[str] = ContextVar("command")
"""The command line being run, as a shell would take it."""


def bind(function: Callable[..., None]) -> Callable[..., Callable[[], None]]:
    """A verb whose parsing gives the call instead of making it, so that errors keep apart."""

    @functools.wraps(function)
    def bound(*args: object, **kwargs: object) -> Callable[[], None]:
        return functools.partial(function, *args, **kwargs)

    return bound


def read_stack(
    path: Path, reading: LoadOptions, progress: Progress | None
) -> tuple[ImageStack, float]:
    """The stack and the seconds it took to read."""
    start = time.perf_counter()
    images = load_stack(path, reading, progress=progress)
    return images, time.perf_counter() - start
