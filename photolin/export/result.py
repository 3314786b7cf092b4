"""A run on disk: `result.npz` holds the arrays, `report.json` says how they came about."""

import hashlib
import json
import os
from pathlib import Path

import numpy as np

from ..analysis import Analysis, Confidence, Options
from ..errors import InputError, OutputError, PhotolinError
from ..factors import Thresholds
from ..load import LoadOptions, load_stack
from ..shape.recover import Shape
from ..stack import ImageStack
from .arrays import CONFIDENCE, read_arrays, result_npz
from .files import write_files
from .report import (
    REPORT,
    RESULT,
    describe_analysis,
    describe_reading,
    describe_shape,
    foreign,
    read_report,
    restore_reading,
    restore_resolved,
    restore_scale,
)


def save_result(
    analysis: Analysis,
    folder: str | Path,
    *,
    shape: Shape | None = None,
    command: str | None = None,
    stack_path: str | Path | None = None,
    load_options: LoadOptions | None = None,
) -> None:
    """Write `folder`/result.npz and `folder`/report.json, replacing an earlier result.

    Args:
        analysis: what to write.
        shape: of the same stack; its normals, albedo, depth and lights are written too.
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
        analysis, shape=shape, command=command, stack_path=stack_path, load_options=load_options
    )
    write_files(folder, files)


def result_files(
    analysis: Analysis,
    *,
    shape: Shape | None = None,
    command: str | None = None,
    stack_path: str | Path | None = None,
    load_options: LoadOptions | None = None,
) -> dict[str, bytes]:
    """Encode what `save_result` writes, by the same arguments: file name to bytes."""
    arrays = result_npz(analysis, shape)
    report = describe_analysis(analysis) | {
        "command": command,
        "stack": None if stack_path is None else str(Path(stack_path).resolve()),
        "load": None if load_options is None else describe_reading(load_options),
        "shape": None if shape is None else describe_shape(shape),
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


def load_result(path: str | Path) -> Analysis:
    """Read back what `save_result` wrote: equal to what was saved.

    Args:
        path: the folder, or the result.npz in it.

    Raises:
        InputError: a file is missing, cut short, or not a photolin result.
    """
    file = _result_file(path)
    report, arrays = read_report(file), read_arrays(file)
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
            lights=arrays.get("given_lights" if "normals" in arrays else "lights"),
            files=tuple((entry["path"], entry["sha256"]) for entry in report["files"]),
            notes=tuple(report["notes"]),
            warnings=tuple(report["warnings"]),
        )
    except (KeyError, TypeError, ValueError, PhotolinError) as error:
        raise foreign(file.with_name(REPORT)) from error


def load_shape(path: str | Path) -> Shape | None:
    """Read back the shape of a result; None where it has none.

    Raises:
        InputError: a file is missing, cut short, or not a photolin result.
    """
    file = _result_file(path)
    told, arrays = read_report(file).get("shape"), read_arrays(file)
    if told is None:
        return None
    try:
        unknown = arrays["mask"] & ~arrays["determined"]
        normals, albedo, depth = arrays["normals"], arrays["albedo"], arrays.get("depth")
        normals[unknown] = albedo[unknown] = np.nan
        px_mm = restore_scale(told)
        if depth is not None:
            depth = (depth / (px_mm or 1)).astype(np.float32)
        return Shape(normals, albedo, depth, arrays["lights"], restore_resolved(told), px_mm)
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
