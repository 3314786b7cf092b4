"""Errors of a surface: laws, hand-made errors, what is left out, refusals."""

import re
from dataclasses import replace

import numpy as np
import pytest

from photolin.errors import InputError
from photolin.shape.compare_surface import compare_surface, describe_errors
from photolin.shape.true_surface import TrueSurface, surface_of
from photolin.synthetic import render_scene

TRUTH = render_scene("sphere_obstacles", size=(40, 50), images=6).truth
TRUE = surface_of(TRUTH)
HALF = np.arange(50) < 25


def turned(degrees: np.ndarray | float) -> np.ndarray:
    """True normals turned about x by degrees, (H,W) or one for all."""
    a = np.radians(degrees) * np.ones(TRUE.mask.shape)
    x, y, z = np.moveaxis(TRUE.normals, 2, 0)
    return np.stack([x, np.cos(a) * y - np.sin(a) * z, np.sin(a) * y + np.cos(a) * z], axis=2)


def own_depth() -> np.ndarray:
    assert TRUE.depth is not None
    assert TRUE.px_mm is not None
    return TRUE.depth / TRUE.px_mm


def test_the_truth_itself_is_without_error() -> None:
    errors = compare_surface(TRUE.normals, TRUE, depth=own_depth(), lights=TRUE.lights)
    assert errors.mean < 1e-6
    assert errors.median < 1e-6
    assert (errors.pixels, errors.undetermined) == (TRUE.mask.sum(), 0)
    assert errors.depth is not None
    assert errors.depth.rms < 1e-9
    assert errors.light is not None
    assert errors.light < 1e-6


def test_mean_and_median_are_those_of_the_angles() -> None:
    tilt = np.where(HALF & (np.arange(40)[:, None] < 10), 9.0, 0.0)  # fewer than half
    share = (tilt[TRUE.mask] > 0).mean()
    x = TRUE.normals[..., 0]  # a turn about x moves what leans to x by less
    moved = np.degrees(2 * np.arcsin(np.sqrt(1 - x**2) * np.sin(np.radians(tilt / 2))))
    errors = compare_surface(turned(tilt), TRUE)
    assert 0 < share < 0.5
    assert errors.mean == pytest.approx(moved[TRUE.mask].mean(), abs=1e-4)
    assert errors.median < 1e-4


def test_what_is_undetermined_is_counted_apart_and_spoils_no_mean() -> None:
    normals, gap = turned(3.0), TRUE.mask & HALF
    normals[gap] = np.nan
    normals[20, 25] = 0
    errors = compare_surface(normals, TRUE)
    assert errors.undetermined == gap.sum() + 1
    assert errors.pixels + errors.undetermined == TRUE.mask.sum()
    assert 0 < errors.mean <= 3.0001
    nothing = compare_surface(np.full_like(normals, np.nan), TRUE)
    assert np.isnan(nothing.mean)
    assert np.isnan(nothing.median)
    assert nothing.undetermined == TRUE.mask.sum()


def test_pixels_outside_the_mask_or_not_asked_for_count_for_nothing() -> None:
    normals = turned(np.where(HALF, 20.0, 0.0))
    normals[~TRUE.mask] = (0, 0, -1)
    errors = compare_surface(normals, TRUE, where=np.broadcast_to(~HALF, TRUE.mask.shape))
    assert errors.mean < 1e-6
    assert errors.pixels == (TRUE.mask & ~HALF).sum()


def test_depth_is_in_mm_and_a_constant_is_free() -> None:
    depth = own_depth() + 7
    depth[20, 25] += 3
    errors = compare_surface(TRUE.normals, TRUE, depth=depth)
    assert errors.depth is not None
    assert TRUE.px_mm is not None
    assert errors.depth.largest == pytest.approx(3 * TRUE.px_mm, rel=0.01)
    assert errors.depth.parts >= 1


def test_lights_are_compared_by_their_directions_as_they_are() -> None:
    assert TRUE.lights is not None
    lights = 5 * TRUE.lights
    assert compare_surface(TRUE.normals, TRUE, lights=lights).light == pytest.approx(0, abs=1e-5)
    mirrored = lights * (1, 1, -1)
    light = compare_surface(TRUE.normals, TRUE, lights=mirrored).light
    assert light is not None
    assert light > 30


def test_what_the_truth_does_not_know_is_not_measured() -> None:
    bare = TrueSurface(TRUE.normals, TRUE.mask)
    errors = compare_surface(TRUE.normals, bare, depth=own_depth(), lights=TRUE.lights)
    assert errors.depth is None
    assert errors.light is None
    lines = describe_errors(errors)
    assert len(lines) == 1
    assert lines[0].startswith("normals             mean 0.000, median 0.000 degrees over")
    assert lines[0].endswith("pixels; 0 undetermined")
    open_depth = np.full(TRUE.mask.shape, np.nan)
    assert compare_surface(TRUE.normals, TRUE, depth=open_depth).depth is None


def test_every_figure_is_told_with_its_unit() -> None:
    errors = compare_surface(turned(1.0), TRUE, depth=own_depth(), lights=TRUE.lights)
    normals, depth, lights = describe_errors(errors)
    assert "degrees" in normals
    assert "rms 0.0000, median 0.0000, largest 0.0000 mm over" in depth
    assert re.search(r" pixels in \d+ parts$", depth)
    assert lights == "lights as found     0.000 degrees"


def test_a_result_of_another_size_or_of_other_images_is_refused() -> None:
    assert TRUE.lights is not None
    with pytest.raises(InputError, match=r"shape \(39, 50, 3\), the truth is of 40 x 50 pixels"):
        compare_surface(TRUE.normals[1:], TRUE)
    with pytest.raises(InputError, match="the result has 5 lights, the truth 6"):
        compare_surface(TRUE.normals, TRUE, lights=TRUE.lights[1:])


def test_a_true_surface_is_read_only() -> None:
    with pytest.raises(ValueError, match="read-only"):
        replace(TRUE).normals[0] = 0
