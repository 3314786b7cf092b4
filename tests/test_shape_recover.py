"""From a linearization to a shape: truth with known and unknown lights, scale, every misuse."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from photolin import analyze
from photolin.analysis import Analysis
from photolin.errors import Cancelled, DegenerateError, InputError, OptionError
from photolin.shape.compare_depth import compare_depth
from photolin.shape.directions import angles_between
from photolin.shape.known import Known
from photolin.shape.recover import Shape, check_scale, recover_shape
from photolin.shape.resolve import resolve_ambiguity
from photolin.stack import ImageStack
from photolin.synthetic import Truth, render_scene


@cache
def known() -> tuple[ImageStack, Analysis, Truth]:
    """The sphere with obstacles with its lights."""
    scene = render_scene("sphere_obstacles")
    lights = scene.truth.lights.astype(float) * scene.truth.power[:, None]
    stack = replace(scene.stack, lights=lights)
    return stack, analyze(stack), scene.truth


@cache
def shape() -> Shape:
    stack, analysis, truth = known()
    return recover_shape(stack, analysis, resolve_ambiguity(analysis), px_mm=truth.px_mm)


def lit(least: int) -> np.ndarray:
    truth = known()[2]
    return truth.mask & (np.isin(truth.labels, (1, 2)).sum(axis=0) >= least)


# Truth


def test_normals_albedo_and_lights_are_those_of_the_scene() -> None:
    truth, there = known()[2], lit(4)
    errors = angles_between(shape().normals[there].astype(float), truth.normals[there])
    assert errors.max() < 0.3
    assert errors.mean() < 0.02
    np.testing.assert_allclose(shape().albedo[there], truth.albedo[there], rtol=0.01)
    lights = truth.lights * truth.power[:, None]
    np.testing.assert_allclose(shape().lights, lights, atol=1e-6)


def test_depth_of_the_sphere_is_right_in_mm() -> None:
    truth = known()[2]
    W, H = truth.mask.shape[1], truth.mask.shape[0]
    row, column = np.mgrid[:H, :W]
    x, y = (column + 0.5 - W / 2) * truth.px_mm, (H / 2 - row - 0.5) * truth.px_mm
    sphere = np.sqrt(np.maximum(50**2 - x**2 - y**2, 0))
    there = lit(4) & (np.abs(truth.depth - sphere) < 0.01) & (x**2 + y**2 < 45**2)
    assert there.sum() > 5000
    depth = shape().depth
    assert depth is not None
    error = compare_depth(shape().lengths(depth), truth.depth, there)
    assert error.rms < 0.5
    assert shape().unit == "mm"


def test_what_is_undetermined_is_nan_and_what_is_outside_is_zero() -> None:
    stack, analysis, _ = known()
    outside, open_there = ~stack.mask, stack.mask & ~analysis.determined()
    assert open_there.any()
    found = shape()
    assert found.depth is not None
    assert np.isnan(found.normals[open_there]).all()
    assert np.isnan(found.albedo[open_there]).all()
    assert (found.normals[outside] == 0).all()
    assert (found.albedo[outside] == 0).all()
    assert np.isnan(found.depth[outside | open_there]).all()
    there = analysis.determined()
    np.testing.assert_allclose(np.linalg.norm(found.normals[there], axis=1), 1, atol=1e-6)
    assert np.isfinite(found.depth[there]).all()


def test_unknown_lights_and_five_points_give_the_same_normals() -> None:
    stack, _, truth = known()
    plain = replace(stack, lights=None)
    analysis = analyze(plain)
    pixels = ((20, 80), (60, 45), (100, 90), (55, 115), (80, 60))
    normals = tuple(tuple(truth.normals[p].astype(float).tolist()) for p in pixels)
    resolved = resolve_ambiguity(analysis, Known(points=pixels, normals=normals))
    found = recover_shape(plain, analysis, resolved, depth=False)
    errors = angles_between(found.normals[lit(4)].astype(float), truth.normals[lit(4)])
    assert errors.mean() < 0.1
    assert found.depth is None
    assert found.unit == "px"


# Laws


def test_lights_twice_as_strong_halve_the_albedo_and_leave_the_rest() -> None:
    stack, analysis, _ = known()
    assert stack.lights is not None
    strong = replace(analysis, lights=2 * stack.lights)
    found = recover_shape(stack, strong, resolve_ambiguity(strong), depth=False)
    np.testing.assert_allclose(found.normals, shape().normals, atol=1e-6)
    np.testing.assert_allclose(found.albedo, shape().albedo / 2, rtol=1e-6)
    np.testing.assert_allclose(found.lights, shape().lights * 2, rtol=1e-9, atol=1e-12)


def test_lights_with_z_away_from_the_camera_are_doubted() -> None:
    stack, analysis, _ = known()
    turned = replace(analysis, lights=-np.array(analysis.lights))
    found = recover_shape(stack, turned, resolve_ambiguity(turned), depth=False)
    assert "100 % of the normals face away from the camera" in found.resolved.doubts[-1]
    assert "away" not in shape().resolved.note


def test_a_scale_stretches_lengths_and_nothing_else() -> None:
    stack, analysis, truth = known()
    plain = recover_shape(stack, analysis, resolve_ambiguity(analysis))
    assert plain.depth is not None
    assert shape().depth is not None
    np.testing.assert_array_equal(plain.depth, shape().depth)
    np.testing.assert_array_equal(plain.normals, shape().normals)
    np.testing.assert_array_equal(plain.lengths(plain.depth), plain.depth)
    np.testing.assert_allclose(shape().lengths(plain.depth), plain.depth * truth.px_mm, rtol=1e-6)


def test_the_number_of_threads_does_not_matter() -> None:
    stack, analysis, truth = known()
    again = recover_shape(
        stack, analysis, resolve_ambiguity(analysis), px_mm=truth.px_mm, threads=1
    )
    for name in ("normals", "albedo", "depth", "lights"):
        np.testing.assert_array_equal(getattr(again, name), getattr(shape(), name))


def test_a_shape_is_read_only() -> None:
    for array in (shape().normals, shape().albedo, shape().depth, shape().lights):
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_progress_names_its_stages_and_ends_at_one() -> None:
    stack, analysis, _ = known()
    told: list[tuple[str, float]] = []
    recover_shape(
        stack, analysis, resolve_ambiguity(analysis), progress=lambda *of: told.append(of)
    )
    assert {stage for stage, _ in told} >= {"normals", "depth"}
    assert all(0 <= fraction <= 1 for _, fraction in told)


def test_observations_are_weighed_by_the_powers_of_the_lights_found(monkeypatch) -> None:
    """A dim light grazes no less for being dim: powers must reach the choice of observations."""
    stack, analysis, truth = known()
    told: list[np.ndarray] = []

    def note(stack, analysis, powers, **_) -> np.ndarray:
        told.append(powers)
        return analysis.linearized_bases

    monkeypatch.setattr("photolin.shape.recover.fit_grazing", note)
    recover_shape(stack, analysis, resolve_ambiguity(analysis), depth=False)
    np.testing.assert_allclose(told[0], truth.power, rtol=1e-6)


# Degenerate and hostile


@pytest.mark.parametrize("px_mm", [0.0, -1.0, np.nan, np.inf, 1e-9, 1e300])
def test_an_absurd_scale_is_refused_before_any_work(px_mm: float) -> None:
    stack, analysis, _ = known()
    words = r"px_mm is .*; accepted are mm from 1e-06 to 1e\+06"
    with pytest.raises(OptionError, match=words):
        check_scale(px_mm)
    with pytest.raises(OptionError, match=words):
        recover_shape(stack, analysis, resolve_ambiguity(analysis), px_mm=px_mm, progress=fail)


def fail(*_: object) -> None:
    raise AssertionError("work was done")


@pytest.mark.parametrize("px_mm", [None, 1e-6, 0.65, 1e6])
def test_scales_of_microscopes_and_of_planets_are_accepted(px_mm: float | None) -> None:
    check_scale(px_mm)


def test_a_stack_of_another_analysis_is_refused() -> None:
    _, analysis, _ = known()
    other = render_scene("cup", size=(32, 32), images=8).stack
    with pytest.raises(InputError, match="the analysis of this stack is accepted"):
        recover_shape(other, analysis, resolve_ambiguity(analysis))


def test_an_analysis_that_leaves_every_pixel_open_is_refused() -> None:
    stack, analysis, _ = known()
    bases = np.where(stack.mask, np.float32(np.nan), analysis.linearized_bases)
    bare = replace(analysis, linearized_bases=bases)
    with pytest.raises(DegenerateError):
        recover_shape(stack, bare, resolve_ambiguity(bare))


def test_it_stops_when_told_to() -> None:
    stack, analysis, _ = known()
    with pytest.raises(Cancelled):
        recover_shape(stack, analysis, resolve_ambiguity(analysis), cancel=lambda: True)
