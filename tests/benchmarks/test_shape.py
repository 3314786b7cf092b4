"""Table 3 of the 2007 paper: the sphere with obstacles, by five points and with known lights.

    python -m pytest -o addopts="-p no:cacheprovider" tests/benchmarks/test_shape.py -rP

The POV-Ray stack beside the checkout is skipped where it is not there; the scene of photolin's own
renderer stands in for it, also with noise.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from photolin import ImageStack, LoadOptions, Options, analyze, load_stack, load_truth
from photolin.analysis import METHODS
from photolin.paper import compare_surfaces_with_paper
from photolin.shape.compare_methods import MethodErrors, compare_methods
from photolin.shape.sphere import sphere_normals
from photolin.shape.true_surface import TrueSurface, surface_of
from photolin.synthetic import render_scene

FOLDER = Path(__file__).parents[3] / "shared" / "data" / "pov_sphere_obstacles"


def compare(stack: ImageStack, true: TrueSurface, *, lights: bool) -> MethodErrors:
    stack = replace(stack, lights=true.lights if lights else None)
    analyses = {method: analyze(stack, Options(method)) for method in METHODS}
    found = compare_methods(stack, analyses, true)
    print(compare_surfaces_with_paper(found))
    return found


def relative(found: MethodErrors) -> tuple[float, float]:
    """Depth errors of robust, relative to those of simple: rms and largest."""
    robust, simple = found.errors["robust"].depth, found.errors["simple"].depth
    assert robust is not None
    assert simple is not None
    return robust.rms / simple.rms, robust.largest / simple.largest


@pytest.mark.parametrize("lights", [False, True])
def test_the_povray_sphere(lights: bool) -> None:
    """The paper: 0.75 and 0.68."""
    if not FOLDER.is_dir():
        pytest.skip("pov_sphere_obstacles is not beside this checkout")
    stack = load_stack(FOLDER, LoadOptions(lights="none"))
    rms, largest = relative(compare(stack, surface_of(load_truth(FOLDER), FOLDER), lights=lights))
    assert rms <= 0.50
    assert largest <= 0.40


@pytest.mark.parametrize(("noise", "bits"), [(0.0, 16), (0.01, 8)])
def test_the_own_sphere(noise: float, bits) -> None:
    scene = render_scene("sphere_obstacles", noise=noise, bits=bits)
    true = surface_of(scene.truth)
    assert true.depth is not None
    assert true.px_mm is not None
    normals, inside = sphere_normals(true.mask.shape, (59.5, 79.5), 50 / true.px_mm)
    thing = inside & (np.abs(true.depth - 50 * normals[..., 2]) < 0.01)
    rms, largest = relative(compare(scene.stack, replace(true, thing=thing), lights=False))
    assert rms <= 0.50
    assert largest <= 0.40
