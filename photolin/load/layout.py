"""What a layout module finds, before any pixel is decoded."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .pictures import Picture, read_picture


@dataclass(frozen=True)
class Frame:
    """One image that can be read when its turn comes."""

    name: str
    """What the stack calls the image: a file name, or "page 003"."""
    where: str
    """What an error calls it: a path, or a path and a page."""
    read: Callable[[], Picture]
    """Decodes it; raises InputError that names `where`."""


@dataclass(frozen=True, eq=False)
class Layout:
    """The parts of a stack and where they are."""

    title: str
    where: Path
    """The folder or file that was recognised."""
    frames: tuple[Frame, ...]
    files: tuple[Path, ...]
    """Every file the frames and powers are read from, for hashing."""
    dark: tuple[Path, ...] = ()
    """Dark frames; their mean is subtracted."""
    masks: tuple[Path | NDArray, ...] = ()
    """What could be the mask: image files or (H,W)."""
    lights: tuple[Path | NDArray, ...] = ()
    """What could be the lights: files or (K,3)."""
    powers: NDArray[np.float64] | None = None
    """(K,3) power of each light in red, green and blue; images are divided by it."""
    notes: tuple[str, ...] = ()


def file_frame(path: Path) -> Frame:
    """The frame of an image file of its own."""
    return Frame(path.name, str(path), lambda: read_picture(path))
