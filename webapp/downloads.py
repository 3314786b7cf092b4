"""Files for the browser to save: what is on screen, by the thresholds on screen. Pure."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from photolin.analysis import Analysis
from photolin.errors import OptionError
from photolin.export import export_files, result_files, safe_name, zip_files
from photolin.export.html import report_html
from photolin.export.maps import Convention
from photolin.export.surface import surface_files
from photolin.factors import Thresholds
from photolin.label import label_images
from photolin.shape.recover import Shape
from photolin.stack import ImageStack

from .frame import Recovered

SHAPE = "shape"
"""The kind of `make_shape_download`."""
REPORT = "report"
"""The kind of `make_report`."""
Pack = Callable[[Analysis], Mapping[str, bytes]]
"""Gives the files of a result, name to bytes, as `result_files` does."""


def relabel(stack: ImageStack, analysis: Analysis, thresholds: Thresholds) -> Analysis:
    """The analysis with labels by `thresholds`; a note says what its bases were computed with."""
    if thresholds == analysis.thresholds:
        return analysis
    used = analysis.thresholds
    labels = label_images(
        stack.images,
        analysis.linearized_bases,
        analysis.coefficients,
        analysis.mask,
        thresholds,
    )
    note = (
        f"labels by T {thresholds.T:g}, Ts {thresholds.Ts:g}; bases by T {used.T:g}, Ts {used.Ts:g}"
    )
    return replace(analysis, labels=labels, thresholds=thresholds, notes=(*analysis.notes, note))


def make_download(
    analysis: Analysis, kind: str, image: int | None, pack: Pack = result_files
) -> tuple[str, bytes]:
    """Name and bytes of one download.

    Args:
        analysis: labelled by the thresholds on screen.
        kind: masks, labels, linearized or result.
        image: image number from 0; None for all (result always holds all).
        pack: gives the files of a result.

    Raises:
        OptionError: no such kind.
    """
    stem = safe_name(analysis.title) or "stack"
    which = "all" if image is None else f"{image:03d}"
    images = None if image is None else [image]
    match kind:
        case "result":
            return f"{stem}_result.zip", zip_files(pack(analysis))
        case "linearized":
            (data,) = export_files(analysis, "linearized", images).values()
            return f"{stem}_{which}_linearized.tif", data
        case "masks" | "labels":
            return f"{stem}_{which}_{kind}.zip", zip_files(export_files(analysis, kind, images))
    raise OptionError(f"export is {kind!r}; accepted are masks, labels, linearized and result")


def make_report(
    analysis: Analysis, stack: ImageStack, shape: Shape | None, command: str | None, notes: str
) -> tuple[str, bytes]:
    """Name and bytes of the web page that tells a result to others, by arguments of `report_html`.

    Args:
        analysis: labelled by the thresholds on screen.
    """
    stem = safe_name(analysis.title) or "stack"
    page = report_html(analysis, stack=stack, shape=shape, command=command, notes=notes)
    return f"{stem}_report.html", page


def make_shape_download(
    recovered: Recovered,
    result: Mapping[str, bytes],
    colour: NDArray[np.float32] | None = None,
    convention: Convention = "opengl",
) -> tuple[str, bytes]:
    """Name and bytes of a zip of what `photolin shape` writes.

    Args:
        result: the files of the result and its shape, as `result_files` gives them.
        colour: (H,W,3) albedo of the channels, in place of the shape's own.
        convention: of the PNG of the normals.
    """
    found, analysis = recovered.shape, recovered.analysis
    stem = safe_name(analysis.title) or "stack"
    files = surface_files(found, analysis, colour, convention)
    return f"{stem}_shape.zip", zip_files({**result, **files})
