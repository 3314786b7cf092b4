"""Meshes: where vertices lie, which way faces look, what is not joined."""

from typing import Any

import numpy as np
import pytest

from photolin.errors import DegenerateError, InputError, OptionError
from photolin.shape.mesh import Mesh, build_mesh

Array = np.ndarray


def wavy(H: int = 12, W: int = 17) -> Array:
    row, column = np.mgrid[:H, :W]
    return np.sin(row / 3) + np.cos(column / 4)


def everywhere(depth: Array) -> Array:
    return np.ones(depth.shape, bool)


def normals(mesh: Mesh) -> Array:
    """(M,3) of the length of twice the area of each face."""
    a, b, c = mesh.vertices[mesh.faces].astype(float).swapaxes(0, 1)
    return np.cross(b - a, c - a)


def test_vertices_lie_at_the_middle_of_pixels_with_y_up() -> None:
    depth = wavy(3, 4)
    mesh = build_mesh(depth, everywhere(depth), 0.5)
    np.testing.assert_array_equal(mesh.pixels, np.arange(12))
    np.testing.assert_allclose(mesh.vertices[0], [-0.75, 0.5, 0.5 * depth[0, 0]], rtol=1e-6)
    np.testing.assert_allclose(mesh.vertices[11], [0.75, -0.5, 0.5 * depth[2, 3]], rtol=1e-6)
    np.testing.assert_allclose(mesh.uv[0], [1 / 8, 5 / 6], rtol=1e-6)
    np.testing.assert_allclose(mesh.uv[11], [7 / 8, 1 / 6], rtol=1e-6)
    for array, dtype in ((mesh.vertices, "f4"), (mesh.faces, "i4"), (mesh.uv, "f4")):
        assert array.dtype == dtype
        assert not array.flags.writeable


@pytest.mark.parametrize("step", [1, 2, 5])
def test_faces_look_at_the_camera_and_cover_the_picture_once(step: int) -> None:
    depth = wavy(11, 21)
    mesh = build_mesh(depth, everywhere(depth), step=step)
    area = normals(mesh)[:, 2] / 2
    assert (area > 0).all()
    assert area.sum() == pytest.approx(10 * 20)
    row, column = np.divmod(mesh.pixels, 21)
    assert (row % step == 0).all()
    assert (column % step == 0).all()
    np.testing.assert_allclose(mesh.vertices[:, 2], depth.ravel()[mesh.pixels], rtol=1e-6)


def test_depth_times_px_gives_a_mesh_of_the_same_shape() -> None:
    depth = wavy()
    one, ten = (build_mesh(depth, everywhere(depth), px) for px in (1, 10))
    np.testing.assert_allclose(ten.vertices, 10 * one.vertices, rtol=1e-6)
    np.testing.assert_array_equal(one.faces, ten.faces)


def test_only_pixels_of_the_mask_with_depth_are_joined_and_three_make_a_triangle() -> None:
    for hole in np.ndindex(2, 2):
        depth, mask = np.zeros((2, 2)), np.ones((2, 2), bool)
        mask[hole] = False
        mesh = build_mesh(depth, mask)
        assert len(mesh.faces) == 1
        assert normals(mesh)[0, 2] == 1
        np.testing.assert_array_equal(mesh.pixels, np.flatnonzero(mask))
        depth[hole] = np.nan
        assert len(build_mesh(depth, np.ones((2, 2), bool)).faces) == 1
    lonely = np.zeros((4, 6), bool)
    lonely[:3, :3] = lonely[3, 5] = True
    assert 23 not in build_mesh(np.zeros(lonely.shape), lonely).pixels


def test_jumps_of_depth_are_not_bridged() -> None:
    depth = wavy(10, 14)
    depth[:, 7:] += 14
    depth[4:, :3] -= 14
    mesh = build_mesh(depth, everywhere(depth))
    assert len(mesh.pixels) == depth.size
    spans = np.ptp(depth.ravel()[mesh.pixels[mesh.faces]], axis=1)
    assert spans.max() < 3
    joined = build_mesh(depth, everywhere(depth), steepest=20)
    assert len(joined.faces) == 2 * 9 * 13
    assert build_mesh(depth, everywhere(depth), step=2).faces.size < joined.faces.size / 4


@pytest.mark.parametrize(("slope", "faces"), [(9.99, 2), (10.01, 0)])
def test_slopes_up_to_ten_are_a_surface_at_any_step(slope: float, faces: int) -> None:
    for step in (1, 3):
        depth = slope * np.tile(np.arange(step + 1.0), (step + 1, 1))
        if faces:
            assert len(build_mesh(depth, everywhere(depth), step=step).faces) == faces
        else:
            with pytest.raises(DegenerateError, match="no three neighbouring pixels"):
                build_mesh(depth, everywhere(depth), step=step)


@pytest.mark.parametrize(("low", "high", "joined"), [(7, 13.9, True), (9, 14.5, False)])
def test_diagonals_may_rise_as_much_over_their_greater_length(
    low: float, high: float, joined: bool
) -> None:
    depth = np.array([[0, np.nan], [low, high], [low, low]])
    faces = build_mesh(depth, everywhere(depth)).faces
    assert len(faces) == 2 + joined


def test_squares_are_cut_along_the_diagonal_with_less_difference() -> None:
    for k, edge in enumerate([{1, 2}, {0, 3}]):
        depth = np.zeros((2, 2))
        depth[0, k] = 1
        faces = build_mesh(depth, everywhere(depth)).faces
        assert set(faces[0]) & set(faces[1]) == edge


def test_most_vertices_takes_the_least_step_that_is_enough() -> None:
    depth = wavy(60, 90)
    mesh = build_mesh(depth, everywhere(depth), most_vertices=700)
    assert len(mesh.vertices) == 20 * 30
    assert len(build_mesh(depth, everywhere(depth), most_vertices=599).vertices) == 15 * 23
    assert len(build_mesh(depth, everywhere(depth), most_vertices=5400).vertices) == 5400


def test_what_does_not_fit_is_refused() -> None:
    depth = wavy()
    for wrong, mask in ((depth[1:], everywhere(depth)), (depth, everywhere(depth).astype(float))):
        with pytest.raises(InputError, match="and a bool mask are accepted"):
            build_mesh(wrong, mask)  # pyright: ignore[reportArgumentType]
    options: list[dict[str, Any]] = [
        {"px": 0},
        {"px": np.nan},
        {"step": 0},
        {"most_vertices": 2},
        {"steepest": 0},
    ]
    for option in options:
        with pytest.raises(OptionError, match=f"{next(iter(option))} is .*; accepted is"):
            build_mesh(depth, everywhere(depth), **option)


def test_no_triangle_is_said() -> None:
    depth = np.full((5, 5), np.nan)
    depth[::2, ::2] = 0
    with pytest.raises(DegenerateError, match="no three neighbouring pixels have depth"):
        build_mesh(depth, everywhere(depth))
    with pytest.raises(DegenerateError, match="at a step of"):
        build_mesh(wavy(), everywhere(wavy()), most_vertices=3)
