"""The layout of the DiLiGenT benchmark (Shi et al., PAMI 2019)."""

from pathlib import Path

from ..errors import InputError
from .folder import check_count, find_lights, find_mask, sort_files
from .layout import Layout, file_frame
from .lights import read_table

LIST = "filenames.txt"
POWERS = "light_intensities.txt"


def find_diligent(folder: Path) -> Layout:
    """Recognise a folder with ``filenames.txt``: one image name a line, in order of the lights.

    Raises:
        InputError: a listed image is missing, or powers that are not positive or not one a line.
    """
    text = (folder / LIST).read_text(encoding="utf-8", errors="replace")
    images = [folder / name.strip() for name in text.splitlines() if name.strip()]
    for path in images:
        if not path.is_file():
            raise InputError(
                f"{folder / LIST}: lists {path.name}, which is not there; "
                "names of existing images are accepted"
            )
    check_count(len(images), folder / LIST)
    files, powers = [*images, folder / LIST], None
    if (folder / POWERS).is_file():
        files.append(folder / POWERS)
        _, powers = read_table(folder / POWERS)
        if len(powers) != len(images) or (powers <= 0).any():
            raise InputError(
                f"{folder / POWERS}: holds {len(powers)} powers for {len(images)} images, from "
                f"{powers.min():g}; a line of three positive numbers for each image is accepted"
            )
    return Layout(
        title=folder.resolve().name,
        where=folder,
        frames=tuple(file_frame(path) for path in images),
        files=tuple(files),
        dark=tuple(p for p in sort_files(folder)["dark"] if p not in images),
        mask=find_mask(folder),
        lights=find_lights(folder),
        powers=powers,
    )
