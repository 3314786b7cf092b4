"""All files of a recovered shape."""

import numpy as np
from numpy.typing import NDArray

from ..analysis import Analysis
from ..errors import DegenerateError
from ..shape.mesh import build_mesh
from ..shape.recover import Shape
from .maps import Convention
from .shape import shape_files


def surface_files(
    found: Shape,
    analysis: Analysis,
    colour: NDArray[np.float32] | None = None,
    convention: Convention = "opengl",
) -> dict[str, bytes]:
    """Encode a shape for `write_files` or `zip_files`. Space is x right, y up, z to the camera.

    Args:
        analysis: what it was recovered from.
        colour: (H,W,3) albedo of the channels, in place of the shape's own.
        convention: of the PNG of the normals.

    Returns:
        File name to bytes, see `shape_files`; without a mesh where no neighbours have depth.
    """
    mesh = None
    if found.depth is not None:
        try:
            mesh = build_mesh(found.depth, analysis.mask, found.px_mm or 1.0)
        except DegenerateError:  # single pixels
            mesh = None
    return shape_files(
        analysis.mask,
        normals=found.normals,
        albedo=found.albedo if colour is None else colour,
        depth=found.depth,
        mesh=mesh,
        lights=found.lights,
        names=analysis.names,
        px_mm=found.px_mm,
        convention=convention,
    )
