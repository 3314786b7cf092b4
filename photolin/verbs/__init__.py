"""The verbs of the command line, and what they share."""

import functools
import os
import time
from collections.abc import Callable, Iterable
from contextvars import ContextVar
from pathlib import Path

from ..analysis import Progress
from ..errors import OutputError
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


def check_kept(out: Path, names: Iterable[str], read: Iterable[tuple[str, str]]) -> None:
    """Raise OutputError where a file `names` in `out` is one of those that were `read`.

    Args:
        read: (path, sha256), as stacks and results hold them.
    """
    sources = {os.path.realpath(path) for path, _ in read}
    for name in names:
        if os.path.realpath(out / name) in sources:
            raise OutputError(
                f"{out / name}: is part of the input and would be replaced; another folder is "
                "accepted"
            )


def read_stack(
    path: Path, reading: LoadOptions, progress: Progress | None
) -> tuple[ImageStack, float]:
    """The stack and the seconds it took to read."""
    start = time.perf_counter()
    images = load_stack(path, reading, progress=progress)
    return images, time.perf_counter() - start
