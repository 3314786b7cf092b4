"""A run on disk: `result.npz` holds the arrays, `report.json` says how they came about."""

import hashlib
import io
import json
import os
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..analysis import Analysis, Confidence, Options
from ..errors import InputError, OutputError, PhotolinError
from ..factors import OUTSIDE, Thresholds
from ..load import LoadOptions, load_stack
from ..stack import ImageStack
from .files import write_files
from .report import (
    REPORT,
    RESULT,
    describe_analysis,
    describe_reading,
    foreign,
    read_bytes,
    read_report,
    restore_reading,
)

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
"""Not there when the stack had no lights, and in results of earlier versions."""

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


def save_result(
    analysis: Analysis,
    folder: str | Path,
    *,
    command: str | None = None,
    stack_path: str | Path | None = None,
    load_options: LoadOptions | None = None,
) -> None:
    """Write `folder`/result.npz and `folder`/report.json, replacing an earlier result.

    Args:
        analysis: what to write.
        folder: made when missing.
        command: the command line that led here, for the report.
        stack_path, load_options: where the stack was read from and how, so that
            `load_result_stack` finds it again.

    Raises:
        OutputError: `folder` is a file or cannot be written; nothing half-written is left.
    """
    folder = Path(folder)
    check_output(folder)
    files = result_files(
        analysis, command=command, stack_path=stack_path, load_options=load_options
    )
    write_files(folder, files)


def result_files(
    analysis: Analysis,
    *,
    command: str | None = None,
    stack_path: str | Path | None = None,
    load_options: LoadOptions | None = None,
) -> dict[str, bytes]:
    """Encode what `save_result` writes, by the same arguments: file name to bytes."""
    arrays = result_npz(analysis)
    report = describe_analysis(analysis) | {
        "command": command,
        "stack": None if stack_path is None else str(Path(stack_path).resolve()),
        "load": None if load_options is None else describe_reading(load_options),
        "result_sha256": hashlib.sha256(arrays).hexdigest(),
    }
    return {RESULT: arrays, REPORT: (json.dumps(report, indent=1) + "\n").encode()}


def check_output(folder: str | Path) -> None:
    """Raise OutputError unless `folder` can be made or written; touches nothing."""
    folder = Path(folder)
    above = (folder.absolute(), *folder.absolute().parents)
    there = next(path for path in above if os.path.lexists(path))
    if not there.is_dir():
        what = "a file" if there.exists() else "a link to nothing"
        raise OutputError(f"{there}: is {what}; a folder, or a name for a new one, is accepted")
    if not os.access(there, os.W_OK | os.X_OK):
        raise OutputError(f"{there}: cannot be written; a writable folder is accepted")


def result_npz(analysis: Analysis) -> bytes:
    """Encode the arrays of `result.npz`; equal analyses give equal bytes.

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
    buffer = io.BytesIO()
    kinds = ARRAYS | CONFIDENCE
    typed = {name: np.asarray(value, kinds[name][0]) for name, value in arrays.items()}
    np.savez_compressed(buffer, allow_pickle=False, **typed)
    return buffer.getvalue()


def load_result(path: str | Path) -> Analysis:
    """Read back what `save_result` wrote: equal to what was saved.

    Args:
        path: the folder, or the result.npz in it.

    Raises:
        InputError: a file is missing, cut short, or not a photolin result.
    """
    file = _result_file(path)
    report, arrays = read_report(file), _read_arrays(file)
    try:
        options = dict(report["options"])
        if options["base_images"] is not None:
            options["base_images"] = tuple(options["base_images"])
        first, second, third = arrays["base_images"].tolist()
        names = tuple(image["name"] for image in report["images"])
        if len(names) != len(arrays["labels"]) or "total" not in report["seconds"]:
            raise foreign(file.with_name(REPORT))
        bases = arrays["linearized_bases"]
        if "determined" in arrays:
            bases[:, arrays["mask"] & ~arrays["determined"]] = np.nan
        known = {name: arrays[name] for name in CONFIDENCE if name in arrays}
        return Analysis(
            options=Options(**options),
            thresholds=Thresholds(float(arrays["T"]), float(arrays["Ts"])),
            base_images=(first, second, third),
            coefficients=arrays["coefficients"],
            linearized_bases=bases,
            labels=arrays["labels"],
            mask=arrays["mask"],
            names=names,
            seconds={stage: float(s) for stage, s in report["seconds"].items()},
            title=report["title"],
            confidence=Confidence(**known) if known else None,
            lights=arrays.get("lights"),
            files=tuple((entry["path"], entry["sha256"]) for entry in report["files"]),
            notes=tuple(report["notes"]),
            warnings=tuple(report["warnings"]),
        )
    except (KeyError, TypeError, ValueError, PhotolinError) as error:
        raise foreign(file.with_name(REPORT)) from error


def load_result_stack(path: str | Path, stack_path: str | Path | None = None) -> ImageStack:
    """Read the stack a result was computed from, the way it was read then.

    Args:
        path: the result's folder, or the result.npz in it.
        stack_path: where the images are now; where they were then when left out.

    Raises:
        InputError: the images have moved or changed.
    """
    file = _result_file(path)
    was, options = load_result_source(path)
    place = was if stack_path is None else Path(stack_path)
    if place is None or not place.exists():
        where = "nothing says where they were" if place is None else f"{place} is missing"
        raise InputError(f"{file}: its images are not found ({where}); name them with --stack")
    try:
        known = {entry["sha256"] for entry in read_report(file)["files"]}
    except (KeyError, TypeError) as error:
        raise foreign(file.with_name(REPORT)) from error
    stack = load_stack(place, options)
    changed = [name for name, digest in stack.files if digest not in known]
    if changed:
        raise InputError(
            f"{changed[0]}: is not the file {file} was computed from; "
            "run again, or name the right images with --stack"
        )
    return stack


def load_result_source(path: str | Path) -> tuple[Path | None, LoadOptions]:
    """Where the stack of a result was, if the report says so, and how it was read.

    Raises:
        InputError: a file is missing, cut short, or not a photolin result.
    """
    file = _result_file(path)
    report = read_report(file)
    try:
        place = None if report["stack"] is None else Path(report["stack"])
        return place, restore_reading(report["load"])
    except (KeyError, TypeError, ValueError, AttributeError, PhotolinError) as error:
        raise foreign(file.with_name(REPORT)) from error


def is_result(path: str | Path) -> bool:
    """Whether `path` is, or holds, a result rather than a stack."""
    path = Path(path)
    if path.is_dir():
        return (path / REPORT).is_file()
    return path.name == RESULT and path.with_name(REPORT).is_file()


def _result_file(path: str | Path) -> Path:
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: does not exist; a folder that photolin run wrote is accepted")
    return path / RESULT if path.is_dir() else path


def _read_arrays(file: Path) -> Mapping[str, NDArray]:
    """The arrays of result.npz, each of the type and shape ARRAYS and CONFIDENCE say."""
    kinds = ARRAYS | CONFIDENCE
    try:
        with np.load(io.BytesIO(read_bytes(file)), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in kinds if name in archive}
    except (ValueError, TypeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise foreign(file) from error
    if not set(ARRAYS) - OPTIONAL <= set(arrays):
        raise foreign(file)
    if set(CONFIDENCE) & set(arrays) not in (set(), set(CONFIDENCE)):
        raise foreign(file)
    sizes = {"3": 3}
    for name, array in arrays.items():
        dtype, axes = kinds[name]
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
