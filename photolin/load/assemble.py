"""load_stack: recognise the layout, decode it, join and validate."""

import hashlib
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..analysis import Progress
from ..errors import InputError
from ..stack import ImageStack, check_lights, check_mask
from .arrays import find_arrays
from .decode import Plan, make_plan, read_images
from .diligent import LIST, POWERS, find_diligent
from .exclude import describe_excluded, kept_images, pick_frames
from .folder import find_folder
from .layout import Layout
from .lights import read_lights
from .options import LoadOptions
from .pages import find_pages
from .pictures import READERS, read_picture

DEFAULT = LoadOptions()


def load_stack(
    path: str | Path, options: LoadOptions = DEFAULT, progress: Progress | None = None
) -> ImageStack:
    """Read the stack at `path`; the layouts are those of the table in `photolin.load`.

    Args:
        path: folder or file.
        options: channel, transfer, region, and files that take the place of the layout's own.
        progress: called with "load" and the fraction of images read.

    Returns:
        The stack; its notes say what was decided on the way.

    Raises:
        InputError: a file cannot be used; names it.
        OptionError: the region lies outside the images; exclude names an image that is not there,
            or leaves too few.
        DegenerateError: the lights lie in one plane.
    """
    try:
        whole = find_layout(Path(path))
        layout = with_options(whole, options)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    plan = make_plan(layout, options)
    excluded = pick_frames(whole, options.exclude) if options.exclude else None
    images, notes = read_images(layout, plan, progress, excluded)
    mask, mask_note = _read_mask(layout, plan)
    lights, lights_note = _read_lights(layout, whole, options)
    left_out = [] if excluded is None else [describe_excluded(f.name for f in excluded.frames)]
    extra = [p for p in (*layout.dark, *layout.masks, *layout.lights) if isinstance(p, Path)]
    return ImageStack(
        images=images,
        mask=mask,
        names=tuple(frame.name for frame in layout.frames),
        title=layout.title,
        lights=lights,
        files=_digests([*layout.files, *extra]),
        notes=(
            *layout.notes,
            *_notes(layout, plan, options),
            *notes,
            mask_note,
            lights_note,
            *left_out,
        ),
    )


def find_layout(path: Path) -> Layout:
    """Recognise the layout at `path`; decodes no pixel.

    Raises:
        InputError: nothing there that is accepted.
    """
    accepted = "a folder of images, a multi-page TIFF, .npz or .npy is accepted"
    if path.is_dir():
        diligent = (path / LIST).is_file() or (path / POWERS).is_file()
        return find_diligent(path) if diligent else find_folder(path)
    if not path.exists():
        raise InputError(f"{path}: does not exist; {accepted}")
    kind = path.suffix.lower() if path.is_file() else ""  # a pipe would never end
    if kind in (".tif", ".tiff"):
        return find_pages(path)
    if kind in (".npz", ".npy"):
        return find_arrays(path)
    what = "is a single image" if kind in READERS else "is not a stack"
    raise InputError(f"{path}: {what}; {accepted}")


def with_options(layout: Layout, options: LoadOptions) -> Layout:
    """`layout` with the files that `options` name in place of its own, and without the images that
    they exclude; its lights, if any, are those of all images still.

    Raises:
        InputError: several files could be the mask or the lights.
        OptionError: exclude names an image that is not there, or leaves too few.
    """
    if options.lights is not None:
        lights = () if options.lights == "none" else (Path(options.lights),)
        layout = replace(layout, lights=lights)
    if options.mask is not None:
        layout = replace(layout, masks=(Path(options.mask),))
    if options.dark is not None:
        layout = replace(layout, dark=(Path(options.dark),))
    for option, found in (("mask", layout.masks), ("lights", layout.lights)):
        if len(found) > 1:
            names = " and ".join(path.name for path in found[:3] if isinstance(path, Path))
            raise InputError(
                f"{layout.where}: {names} could each be the {option} file; name one with the "
                f"option {option}"
            )
    if options.exclude:
        kept = kept_images(options.exclude, len(layout.frames), str(layout.where))
        layout = pick_frames(layout, kept)
    return layout


def _read_mask(layout: Layout, plan: Plan) -> tuple[NDArray[np.bool_], str]:
    """The mask of the region, and where it is from."""
    shape = plan.first.pixels.shape[:2]
    found = next(iter(layout.masks), None)
    if found is None:
        mask, source = np.ones(shape, np.bool_), "none, every pixel is used"
    elif isinstance(found, Path):
        # Half of the maximum, whatever it is: edges may be smooth, values 1, 255 or 65025.
        bright = read_picture(found).pixels.max(axis=-1)
        mask, source = bright > bright.max() / 2, found.name
        check_mask(mask, shape, str(found))
    else:
        mask, source = np.nan_to_num(found) != 0, f"of {layout.where.name}"
        check_mask(mask, shape, str(layout.where))
    mask = np.ascontiguousarray(mask[plan.region])
    check_mask(mask, mask.shape, f"{layout.where}, region of interest")
    return mask, f"mask: {source} ({np.count_nonzero(mask)} of {mask.size} pixels)"


def _read_lights(
    layout: Layout, whole: Layout, options: LoadOptions
) -> tuple[NDArray[np.float64] | None, str]:
    """The lights (K,3), and where they are from: one for each image of the `whole` stack, of which
    those of excluded images are dropped."""
    names = tuple(frame.name for frame in whole.frames)
    kept = kept_images(options.exclude, len(names), str(layout.where))
    found = next(iter(layout.lights), None)
    if found is None:
        return None, f"lights: {'ignored, as asked' if options.lights == 'none' else 'not given'}"
    if isinstance(found, Path):
        return read_lights(found, names)[kept], f"lights: {found.name}"
    lights = np.atleast_2d(found).astype(np.float64)
    check_lights(lights, len(names), str(layout.where))
    return lights[kept], f"lights: of {layout.where.name}"


def _notes(layout: Layout, plan: Plan, options: LoadOptions) -> list[str]:
    """What was decided before any image was read."""
    why = plan.first.why if plan.auto else "as asked"
    gray = plan.first.pixels.shape[2] == 1
    notes = [
        f"transfer: {plan.transfer} ({why})",
        f"channel: {'the images are gray' if gray else plan.channel + ' of red, green and blue'}",
    ]
    if layout.dark:
        notes.append(f"dark frame: {', '.join(p.name for p in layout.dark)} is subtracted")
    if layout.powers is not None:
        notes.append(f"powers: each image is divided by its line of {POWERS}")
    if options.roi is not None:
        row0, row1, col0, col1 = options.roi
        notes.append(f"region: rows {row0} to {row1 - 1}, columns {col0} to {col1 - 1}")
    return notes


def _digests(paths: Sequence[Path]) -> tuple[tuple[str, str], ...]:
    with ThreadPoolExecutor(min(8, os.cpu_count() or 1)) as pool:
        return tuple(zip(map(str, paths), pool.map(_sha256, paths), strict=True))


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
