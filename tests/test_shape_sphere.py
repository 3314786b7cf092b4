"""A sphere of known outline: its normals, and the ambiguity it resolves."""

import numpy as np
import pytest

from photolin import analyze
from photolin.errors import DegenerateError, InputError
from photolin.shape.directions import angles_between
from photolin.shape.sphere import resolve_from_sphere, sphere_normals
from photolin.synthetic import render_scene

SHAPE, CENTRE, RADIUS = (90, 100), (43.5, 52.25), 38.0
MATRIX = np.array([[0.9, -0.5, 0.3], [0.4, 0.8, -0.6], [0.2, 0.1, 0.7]])


def painted(albedo: str = "even") -> tuple[np.ndarray, np.ndarray]:
    """Bases of a sphere, whose matrix is MATRIX, and their mask."""
    normals, mask = sphere_normals(SHAPE, CENTRE, RADIUS)
    paint = np.ones(SHAPE)
    if albedo == "checks":
        paint = np.where(np.indices(SHAPE).sum(0) // 7 % 2, 0.2, 0.9)
    bases = np.tensordot(np.linalg.inv(MATRIX), normals * paint[..., None], (1, 2))
    return bases.astype(np.float32), mask


def error(matrix: np.ndarray) -> float:
    """Largest angle of lights of the three bases, degrees."""
    return float(angles_between(np.linalg.inv(matrix), np.linalg.inv(MATRIX)).max())


# Normals


def test_normals_are_unit_inside_and_zero_outside() -> None:
    normals, mask = sphere_normals(SHAPE, CENTRE, RADIUS)
    lengths = np.linalg.norm(normals, axis=-1)
    np.testing.assert_allclose(lengths, mask, atol=1e-12)
    assert mask.sum() == pytest.approx(np.pi * RADIUS**2, rel=0.01)


def test_x_is_right_y_up_and_z_to_the_camera() -> None:
    normals, _ = sphere_normals((21, 21), (10, 10), 10)
    np.testing.assert_allclose(normals[10, 10], (0, 0, 1))
    np.testing.assert_allclose(normals[10, 16], (0.6, 0, 0.8))
    np.testing.assert_allclose(normals[4, 10], (0, 0.6, 0.8))


def test_normals_are_those_of_the_rendered_sphere() -> None:
    truth = render_scene("sphere_obstacles", bits=None).truth
    normals, mask = sphere_normals(truth.mask.shape, (59.5, 79.5), 50 / truth.px_mm)
    same = np.abs(truth.normals - normals).max(axis=-1) < 1e-5
    assert same[mask].mean() > 0.8
    assert not same[~mask & truth.mask].any()


@pytest.mark.parametrize(
    "outline",
    [
        ((1, 2), 0),
        ((1, 2), -3),
        ((1, np.nan), 3),
        ((1, 2), np.inf),
        ((1e308, -1e308), 1e-300),
        ((1, 2), 1e-300),
        ((1, 2), 1e300),
    ],
)
def test_an_outline_that_is_none_is_refused(outline) -> None:
    with pytest.raises(InputError, match="radius above 0 pixels"):
        sphere_normals(SHAPE, *outline)


# The ambiguity


@pytest.mark.parametrize("albedo", ["even", "checks"])
def test_the_true_matrix_is_found_whatever_the_albedo(albedo: str) -> None:
    resolved = resolve_from_sphere(*painted(albedo), CENTRE, RADIUS)
    assert error(resolved.matrix) < 0.01
    assert resolved.residual < 0.01
    assert (resolved.kind, resolved.scaled, resolved.residuals) == ("sphere", False, None)
    assert "row 43.5, column 52.25, radius 38 pixels" in resolved.note


def test_what_stands_before_a_third_of_it_does_not_pull() -> None:
    bases, mask = painted()
    bases[:, :, 60:] = np.array([0.7, 0.6, 0.5])[:, None, None]
    resolved = resolve_from_sphere(bases, mask, CENTRE, RADIUS)
    assert error(resolved.matrix) < 0.3
    share = (mask[:, 60:].sum() / mask.sum()) * 100
    assert 25 < share < 45
    off = float(resolved.note.split(" % are off")[0].split()[-1])
    assert off == pytest.approx(share, abs=6)


def test_pixels_that_are_unknown_outside_or_on_the_rim_do_not_matter() -> None:
    bases, mask = painted()
    expected = resolve_from_sphere(bases, mask, CENTRE, RADIUS)
    _, inner = sphere_normals(SHAPE, CENTRE, 0.95 * RADIUS)
    assert f"half of its {inner.sum()} pixels" in expected.note
    bases[:, ~inner] = np.random.default_rng(0).normal(size=(3, (~inner).sum()))
    bases[:, 20:30, 40:50] = np.nan
    mask = mask.copy()
    mask[50:60] = False
    bases[:, 50:60] = 7
    resolved = resolve_from_sphere(bases, mask, CENTRE, RADIUS)
    np.testing.assert_allclose(resolved.matrix, expected.matrix, atol=1e-4)
    left = inner & mask
    left[20:30, 40:50] = False
    assert f"half of its {left.sum()} pixels" in resolved.note


def test_noise_averages_out() -> None:
    bases, mask = painted()
    noise = np.random.default_rng(0).normal(0, 0.02, bases.shape)
    resolved = resolve_from_sphere(bases + noise, mask, CENTRE, RADIUS)
    assert 0.3 < resolved.residual < 3
    assert error(resolved.matrix) < 0.3


def test_the_same_call_gives_the_same_bytes() -> None:
    first, second = (resolve_from_sphere(*painted("checks"), CENTRE, RADIUS) for _ in range(2))
    np.testing.assert_array_equal(first.matrix, second.matrix)


def test_lights_of_the_rendered_sphere_are_within_a_tenth_of_a_degree() -> None:
    scene = render_scene("sphere_obstacles", noise=0.002)
    result = analyze(scene.stack)
    resolved = resolve_from_sphere(
        result.linearized_bases, result.mask, (59.5, 79.5), 50 / scene.truth.px_mm
    )
    lights = resolved.lights(result.coefficients)
    assert angles_between(lights, scene.truth.lights.astype(float)).max() < 0.1


def test_too_few_pixels_and_masks_that_do_not_fit_are_refused() -> None:
    bases, mask = painted()
    with pytest.raises(InputError, match="radius 2 pixels has 9 pixels with linearized bases; at"):
        resolve_from_sphere(bases, mask, (43, 52), 2)
    with pytest.raises(InputError, match="has 0 pixels"):
        resolve_from_sphere(bases, mask, (-500, 52), 38)
    with pytest.raises(InputError, match=r"mask has shape \(90, 99\), the bases \(90, 100\)"):
        resolve_from_sphere(bases, mask[:, 1:], CENTRE, RADIUS)


def test_what_is_no_sphere_is_refused() -> None:
    _, mask = painted()
    rng = np.random.default_rng(0)
    with pytest.raises(DegenerateError, match="are not those of a sphere"):
        resolve_from_sphere(rng.normal(size=(3, *SHAPE)), mask, CENTRE, RADIUS)
    plane = np.ones((3, *SHAPE))
    with pytest.raises(DegenerateError, match="are not those of a sphere"):
        resolve_from_sphere(plane, mask, CENTRE, RADIUS)
