"""A folder of image files; names decide which of them are the stack."""

import re
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError
from ..stack import MIN_IMAGES
from .layout import Layout, file_frame
from .pictures import READERS

ROLES = {
    "mask": re.compile("mask"),
    "truth": re.compile("normal|^gt"),
    "dark": re.compile("ambient|dark"),
}
"""What in a lower-case file name gives a file a role of its own; the first that fits counts."""

LIGHTS = ("light_directions.txt", "lights.txt", "lights.npy", "lights.lp")
"""Names of lights files, in order of preference; any other ``.lp`` comes last."""


def find_folder(folder: Path, listed: Sequence[Path] = ()) -> Layout:
    """Recognise the stack of a folder, or of its ``images`` sub-folder; or take the files `listed`.

    Raises:
        InputError: no images, too few, or two stacks.
    """
    images, roles = folder, sort_files(folder)
    if len(roles["image"]) < MIN_IMAGES and not listed and (folder / "images").is_dir():
        images = folder / "images"
        roles = sort_files(images)
    stack, left_out = (list(listed), []) if listed else _largest_group(roles["image"], images)
    if not stack:
        raise InputError(f"{images}: holds no images; accepted are {', '.join(READERS)}")
    check_count(len(stack), images)
    note = f"left out: {', '.join(p.name for p in left_out)} (named unlike {stack[0].name})"
    return Layout(
        title=folder.resolve().name,
        where=images,
        frames=tuple(file_frame(path) for path in stack),
        files=tuple(stack),
        dark=tuple(path for path in roles["dark"] if path not in stack),
        masks=find_masks(images) or find_masks(folder),
        lights=find_lights(images) or find_lights(folder),
        notes=(note,) if left_out else (),
    )


def check_count(count: int, where: Path) -> None:
    """Raise InputError for fewer images than linearization needs, before any is decoded."""
    if count < MIN_IMAGES:
        raise InputError(
            f"{where}: holds {count} image{'s' * (count != 1)}; at least {MIN_IMAGES} are needed "
            "(three base images and three to linearize them)"
        )


def sort_files(folder: Path) -> dict[str, list[Path]]:
    """Image files of a folder by role (image, mask, truth, dark), each in natural order."""
    files = sorted(
        (
            path
            for path in folder.iterdir()
            if path.suffix.lower() in READERS
            and not path.name.startswith(".")
            and not path.is_dir()
        ),
        key=_natural,
    )
    roles: dict[str, list[Path]] = defaultdict(list)
    for path in files:
        roles[_role(path, files)].append(path)
    return roles


def find_masks(folder: Path) -> tuple[Path, ...]:
    """What could be the mask: the file called mask, or all with mask in their name."""
    masks = sort_files(folder)["mask"]
    return tuple([path for path in masks if path.stem.lower() == "mask"] or masks)


def find_lights(folder: Path) -> tuple[Path, ...]:
    """What could be the lights: the first name of LIGHTS, or all .lp files."""
    named = [folder / name for name in LIGHTS if (folder / name).is_file()]
    return tuple(named[:1] or sorted(folder.glob("[!.]*.lp")))


def _role(path: Path, files: list[Path]) -> str:
    for role, pattern in ROLES.items():
        if pattern.search(path.stem.lower()):
            alike = sum(bool(pattern.search(other.stem.lower())) for other in files)
            # A word that most files share names the object ("dark_vase_01"), not a role.
            if alike < MIN_IMAGES or 2 * alike <= len(files):
                return role
    return "image"


def _natural(path: Path) -> tuple[list[str | int], str]:
    parts = re.split("([0-9]+)", path.name.lower())
    return [int(part) if n % 2 else part for n, part in enumerate(parts)], path.name


def _largest_group(files: list[Path], folder: Path) -> tuple[list[Path], list[Path]]:
    """The files of the most common numbered name, and the others; all where none is common."""
    groups: dict[str, list[Path]] = defaultdict(list)
    for path in files:
        groups[re.sub(r"[-+]?\d+(\.\d+)?", "#", path.name.lower())].append(path)
    sizes = sorted((len(group) for group in groups.values()), reverse=True)
    if not sizes or sizes[0] < MIN_IMAGES:
        return files, []
    if len(sizes) > 1 and sizes[0] == sizes[1]:
        names = " and ".join(group[0].name for group in groups.values() if len(group) == sizes[0])
        raise InputError(
            f"{folder}: holds stacks of {sizes[0]} images each, from {names}; "
            "a folder with one stack is accepted"
        )
    stack = max(groups.values(), key=len)
    return stack, [path for path in files if path not in set(stack)]
