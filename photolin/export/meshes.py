"""Meshes as PLY and OBJ."""

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..errors import InputError
from ..shape.mesh import Mesh
from .maps import AXES, Unit

LINES = 1 << 16
"""Lines of OBJ that are written at once."""


def mesh_ply(mesh: Mesh, unit: Unit, albedo: NDArray[np.floating] | None = None) -> bytes:
    """Encode a mesh as binary little-endian PLY.

    Vertices have x, y, z, the texture coordinates s (right) and t (up), and, with albedo, colours:
    sRGB of albedo over its largest value. Comments name the axes and the unit.

    Args:
        unit: of the vertices.
        albedo: (H,W) or (H,W,3) of the picture the mesh was built from.

    Raises:
        InputError: the albedo does not fit the mesh.
    """
    fields = [(name, "<f4") for name in ("x", "y", "z", "s", "t")]
    comments = [f"axes: {AXES}; unit: {unit}", "s, t: texture coordinates, s right, t up"]
    if albedo is not None:
        fields += [(name, "u1") for name in ("red", "green", "blue")]
        comments.append(f"colours: sRGB of albedo / {_white(albedo)!r}")
    vertices = np.empty(len(mesh.vertices), fields)
    for k, name in enumerate("xyz"):
        vertices[name] = mesh.vertices[:, k]
    for k, name in enumerate("st"):
        vertices[name] = mesh.uv[:, k]
    if albedo is not None:
        colours = _colours(albedo).reshape(-1, 3)
        _check_fit(mesh, colours)
        for k, name in enumerate(("red", "green", "blue")):
            vertices[name] = colours[mesh.pixels, k]
    faces = np.empty(len(mesh.faces), [("count", "u1"), ("vertex_indices", "<i4", 3)])
    faces["count"], faces["vertex_indices"] = 3, mesh.faces
    kinds = {"<f4": "float", "u1": "uchar"}
    header = [
        "ply",
        "format binary_little_endian 1.0",
        *(f"comment {text}" for text in comments),
        f"element vertex {len(vertices)}",
        *(f"property {kinds[kind]} {name}" for name, kind in fields),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    return "\n".join(header).encode("ascii") + vertices.tobytes() + faces.tobytes()


def mesh_obj(
    mesh: Mesh, unit: Unit, albedo: NDArray[np.floating] | None = None, stem: str = "mesh"
) -> dict[str, bytes]:
    """Encode a mesh as OBJ with texture coordinates, and with albedo its material and texture.

    Args:
        unit: of the vertices.
        albedo: (H,W) or (H,W,3) of the picture the mesh was built from.
        stem: file name without ending, of letters that need no quoting.

    Returns:
        File name to bytes: stem.obj; with albedo stem.mtl and stem.png, 8-bit sRGB of albedo over
        its largest value.

    Raises:
        InputError: the albedo does not fit the mesh.
    """
    lines = [f"# axes: {AXES}; unit: {unit}", "# vt: texture coordinates, u right, v up"]
    files: dict[str, bytes] = {}
    if albedo is not None:
        colours = _colours(albedo)
        _check_fit(mesh, colours.reshape(-1, 3))
        lines += [f"mtllib {stem}.mtl", "usemtl albedo"]
        material = (
            f"# texture: sRGB of albedo / {_white(albedo)!r}\n"
            f"newmtl albedo\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {stem}.png\n"
        )
        buffer = io.BytesIO()
        Image.fromarray(colours).save(buffer, "PNG")
        files = {f"{stem}.mtl": material.encode("ascii"), f"{stem}.png": buffer.getvalue()}
    text = io.BytesIO()
    text.write(("\n".join(lines) + "\n").encode("ascii"))
    _write_lines(text, "v %.7g %.7g %.7g\n", mesh.vertices)
    _write_lines(text, "vt %.7g %.7g\n", mesh.uv)
    _write_lines(text, "f %d/%d %d/%d %d/%d\n", mesh.faces.repeat(2, axis=1), 1)
    return {f"{stem}.obj": text.getvalue()} | files


def _write_lines(
    text: io.BytesIO, line: str, rows: NDArray[np.floating] | NDArray[np.int32], more: int = 0
) -> None:
    """A line for each of `rows` (N,M), with `more` added to its numbers."""
    # numbers of Python take ten times the memory of those of an array: a few at a time
    for start in range(0, len(rows), LINES):
        some = rows[start : start + LINES] + more
        text.write((line * len(some) % tuple(some.ravel().tolist())).encode("ascii"))


def _white(albedo: NDArray[np.floating]) -> float:
    """Largest albedo; 1 where all is 0 or NaN."""
    return float(np.where(np.isfinite(albedo), albedo, 0).max(initial=0)) or 1.0


def _colours(albedo: NDArray[np.floating]) -> NDArray[np.uint8]:
    """(H,W,3) sRGB (IEC 61966-2-1) of albedo over its largest value; 0 where NaN."""
    linear = np.where(np.isfinite(albedo), albedo, 0).astype(np.float64) / _white(albedo)
    linear = linear.clip(0, 1)
    curved = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    values = np.round(255 * curved).astype(np.uint8)
    return values if values.ndim == 3 else np.repeat(values[:, :, None], 3, axis=2)


def _check_fit(mesh: Mesh, colours: NDArray[np.uint8]) -> None:
    if len(colours) <= mesh.pixels.max(initial=-1):
        raise InputError(
            f"albedo has {len(colours)} pixels, fewer than the picture the mesh was built from; "
            "albedo of that picture is accepted"
        )
