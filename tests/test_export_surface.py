"""All files of a recovered shape, whoever asks for them."""

from dataclasses import replace

import numpy as np
import pytest

from photolin.analysis import Options
from photolin.export.shape import shape_files
from photolin.export.surface import surface_files
from photolin.pipeline import analyze
from photolin.shape.mesh import build_mesh
from photolin.shape.recover import recover_shape
from photolin.shape.resolve import resolve_ambiguity
from photolin.synthetic import render_scene

STACK = render_scene("sphere_cone", size=(24, 32), images=8).stack
RESULT = analyze(STACK, Options(T=0.05, Ts=0.02, samples=50))
SHAPE = recover_shape(STACK, RESULT, resolve_ambiguity(RESULT))
NO_MESH = {"mesh.ply", "mesh.obj", "mesh.mtl", "mesh.png"}


@pytest.mark.parametrize("px_mm", [None, 0.25])
def test_the_files_are_those_of_the_parts(px_mm: float | None) -> None:
    assert SHAPE.depth is not None
    files = surface_files(replace(SHAPE, px_mm=px_mm), RESULT)
    assert files == shape_files(
        RESULT.mask,
        normals=SHAPE.normals,
        albedo=SHAPE.albedo,
        depth=SHAPE.depth,
        mesh=build_mesh(SHAPE.depth, RESULT.mask, px_mm or 1.0),
        lights=SHAPE.lights,
        names=RESULT.names,
        px_mm=px_mm,
    )
    assert set(files) > NO_MESH


def test_colour_takes_the_place_of_the_albedo_and_the_convention_names_its_file() -> None:
    colour = np.random.default_rng(0).uniform(0, 1, (24, 32, 3)).astype(np.float32)
    grey, coloured = surface_files(SHAPE, RESULT), surface_files(SHAPE, RESULT, colour, "directx")
    assert "normals_directx.png" in coloured
    assert "normals_opengl.png" in grey
    assert grey["albedo.tif"] != coloured["albedo.tif"]
    assert grey["depth.tif"] == coloured["depth.tif"]


def test_single_pixels_have_no_mesh_and_no_depth_has_no_depth_file() -> None:
    assert SHAPE.depth is not None
    lone = np.full_like(SHAPE.depth, np.nan)
    row, column = np.argwhere(RESULT.mask)[0]
    lone[row, column] = 0
    whole = set(surface_files(SHAPE, RESULT))
    assert set(surface_files(replace(SHAPE, depth=lone), RESULT)) == whole - NO_MESH
    flat = set(surface_files(replace(SHAPE, depth=None), RESULT))
    assert flat == whole - NO_MESH - {"depth.tif"}
