"""Axes turned round: noticed where normals then are a surface's, and only there."""

from functools import cache

import numpy as np
import pytest

from photolin import analyze
from photolin.analysis import Analysis
from photolin.shape.axes import doubt_axes
from photolin.shape.some_lights import resolve_from_lights
from photolin.synthetic import Scene, render_scene

SCENES = ("sphere_cone", "cup", "pot", "sphere_obstacles")
NOISES = (0.0, 0.03)


@cache
def scene(name: str, noise: float) -> tuple[Scene, Analysis]:
    rendered = render_scene(name, noise=noise, bits=8 if noise else 16)
    return rendered, analyze(rendered.stack)


def doubt(name: str, change: np.ndarray, noise: float = 0.0) -> str:
    """What is said of lights (K,3) that are the true ones times `change`."""
    rendered, analysis = scene(name, noise)
    lights = rendered.truth.lights.astype(float) @ change.T
    numbers = np.arange(len(lights))
    found = resolve_from_lights(analysis.coefficients, numbers, lights, powers=False)
    assert found.residual < 0.5  # they fit the images as well as the true ones
    return doubt_axes(analysis.linearized_bases, analysis.mask, found.matrix)


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("name", SCENES)
def test_right_axes_are_not_doubted(name: str, noise: float) -> None:
    assert doubt(name, np.eye(3), noise) == ""


@pytest.mark.parametrize("name", SCENES)
def test_y_downwards_is_said(name: str) -> None:
    said = doubt(name, np.diag([1.0, -1.0, 1.0]))
    which = "y (or x)" if scene(name, 0.0)[1].mask.all() else "y"
    assert f"and with {which} turned round they do" in said
    assert said.endswith("accepted as x right, y up, z to the camera")


def test_the_outline_tells_x_from_y() -> None:
    assert "with x turned round (or y, where the object is hollow)" in doubt(
        "pot", np.diag([-1.0, 1.0, 1.0])
    )


def test_rows_for_columns_are_said() -> None:
    swapped = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 1]])
    assert "with x and y exchanged they do" in doubt("pot", swapped)
    turned = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    assert "with x and y exchanged and y turned round they do" in doubt("pot", turned)


@pytest.mark.parametrize("name", SCENES)
def test_hollow_for_convex_is_a_surface_as_well(name: str) -> None:
    assert doubt(name, np.diag([-1.0, -1.0, 1.0])) == ""


def test_a_flat_or_small_surface_tells_nothing() -> None:
    bases = np.ones((3, 40, 40), np.float32)
    mask = np.ones((40, 40), bool)
    assert doubt_axes(bases, mask, np.diag([1.0, -1.0, 1.0])) == ""
    assert doubt_axes(bases * 0, mask, np.eye(3)) == ""
