"""What an inspector looks at: a whole stack, how it was read, what is known of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from photolin.analysis import Analysis, Options, Progress
from photolin.command import run_command
from photolin.errors import InputError
from photolin.export import result_files, safe_name
from photolin.factors import Thresholds
from photolin.load import LoadOptions
from photolin.shape.channels import measure_colour
from photolin.shape.recover import Shape
from photolin.stack import ImageStack


@dataclass(frozen=True, eq=False)
class Source:
    """A stack with all its images, and a result of those that are not left out.

    Raises:
        InputError: the truth is of another shape than the stack.
    """

    stack: ImageStack
    """All images, those too that are left out at first."""
    result: Analysis | None = None
    """Shown at once; of the images that `reading` does not exclude."""
    options: Options = field(default_factory=Options)
    """Of the first run, where there is no result."""
    path: Path | None = None
    """Where the stack was read from; None for one that is in memory only."""
    place: Path | None = None
    """Of the session file; None keeps no session."""
    reading: LoadOptions = field(default_factory=LoadOptions)
    """How the stack was read, and which of its images are left out at first."""
    truth: NDArray[np.uint8] | None = None
    """(K,H,W) true Factor codes of all images; None where they are not known."""
    shape: Shape | None = None
    """That was recovered from `result` before; shown at once."""

    def __post_init__(self) -> None:
        if self.truth is not None and self.truth.shape != self.stack.shape:
            raise InputError(
                f"the truth is of shape {self.truth.shape}, the stack of {self.stack.shape}; "
                "labels of every image and pixel of the stack are accepted"
            )

    def command(
        self, options: Options, thresholds: Thresholds, excluded: tuple[int, ...]
    ) -> str | None:
        """The command line that makes a result; None for a stack that is in memory only.

        Args:
            options: as the run was asked; its T and Ts do not matter.
            excluded: numbers of the images that are left out.
        """
        if self.path is None:
            return None
        out = Path.cwd() / f"{safe_name(self.stack.title) or 'stack'}_result"
        reading = replace(self.reading, exclude=excluded)
        return run_command(self.path, out, options, reading, thresholds)

    def pack(
        self, analysis: Analysis, excluded: tuple[int, ...], shape: Shape | None = None
    ) -> Mapping[str, bytes]:
        """The files of a result and of its shape, name to bytes, as `result_files` gives them."""
        return result_files(
            analysis,
            shape=shape,
            command=self.command(analysis.options, analysis.thresholds, excluded),
            stack_path=self.path,
            load_options=None if self.path is None else replace(self.reading, exclude=excluded),
        )

    def colour(
        self, analysis: Analysis, excluded: tuple[int, ...], shape: Shape, progress: Progress
    ) -> NDArray[np.float32] | None:
        """Albedo (H,W,3) of a shape of `analysis`, where the stack's files are there in colour."""
        if self.path is None:
            return None
        reading = replace(self.reading, exclude=excluded)
        return measure_colour(self.path, reading, analysis, shape, progress)
