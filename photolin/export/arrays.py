"""The arrays of `result.npz`: which there are, encoded and read back."""

import io
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..analysis import Analysis
from ..factors import OUTSIDE
from ..shape.recover import Shape
from .report import foreign, read_bytes

ARRAYS = {
    "labels": (np.uint8, "KHW"),
    "coefficients": (np.float64, "K3"),
    "base_images": (np.int64, "3"),
    "linearized_bases": (np.float32, "3HW"),
    "mask": (np.bool_, "HW"),
    "determined": (np.bool_, "HW"),
    "T": (np.float64, ""),
    "Ts": (np.float64, ""),
    "lights": (np.float64, "K3"),
}
"""Type and axes of each array in result.npz. Bases are 0 where they are not `determined`, for
readers that do not expect NaN; `load_result` puts it back."""
OPTIONAL = {"lights", "determined"}
"""Not there when no lights are known, and in results of earlier versions."""

CONFIDENCE = {
    "lit": (np.uint16, "HW"),
    "diffuse": (np.uint16, "HW"),
    "margin": (np.uint16, "HW"),
    "spread": (np.float32, "HW"),
    "support": (np.float64, "K"),
    "residual": (np.float64, "K"),
    "gain": (np.float64, "K"),
    "saturated": (np.float64, "K"),
}
"""The same for `analysis.Confidence`: all are there, or none where it was not measured."""

SHAPE = {
    "normals": (np.float32, "HW3"),
    "albedo": (np.float32, "HW"),
    "depth": (np.float64, "HW"),
    "given_lights": (np.float64, "K3"),
}
"""The same for `shape.recover.Shape`, whose `lights` are then those found with it; those that came
with the stack, if any, are `given_lights`. Normals and albedo are 0 where bases are not
`determined`. Depth only where it was asked for, in mm or pixels as report.json says, NaN where
undetermined; in double precision, which gives the single precision of pixels back from mm."""
KINDS = ARRAYS | CONFIDENCE | SHAPE


def result_npz(analysis: Analysis, shape: Shape | None = None) -> bytes:
    """Encode the arrays of `result.npz`; equal results give equal bytes.

    Numpy dates every entry 1980, so no clock enters the archive.
    """
    known, bases = analysis.determined(), analysis.linearized_bases
    if not known[analysis.mask].all():
        bases = np.where(known, bases, 0)
    arrays = {
        "labels": analysis.labels,
        "coefficients": analysis.coefficients,
        "base_images": analysis.base_images,
        "linearized_bases": bases,
        "mask": analysis.mask,
        "determined": known,
        "T": analysis.thresholds.T,
        "Ts": analysis.thresholds.Ts,
    }
    if analysis.lights is not None:
        arrays["lights"] = analysis.lights
    if analysis.confidence is not None:
        arrays |= vars(analysis.confidence)
    if shape is not None:
        if analysis.lights is not None:
            arrays["given_lights"] = analysis.lights
        arrays["lights"] = shape.lights
        arrays["normals"] = np.nan_to_num(shape.normals)
        arrays["albedo"] = np.nan_to_num(shape.albedo)
        if shape.depth is not None:
            arrays["depth"] = shape.depth.astype(np.float64) * (shape.px_mm or 1)
    buffer = io.BytesIO()
    typed = {name: np.asarray(value, KINDS[name][0]) for name, value in arrays.items()}
    np.savez_compressed(buffer, allow_pickle=False, **typed)
    return buffer.getvalue()


def read_arrays(file: Path) -> Mapping[str, NDArray]:
    """The arrays of result.npz, each of the type and shape KINDS says."""
    try:
        with np.load(io.BytesIO(read_bytes(file)), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in KINDS if name in archive}
    except (ValueError, TypeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise foreign(file) from error
    if not set(ARRAYS) - OPTIONAL <= set(arrays):
        raise foreign(file)
    if set(CONFIDENCE) & set(arrays) not in (set(), set(CONFIDENCE)):
        raise foreign(file)
    if set(SHAPE) & set(arrays) and not {"normals", "albedo", "lights"} <= set(arrays):
        raise foreign(file)
    sizes = {"3": 3}
    for name, array in arrays.items():
        dtype, axes = KINDS[name]
        if array.dtype != dtype or array.ndim != len(axes):
            raise foreign(file)
        for axis, size in zip(axes, array.shape, strict=True):
            if sizes.setdefault(axis, size) != size:
                raise foreign(file)
    bases = set(arrays["base_images"].tolist())
    if len(bases) != 3 or not bases <= set(range(len(arrays["labels"]))):
        raise foreign(file)
    if ((arrays["labels"] == OUTSIDE) == arrays["mask"]).any():
        raise foreign(file)
    return arrays
