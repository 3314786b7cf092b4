"""All files of a surface: which there are, in which unit, and that they are written."""

import io
from pathlib import Path

import numpy as np
import tifffile

from photolin.export import write_files
from photolin.export.shape import shape_files
from photolin.shape.depth import integrate_normals
from photolin.shape.mesh import build_mesh
from photolin.synthetic import render_scene


def test_a_rendered_scene_gives_all_files_in_mm(tmp_path: Path) -> None:
    truth = render_scene("sphere_obstacles", size=(40, 50), images=6).truth
    depth = integrate_normals(truth.normals, truth.mask)
    names = tuple(f"{k}.png" for k in range(6))
    files = shape_files(
        truth.mask,
        normals=truth.normals,
        albedo=truth.albedo,
        depth=depth,
        mesh=build_mesh(depth, truth.mask, truth.px_mm),
        lights=truth.lights,
        names=names,
        px_mm=truth.px_mm,
        convention="directx",
    )
    write_files(tmp_path, files)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "albedo.png",
        "albedo.tif",
        "depth.tif",
        "light_directions.txt",
        "light_intensities.txt",
        "lights.lp",
        "mesh.mtl",
        "mesh.obj",
        "mesh.ply",
        "mesh.png",
        "normals.npz",
        "normals.tif",
        "normals_directx.png",
    ]
    with tifffile.TiffFile(tmp_path / "depth.tif") as tiff:
        np.testing.assert_allclose(tiff.asarray(), depth * truth.px_mm, rtol=1e-6)
        assert "unit: mm" in str(tiff.pages[0].aspage().description)
    assert b"unit: mm" in files["mesh.ply"]
    assert b"unit: mm" in files["mesh.obj"]
    assert b"DirectX" in files["normals_directx.png"]


def test_only_what_is_given_is_encoded_and_depth_stays_in_pixels_without_a_scale() -> None:
    mask, depth = np.ones((4, 5), bool), np.arange(20.0).reshape(4, 5)
    assert shape_files(mask) == {}
    (data,) = shape_files(mask, depth=depth).values()
    with tifffile.TiffFile(io.BytesIO(data)) as tiff:
        np.testing.assert_array_equal(tiff.asarray(), depth)
        assert "unit: pixels" in str(tiff.pages[0].aspage().description)
    normals = np.ones((4, 5, 3))
    assert "normals_opengl.png" in shape_files(mask, normals=normals)
