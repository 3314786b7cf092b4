"""Table 3 of Mukaigawa et al. 2007: the surfaces that methods lead to, against the truth."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..analysis import Analysis, Cancel, Method, Progress
from ..errors import DegenerateError, InputError
from ..stack import ImageStack
from .compare_surface import SurfaceErrors, compare_surface
from .depth import integrate_normals
from .grazing import fit_grazing
from .normals import normals_from_bases
from .photometric_stereo import factorize_all, fit_all
from .points import resolve_from_points
from .true_surface import TrueSurface

SIMPLE = "simple"
"""Photometric stereo on all observations, shadows and highlights included."""
SLANT = 35.0
"""Degrees between the camera's direction and the normals that are wanted of four points."""
WELL_LIT = 0.25
"""Share of the images by which a point may be lit in fewer than the best lit pixel."""
POINTS = (
    f"five points of known normal: of the pixels lit in nearly all images, those that come closest "
    f"to facing the camera, and {SLANT:g} degrees to the right, left, top and bottom of it"
)


@dataclass(frozen=True, eq=False)
class MethodErrors:
    """Errors of each method, all over the same pixels."""

    errors: Mapping[str, SurfaceErrors]
    """Method to errors: `simple` and the methods of the analyses."""
    pixels: int
    """How many pixels the methods were compared on."""
    note: str
    """One sentence: where, and how the ambiguity was resolved."""


def compare_methods(
    stack: ImageStack,
    analyses: Mapping[Method, Analysis],
    true: TrueSurface,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> MethodErrors:
    """Normals and depth by simple photometric stereo and by the bases of each method.

    They are compared where the analysis by `robust` is determined, on the object the truth names,
    or on the whole mask. With unknown lights the same five points of true normal resolve each
    method's own bases (section 4.C). Depth is integrated over the compared pixels alone.

    Args:
        analyses: of this stack, method to result; `robust` among them.

    Raises:
        InputError: another size than the truth has.
        DegenerateError: nothing to compare, or the five points do not determine the ambiguity.
        Cancelled: `cancel` said so.
    """
    if stack.shape[1:] != true.mask.shape:
        H, W = true.mask.shape
        raise InputError(
            f"the images are of {stack.shape[1]} x {stack.shape[2]} pixels, the truth of {H} x "
            f"{W}; the truth of this stack is accepted"
        )
    robust = analyses["robust"]
    where = true.mask & robust.determined()
    where = where if true.thing is None else where & true.thing
    if not where.any():
        raise DegenerateError("no pixel of the truth is determined; at least one is needed")
    bases: dict[Method, NDArray[np.float32]] = {
        method: found.linearized_bases for method, found in analyses.items()
    }
    bases["robust"] = fit_grazing(stack, robust, threads=threads, progress=progress, cancel=cancel)
    vectors = _resolve(stack, analyses, bases, true, where)
    errors = {}
    for method, normals in vectors.items():
        z = None
        if true.depth is not None:
            z = integrate_normals(normals, where, progress=progress, cancel=cancel)
        errors[method] = compare_surface(normals, true, depth=z, where=where)
    place = "on the whole mask"
    place = place if true.thing is None else "on the object the truth names"
    how = POINTS if stack.lights is None else "the lights given with the stack"
    return MethodErrors(errors, int(where.sum()), f"{place}, resolved by {how}")


def _resolve(
    stack: ImageStack,
    analyses: Mapping[Method, Analysis],
    bases: Mapping[Method, NDArray[np.float32]],
    true: TrueSurface,
    where: NDArray[np.bool_],
) -> dict[str, NDArray[np.float32]]:
    """(H,W,3) normals of each method, `simple` first."""
    if stack.lights is not None:
        simple = normals_from_bases(fit_all(stack, stack.lights), np.eye(3))[0]
        matrices = {
            method: np.linalg.inv(stack.lights[list(found.base_images)])
            for method, found in analyses.items()
        }
        found = {method: normals_from_bases(bases[method], matrices[method])[0] for method in bases}
        return {SIMPLE: simple, **found}
    every = {SIMPLE: factorize_all(stack)[0], **bases}
    usable = where & (true.normals[..., 2] > 0)
    usable &= np.all([np.isfinite(b).all(0) & b.any(0) for b in every.values()], axis=0)
    lit = (stack.images >= analyses["robust"].thresholds.Ts).sum(axis=0)
    rows, columns = choose_points(true.normals, usable, lit, len(stack.images))
    normals = true.normals[rows, columns]
    return {
        method: normals_from_bases(b, resolve_from_points(b, rows, columns, normals).matrix)[0]
        for method, b in every.items()
    }


def choose_points(
    normals: NDArray[np.floating],
    usable: NDArray[np.bool_],
    lit: NDArray[np.integer],
    count: int,
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of five pixels, by the rule that POINTS states.

    Args:
        normals: (H,W,3) true unit normals.
        usable: (H,W) pixels to choose from.
        lit: (H,W) number of images in which a pixel is lit.
        count: number of images.

    Raises:
        DegenerateError: no pixel is usable.
    """
    if not usable.any():
        raise DegenerateError(
            "no pixel of the truth is determined by every method; points of known normal need one"
        )
    rows, columns = np.nonzero(usable & (lit >= lit[usable].max() - WELL_LIT * count))
    slant = np.radians(SLANT)
    sides = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])
    tilted = np.column_stack([np.sin(slant) * sides, np.full(4, np.cos(slant))])
    wanted = np.vstack([tilted, (0, 0, 1)])
    # the first in raster order of those that come equally close
    nearest = (normals[rows, columns] @ wanted.T).argmax(axis=0)
    return rows[nearest], columns[nearest]
