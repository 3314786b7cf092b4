"""Stacks saved by numpy."""

import zipfile
from functools import partial
from math import prod
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, PhotolinError
from .folder import check_count
from .layout import Frame, Layout
from .pictures import PIXEL_LIMIT, as_picture, check_size, depth_of

SHAPES = "(images, rows, columns) or (images, rows, columns, channels)"


def find_arrays(path: Path) -> Layout:
    """Recognise a .npy of images, or a .npz with ``images`` and maybe ``mask, lights, names``.

    Raises:
        InputError: pickled, truncated, of another shape, or without images.
    """
    try:
        arrays = _read_npz(path) if path.suffix.lower() == ".npz" else {"images": _read_npy(path)}
    except (PhotolinError, MemoryError):
        raise
    except Exception as error:  # zipfile, zlib and numpy raise whatever the broken bytes lead to
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
        Frame(name, where, partial(as_picture, images[k], where, why=why))
        for k, name in enumerate(names)
        for where in [f"{path}, image {k}"]
    ]
    return Layout(
        title=path.stem,
        where=path,
        frames=tuple(frames),
        files=(path,),
        masks=(arrays["mask"],) if "mask" in arrays else (),
        lights=(arrays["lights"],) if "lights" in arrays else (),
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
    if key != "names" and dtype.kind not in "buif":
        raise InputError(f"{path}: {key} is of type {dtype}; integers and floats are accepted")
    if images and (len(shape) not in (3, 4) or not 1 <= prod(shape[3:]) <= 4):
        raise InputError(f"{path}: {key} is of shape {shape}; {SHAPES} is accepted")
    if images:
        check_size(shape[1], shape[2], f"{path}, {key}", shape[0])
    elif prod(shape) * dtype.itemsize > PIXEL_LIMIT * 8:
        raise InputError(f"{path}: {key} is of shape {shape}, larger than the images can be")
