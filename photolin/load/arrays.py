"""Stacks saved by numpy."""

import zipfile
from math import prod
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .folder import check_count
from .layout import Frame, Layout
from .pictures import as_picture, check_size, depth_of

SHAPES = "(images, rows, columns) or (images, rows, columns, channels)"


def find_arrays(path: Path) -> Layout:
    """Recognise a .npy of images, or a .npz with ``images`` and maybe ``mask, lights, names``.

    Raises:
        InputError: pickled, truncated, of another shape, or without images.
    """
    try:
        arrays = _read_npz(path) if path.suffix.lower() == ".npz" else {"images": _read_npy(path)}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(
            f"{path}: is truncated or not a numpy file ({error}); .npy and .npz are accepted"
        ) from error
    images = arrays["images"]
    check_count(len(images), path)
    names = [f"image {k:03d}" for k in range(len(images))]
    if "names" in arrays:
        names = [str(name) for name in arrays["names"].ravel()]
        if len(names) != len(images):
            raise InputError(
                f"{path}: holds {len(names)} names for {len(images)} images; one each is accepted"
            )
    why = f"{depth_of(images)} array"
    frames = [
        Frame(name, f"{path}, image {k}", lambda k=k: as_picture(images[k], str(path), why=why))
        for k, name in enumerate(names)
    ]
    return Layout(
        title=path.stem,
        where=path,
        frames=tuple(frames),
        files=(path,),
        mask=arrays.get("mask"),
        lights=arrays.get("lights"),
    )


def _read_npy(path: Path) -> NDArray:
    with path.open("rb") as stream:
        _check_header(stream, path, "the array", images=True)
    return np.load(path, mmap_mode="r", allow_pickle=False)


def _read_npz(path: Path) -> dict[str, NDArray]:
    with zipfile.ZipFile(path) as archive:
        names = {name.removesuffix(".npy"): name for name in archive.namelist()}
        if "images" not in names:
            raise InputError(
                f"{path}: holds {', '.join(names) or 'nothing'}; an array called images of shape "
                f"{SHAPES} is accepted"
            )
        arrays = {}
        for key in ("images", "mask", "lights", "names"):
            if key in names:
                with archive.open(names[key]) as stream:
                    _check_header(stream, path, key, images=key == "images")
                with archive.open(names[key]) as stream:
                    arrays[key] = np.lib.format.read_array(stream, allow_pickle=False)
    return arrays


def _check_header(stream: IO[bytes], path: Path, key: str, images: bool) -> None:
    """Refuse what must not be decoded, from the header: pickles, bombs, other shapes."""
    version = np.lib.format.read_magic(stream)
    read = np.lib.format
    header = read.read_array_header_1_0 if version == (1, 0) else read.read_array_header_2_0
    shape, _, dtype = header(stream)
    if dtype.hasobject:
        raise InputError(
            f"{path}: {key} is pickled Python objects, which could run code when read; "
            "plain numbers are accepted"
        )
    if images and len(shape) not in (3, 4):
        raise InputError(f"{path}: {key} is of shape {shape}; {SHAPES} is accepted")
    count, rows, columns = shape[:3] if images else (1, 1, prod(shape))
    check_size(rows, columns, f"{path}, {key}", count)
