"""`report.json`: what was asked, what was read, what came out."""

import hashlib
import json
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NotRequired, TypedDict

import msgspec
import numpy as np

from ..analysis import Analysis
from ..errors import InputError
from ..factors import TITLES, Factor, classifiable
from ..load import LoadOptions
from ..shape.recover import Shape, check_scale
from ..shape.resolved import RESIDUALS, Resolved

RESULT, REPORT = "result.npz", "report.json"
SINGULAR = 1e9
"""Condition from which a matrix has no normals, as in `normals_from_bases`."""


class FileEntry(TypedDict):
    """A file that was read."""

    path: str
    sha256: str


class ImageEntry(TypedDict):
    """An image of the stack."""

    name: str


class Report(TypedDict):
    """The entries of report.json that are read back."""

    title: str
    options: dict[str, Any]
    files: list[FileEntry]
    notes: list[str]
    warnings: list[str]
    images: list[ImageEntry]
    seconds: dict[str, float]
    stack: str | None
    load: dict[str, Any] | None
    shape: NotRequired[dict[str, Any] | None]


def program_version() -> str:
    """Version of the installed photolin."""
    try:
        return version("photolin")
    except PackageNotFoundError:
        return "not installed"  # run from its source folder


def describe_analysis(analysis: Analysis) -> dict[str, Any]:
    """What report.json says about the analysis itself."""
    # one image after another: all of them at once would be as large as the stack again
    images, supported = [], np.zeros(int(analysis.mask.sum()), np.int64)
    for k, name in enumerate(analysis.names):
        inside = analysis.labels[k][analysis.mask]
        fitting = classifiable(inside)
        supported += fitting
        counts = np.bincount(inside, minlength=256)
        images.append(
            {
                "name": name,
                "counts": {TITLES[factor]: int(counts[factor]) for factor in Factor},
                "support": float(fitting.mean()),
            }
            | describe_confidence(analysis, k)
        )
    per_pixel = supported / len(analysis.names)
    return {
        "version": program_version(),
        "title": analysis.title,
        "options": asdict(analysis.options),
        "seed": analysis.options.seed,
        "thresholds": asdict(analysis.thresholds),
        "base_images": list(analysis.base_images),
        "files": [{"path": path, "sha256": digest} for path, digest in analysis.files],
        "notes": list(analysis.notes),
        "warnings": list(analysis.warnings),
        "images": images,
        "undetermined": int((analysis.mask & ~analysis.determined()).sum()),
        "support": {
            "pixels": int(per_pixel.size),
            "mean": float(per_pixel.mean()),
            **{f"p{q:02d}": float(np.percentile(per_pixel, q)) for q in (5, 25, 50, 75, 95)},
        },
        "seconds": dict(analysis.seconds),
    }


def describe_confidence(analysis: Analysis, k: int) -> dict[str, float]:
    """What `Confidence` says of image k; `support` there is `possible` here, by Eq. (5) it is D, A
    and C among all pixels."""
    c = analysis.confidence
    if c is None:
        return {}
    return {
        "possible": float(c.support[k]),
        "residual": float(c.residual[k]),
        "gain": float(c.gain[k]),
        "saturated": float(c.saturated[k]),
    }


def describe_shape(shape: Shape) -> dict[str, Any]:
    """How the ambiguity of unknown lights was resolved, and the units of the shape's arrays."""
    found = shape.resolved
    each = found.residuals
    return {
        "kind": found.kind,
        "matrix": found.matrix.tolist(),
        "residual": found.residual,
        "residual_means": found.residual_means,
        "residuals": None if each is None else each.tolist(),
        "scaled": found.scaled,
        "note": found.note,
        "warnings": list(found.doubts),
        "px_mm": shape.px_mm,
        "depth_unit": shape.unit,
        "axes": "x right, y up, z to the camera",
    }


def restore_resolved(entry: dict[str, Any]) -> Resolved:
    """What `describe_shape` wrote of the ambiguity; ValueError where that cannot have been."""
    each, matrix = entry["residuals"], np.array(entry["matrix"], float).reshape(3, 3)
    residuals = None if each is None else np.array(each, float).reshape(len(each))
    numbers = [*matrix.ravel(), float(entry["residual"]), *(() if each is None else each)]
    if entry["kind"] not in RESIDUALS or not np.isfinite(numbers).all():
        raise ValueError("neither matrix nor residuals of a shape")
    if not np.linalg.cond(matrix) < SINGULAR:
        raise ValueError("a matrix that resolves nothing")
    return Resolved(
        matrix,
        entry["kind"],
        float(entry["residual"]),
        bool(entry["scaled"]),
        str(entry["note"]),
        residuals,
        tuple(map(str, entry.get("warnings", ()))),
    )


def restore_scale(entry: dict[str, Any]) -> float | None:
    """mm per pixel as `describe_shape` wrote it; OptionError where no pixel has that."""
    px_mm = entry["px_mm"]
    check_scale(px_mm)
    return None if px_mm is None else float(px_mm)


def describe_reading(options: LoadOptions) -> dict[str, Any]:
    """Load options for the report: paths are absolute, so they hold from any folder."""
    return {k: str(v.resolve()) if isinstance(v, Path) else v for k, v in asdict(options).items()}


def restore_reading(entry: dict[str, Any] | None) -> LoadOptions:
    """Load options from the report."""
    entry = dict(entry or {})
    for name in ("mask", "lights", "dark"):
        if entry.get(name) not in (None, "none"):
            entry[name] = Path(entry[name])
    if entry.get("roi") is not None:
        entry["roi"] = tuple(entry["roi"])
    return LoadOptions(**entry)


def read_report(file: Path) -> Report:
    """The report beside result.npz, once it is known to be about that very file."""
    path = file.with_name(REPORT)
    try:
        report = json.loads(read_bytes(path))
    except ValueError as error:
        raise foreign(path) from error
    if not isinstance(report, dict):
        raise foreign(path)
    if report.get("result_sha256") != hashlib.sha256(read_bytes(file)).hexdigest():
        raise InputError(
            f"{file}: was cut short, or {REPORT} describes another; "
            "both files as photolin run wrote them are accepted"
        )
    try:
        return msgspec.convert(report, Report)
    except (msgspec.ValidationError, ValueError) as error:  # the latter for lone surrogates
        raise foreign(path) from error


def read_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({error.strerror}); a folder with {RESULT} and {REPORT}, "
            "as photolin run writes it, is accepted"
        ) from error


def foreign(path: Path) -> InputError:
    return InputError(
        f"{path}: is not a result of photolin or was cut short; "
        "a folder written by photolin run is accepted"
    )
