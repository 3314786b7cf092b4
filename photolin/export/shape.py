"""All files of a surface at once: the same for a folder and for a browser."""

import numpy as np
from numpy.typing import NDArray

from ..shape.mesh import Mesh
from .lights import lights_diligent, lights_lp
from .maps import (
    Convention,
    Unit,
    albedo_png,
    albedo_tiff,
    depth_tiff,
    normals_npz,
    normals_png,
    normals_tiff,
)
from .meshes import mesh_obj, mesh_ply


def shape_files(
    mask: NDArray[np.bool_],
    *,
    normals: NDArray[np.floating] | None = None,
    albedo: NDArray[np.floating] | None = None,
    depth: NDArray[np.floating] | None = None,
    mesh: Mesh | None = None,
    lights: NDArray[np.floating] | None = None,
    names: tuple[str, ...] = (),
    px_mm: float | None = None,
    convention: Convention = "opengl",
) -> dict[str, bytes]:
    """Encode what is given, for `write_files`. Space is x right, y up, z to the camera.

    Args:
        mask: (H,W) bool.
        normals: (H,W,3) unit: normals.tif, normals.npz and normals_opengl.png, or
            normals_directx.png.
        albedo: (H,W) or (H,W,3): albedo.tif and albedo.png, and the colours of the mesh.
        depth: (H,W) in pixels: depth.tif, in mm where px_mm is given.
        mesh: mesh.ply, mesh.obj and, with albedo, mesh.mtl and mesh.png; its vertices are in mm
            where px_mm is given, else in pixels.
        lights: (K,3) direction times power: lights.lp, light_directions.txt and
            light_intensities.txt.
        names: K image names, for lights.
        px_mm: side of a pixel, mm; None where unknown.
        convention: of the PNG of the normals.

    Returns:
        File name to bytes.

    Raises:
        InputError, OptionError, DegenerateError: as the encoder of each file.
    """
    unit: Unit = "pixels" if px_mm is None else "mm"
    files: dict[str, bytes] = {}
    if normals is not None:
        files["normals.tif"] = normals_tiff(normals)
        files["normals.npz"] = normals_npz(normals, mask)
        files[f"normals_{convention}.png"] = normals_png(normals, convention)
    if albedo is not None:
        files["albedo.tif"], files["albedo.png"] = albedo_tiff(albedo), albedo_png(albedo)
    if depth is not None:
        scaled = depth.astype(np.float64) * (1 if px_mm is None else px_mm)
        files["depth.tif"] = depth_tiff(scaled, unit)
    if mesh is not None:
        files["mesh.ply"] = mesh_ply(mesh, unit, albedo)
        files |= mesh_obj(mesh, unit, albedo)
    if lights is not None:
        files["lights.lp"] = lights_lp(lights, names)
        files |= lights_diligent(lights)
    return files
