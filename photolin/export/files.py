"""Pictures and arrays of an analysis as bytes: the same for a folder and for a browser."""

import io
import os
import re
import unicodedata
import zipfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from errno import EISDIR
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import tifffile
from numpy.typing import NDArray
from PIL import Image

from ..analysis import Analysis
from ..errors import OptionError, OutputError
from ..factors import LETTERS, OUTSIDE, PALETTE, TITLES, Factor

Contents = Literal["labels", "masks", "linearized"]
CONTENTS: tuple[Contents, ...] = get_args(Contents)

REJECTED = re.compile(r'[\x00-\x1f\x7f\ud800-\udfff<>:"/\\|?*]+')
"""Control characters, bytes that are no text, and what Windows keeps to itself."""


def label_png(labels: NDArray[np.uint8]) -> bytes:
    """Encode one label map as an indexed PNG: pixel values are the Factor codes.

    Args:
        labels: (H,W) Factor codes; OUTSIDE (255) becomes transparent.
    """
    palette = np.zeros((256, 3), np.uint8)
    for factor, colour in PALETTE.items():
        palette[factor] = colour
    image = Image.fromarray(labels)
    image.putpalette(palette.tobytes())
    return _png(image, transparency=OUTSIDE)


def mask_png(labels: NDArray[np.uint8], factor: Factor) -> bytes:
    """Encode where (H,W) `labels` equals `factor` as a gray PNG of 0 and 255."""
    return _png(Image.fromarray(np.where(labels == factor, np.uint8(255), np.uint8(0))))


def linearized_tiff(analysis: Analysis, images: Sequence[int]) -> bytes:
    """Encode linearized images as float32 TIFF pages: signed, fraction of full scale.

    Args:
        analysis: what to take them from.
        images: image numbers from 0, one page each; the page's description names it.
    """
    buffer = io.BytesIO()
    H, W = analysis.mask.shape
    with tifffile.TiffWriter(buffer, bigtiff=len(images) * H * W * 4 > 4e9) as tiff:
        for k in images:
            text = f"linearized image {k} ({analysis.names[k]}), signed, fraction of full scale"
            tiff.write(
                analysis.linearized(k),
                photometric="minisblack",
                description=text.encode("utf-8", "backslashreplace"),
                metadata=None,
                software=False,
            )
    return buffer.getvalue()


def export_files(
    analysis: Analysis, contents: Contents, images: Sequence[int] | None = None
) -> dict[str, bytes]:
    """Encode one kind of export.

    Args:
        analysis: what to export.
        contents: `labels` (indexed PNG, pixel values are Factor codes), `masks` (one PNG of 0 and
            255 for each factor) or `linearized` (one float32 TIFF, a page for each image).
        images: image numbers from 0; all when left out.

    Returns:
        File name to bytes; the names are unique, ordered by image and safe on any file system.

    Raises:
        OptionError: an image number is out of range.
    """
    K = len(analysis.names)
    chosen = range(K) if images is None else images
    for k in chosen:
        if not 0 <= k < K:
            raise OptionError(f"image is {k}; accepted is 0 to {K - 1}")
    if contents == "linearized":
        single = f"_{_stem(analysis, chosen[0])}" if len(chosen) == 1 else ""
        return {f"linearized{single}.tif": linearized_tiff(analysis, chosen)}
    if contents == "labels":
        return {f"labels_{_stem(analysis, k)}.png": label_png(analysis.labels[k]) for k in chosen}
    return {
        f"mask_{_stem(analysis, k)}_{LETTERS[factor]}_{TITLES[factor].replace(' ', '_')}.png": (
            mask_png(analysis.labels[k], factor)
        )
        for k in chosen
        for factor in LETTERS
    }


def zip_files(files: Mapping[str, bytes]) -> bytes:
    """Pack files into a zip archive whose bytes depend on their names and contents alone."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name)  # dated 1980, the zip epoch, not now
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, data, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write all `files` (name to bytes) into `folder`, or none of them.

    Folders are made, earlier files of the same names replaced. All are written under other names
    first, so that a disk that fills up leaves every earlier file as it was.

    Raises:
        OutputError: the folder cannot be made or written, or the disk is full.
    """
    partials = {name: folder / f".{name}.{os.getpid()}.partial" for name in files}
    path = folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in files.items():
            path = folder / name
            if path.is_dir():
                raise IsADirectoryError(EISDIR, os.strerror(EISDIR))
            partials[name].write_bytes(data)
        for name, partial in partials.items():
            path = folder / name
            os.replace(partial, path)
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be written ({error.strerror}); a writable folder with room is accepted"
        ) from error
    finally:
        for partial in partials.values():
            with suppress(OSError):
                partial.unlink()


def _png(image: Image.Image, **options: int) -> bytes:
    buffer = io.BytesIO()
    image.save(buffer, "PNG", **options)
    return buffer.getvalue()


def safe_name(text: str) -> str:
    """`text` as part of a file name on any file system: letters of all alphabets stay.

    What REJECTED matches becomes _; dots and spaces at the ends, and what is over 120 bytes, go.
    """
    name = REJECTED.sub("_", unicodedata.normalize("NFC", text))
    return name.encode()[:120].decode(errors="ignore").strip(" .")


def _stem(analysis: Analysis, k: int) -> str:
    """Image number and name; the number alone where that is the name."""
    stem = safe_name(Path(analysis.names[k]).stem)
    named = stem and not (stem.isdecimal() and int(stem) == k)
    return f"{k:03d}_{stem}" if named else f"{k:03d}"
