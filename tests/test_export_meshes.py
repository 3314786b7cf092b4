"""Meshes in files, as another reader reads them."""

import io
import tracemalloc
from typing import Any

import imagecodecs
import numpy as np
import pytest

from photolin.errors import InputError
from photolin.export.meshes import mesh_obj, mesh_ply
from photolin.shape.mesh import Mesh, build_mesh

H, W = 7, 10
rng = np.random.default_rng(0)
DEPTH = rng.normal(0, 0.5, (H, W))
MASK = np.ones((H, W), bool)
MASK[:2, :3] = False
ALBEDO = rng.uniform(0.1, 0.8, (H, W))


@pytest.fixture
def mesh() -> Mesh:
    return build_mesh(DEPTH, MASK, 0.25)


def srgb(linear: np.ndarray) -> np.ndarray:
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055) * 255


def parse_ply(data: bytes) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Header lines, vertices and faces."""
    header, body = data.split(b"end_header\n", 1)
    lines = header.decode("ascii").splitlines()
    kinds = {"float": "<f4", "uchar": "u1"}
    properties = [line.split()[1:] for line in lines if line.startswith("property")]
    record = np.dtype([(name, kinds[kind]) for kind, name in properties[:-1]])
    assert properties[-1] == ["list", "uchar", "int", "vertex_indices"]
    count = int(next(line for line in lines if line.startswith("element vertex")).split()[2])
    vertices = np.frombuffer(body, record, count)
    faces = np.frombuffer(body[vertices.nbytes :], [("n", "u1"), ("v", "<i4", 3)])
    assert (faces["n"] == 3).all()
    assert f"element face {len(faces)}" in lines
    return lines, vertices, faces["v"]


def test_ply_holds_the_mesh_and_says_axes_and_unit(mesh: Mesh) -> None:
    lines, vertices, faces = parse_ply(mesh_ply(mesh, "mm"))
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    assert "comment axes: x right, y up, z to the camera; unit: mm" in lines
    assert vertices.dtype.names == ("x", "y", "z", "s", "t")
    np.testing.assert_array_equal(np.stack([vertices[k] for k in "xyz"], 1), mesh.vertices)
    np.testing.assert_array_equal(np.stack([vertices[k] for k in "st"], 1), mesh.uv)
    np.testing.assert_array_equal(faces, mesh.faces)


def test_ply_colours_are_srgb_of_the_albedo_of_each_vertex(mesh: Mesh) -> None:
    for albedo in (ALBEDO, np.stack([ALBEDO, ALBEDO / 2, 0 * ALBEDO], axis=2)):
        lines, vertices, _ = parse_ply(mesh_ply(mesh, "pixels", albedo))
        found = np.stack([vertices[k] for k in ("red", "green", "blue")], axis=1)
        wanted = srgb(albedo.reshape(H * W, -1)[mesh.pixels] / albedo.max())
        np.testing.assert_allclose(found, np.broadcast_to(wanted, found.shape), atol=0.51)
        assert f"comment colours: sRGB of albedo / {float(albedo.max())!r}" in lines
    nothing = parse_ply(mesh_ply(mesh, "mm", np.full((H, W), np.nan)))[1]
    assert not nothing["red"].any()


def test_obj_names_its_material_and_its_texture(mesh: Mesh) -> None:
    files = mesh_obj(mesh, "mm", ALBEDO, "vase")
    assert list(files) == ["vase.obj", "vase.mtl", "vase.png"]
    lines = files["vase.obj"].decode("ascii").splitlines()
    assert lines[0] == "# axes: x right, y up, z to the camera; unit: mm"
    assert "mtllib vase.mtl" in lines
    assert "usemtl albedo" in lines
    material = files["vase.mtl"].decode("ascii").splitlines()
    assert "newmtl albedo" in material
    assert "map_Kd vase.png" in material

    def table(word: str) -> list[list[str]]:
        return [line.split()[1:] for line in lines if line.split()[0] == word]

    np.testing.assert_allclose(np.array(table("v"), float), mesh.vertices, rtol=1e-6)
    np.testing.assert_allclose(np.array(table("vt"), float), mesh.uv, rtol=1e-6)
    corners = [[corner.split("/") for corner in face] for face in table("f")]
    np.testing.assert_array_equal(
        np.array(corners, int) - 1, np.stack([mesh.faces, mesh.faces], axis=2)
    )
    # the texture at (u, v up) shows the pixel of the vertex
    texture = imagecodecs.png_decode(files["vase.png"])
    column = np.floor(mesh.uv[:, 0] * W).astype(int)
    row = np.floor((1 - mesh.uv[:, 1]) * H).astype(int)
    np.testing.assert_array_equal(row * W + column, mesh.pixels)
    wanted = srgb(ALBEDO / ALBEDO.max())[row, column]
    np.testing.assert_allclose(texture[row, column, 1], wanted, atol=0.51)


def test_an_obj_takes_little_more_memory_than_it_is_long() -> None:
    large = build_mesh(np.zeros((400, 400)), np.ones((400, 400), bool))
    tracemalloc.start()
    data = mesh_obj(large, "pixels")["mesh.obj"]
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert data.count(b"\n") == 2 + 2 * 160_000 + 2 * 399 * 399
    assert peak < 4 * len(data)


def test_without_albedo_an_obj_has_no_material(mesh: Mesh) -> None:
    files = mesh_obj(mesh, "pixels")
    assert list(files) == ["mesh.obj"]
    assert b"mtl" not in files["mesh.obj"]


@pytest.mark.parametrize("kind", ["ply", "obj"])
def test_another_reader_finds_the_same_mesh(mesh: Mesh, kind: str) -> None:
    trimesh: Any = pytest.importorskip("trimesh", reason="trimesh is not installed")
    data = mesh_ply(mesh, "mm", ALBEDO) if kind == "ply" else mesh_obj(mesh, "mm")["mesh.obj"]
    found = trimesh.load(io.BytesIO(data), file_type=kind, process=False)
    np.testing.assert_allclose(found.vertices, mesh.vertices, rtol=1e-6)
    np.testing.assert_array_equal(found.faces, mesh.faces)
    assert (found.face_normals[:, 2] > 0).all()


def test_the_order_of_albedo_in_memory_does_not_matter(mesh: Mesh) -> None:
    colour = np.stack([ALBEDO, ALBEDO / 2, ALBEDO / 3], axis=2)
    for albedo in (ALBEDO, colour):
        other = np.asfortranarray(albedo)
        assert mesh_ply(mesh, "mm", other) == mesh_ply(mesh, "mm", albedo)
        assert mesh_obj(mesh, "mm", other) == mesh_obj(mesh, "mm", albedo)


def test_albedo_of_another_picture_is_refused(mesh: Mesh) -> None:
    for call in (mesh_ply, mesh_obj):
        with pytest.raises(InputError, match="albedo of that picture is accepted"):
            call(mesh, "mm", ALBEDO[:-1])
