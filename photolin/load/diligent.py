"""The layout of the DiLiGenT benchmark (Shi et al., PAMI 2019)."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .folder import find_folder
from .layout import Layout
from .lights import read_table

LIST = "filenames.txt"
POWERS = "light_intensities.txt"


def find_diligent(folder: Path) -> Layout:
    """Recognise a folder with a list of its images in order of the lights, or with light powers.

    Raises:
        InputError: a listed image is missing, powers that are not positive or not one a line, or
            as for any folder.
    """
    listed = _read_list(folder / LIST) if (folder / LIST).is_file() else []
    layout = find_folder(folder, listed)
    extra = [folder / name for name in (LIST, POWERS) if (folder / name).is_file()]
    powers = _read_powers(folder / POWERS, len(layout.frames)) if folder / POWERS in extra else None
    return replace(layout, files=(*layout.files, *extra), powers=powers)


def _read_list(path: Path) -> list[Path]:
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    images = [path.parent / line.strip() for line in lines if line.strip()]
    for image in images:
        if not image.is_file():
            raise InputError(
                f"{path}: lists {image.name}, which is not there; "
                "names of existing images are accepted"
            )
    return images


def _read_powers(path: Path, count: int) -> NDArray[np.float64]:
    _, powers = read_table(path)
    if len(powers) != count or (powers <= 0).any():
        raise InputError(
            f"{path}: holds {len(powers)} powers for {count} images, from {powers.min():g}; "
            "a line of three positive numbers for each image is accepted"
        )
    return powers
