"""The ambiguity with nothing known: integrable, true up to a bas-relief, near the truth."""

from functools import cache

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.optimize import least_squares

from photolin import analyze
from photolin.analysis import Analysis
from photolin.errors import DegenerateError, InputError
from photolin.shape.directions import angles_between, normalize
from photolin.shape.integrability import resolve_by_integrability
from photolin.shape.sphere import sphere_normals
from photolin.synthetic import Scene, render_scene

SHAPE, RADIUS = (90, 100), 40.0
CENTRE = (44.3, 49.6)
LIGHTS = np.array([[0.3, 0.2, 0.9], [-0.4, 0.1, 0.8], [0.1, -0.5, 0.85]])


def ball(albedo: np.ndarray | float = 0.8) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bases, mask and normals of a sphere under LIGHTS."""
    normals, mask = sphere_normals(SHAPE, CENTRE, RADIUS)
    vectors = normals * np.broadcast_to(albedo, SHAPE)[..., None]
    return np.tensordot(LIGHTS, vectors, (1, 2)).astype(np.float32), mask, normals


@cache
def scene(name: str, noise: float = 0.002) -> tuple[Scene, Analysis]:
    size = None if name.startswith("sphere") else (96, 96)
    rendered = render_scene(name, size=size, noise=noise)
    return rendered, analyze(rendered.stack)


def normal_errors(matrix: np.ndarray, bases: np.ndarray, normals: np.ndarray, where: np.ndarray):
    """(N,) angles between found and true normals, degrees, of the pixels `where`."""
    return angles_between(bases[:, where].T @ matrix.T, normals[where].astype(float))


def bas_relief_error(vectors: np.ndarray, normals: np.ndarray) -> float:
    """Median angle after the best bas-relief transformation, degrees."""

    def apply(g: np.ndarray) -> np.ndarray:
        change = np.array([[g[0], 0, g[1]], [0, g[0], g[2]], [0, 0, 1]])
        return normalize(vectors @ change.T)

    found = least_squares(
        lambda g: (apply(g) - normals).ravel(), [1, 0, 0], loss="soft_l1", f_scale=0.05
    )
    return float(np.median(angles_between(apply(found.x), normals)))


# Truth


def test_an_even_sphere_is_found_itself_and_its_lights() -> None:
    bases, mask, normals = ball()
    resolved = resolve_by_integrability(bases, mask)
    assert resolved.kind == "integrability"
    assert not resolved.scaled
    assert resolved.residual < 0.01
    assert normal_errors(resolved.matrix, bases, normals, mask).mean() < 1
    assert angles_between(resolved.lights(np.eye(3)), LIGHTS).max() < 1


def test_paint_does_not_matter() -> None:
    paint = np.where(np.indices(SHAPE).sum(0) // 7 % 2, 0.3, 0.9)
    bases, mask, normals = ball(paint)
    resolved = resolve_by_integrability(bases, mask)
    assert normal_errors(resolved.matrix, bases, normals, mask).mean() < 1
    assert resolved.residual < 0.02


def test_noise_in_very_dark_paint_is_bearable() -> None:
    paint = np.where(np.indices(SHAPE).sum(0) // 20 % 2, 0.05, 0.9)
    bases, mask, normals = ball(paint)
    bases += np.random.default_rng(0).normal(0, 0.01, bases.shape) * mask
    matrix = resolve_by_integrability(bases, mask).matrix
    light = mask & (paint > 0.5)
    assert bas_relief_error(bases[:, light].T @ matrix.T, normals[light]) < 2


@pytest.mark.parametrize(
    ("name", "relief", "even"),
    [("sphere_obstacles", 0.5, 2), ("sphere_cone", 0.5, 1), ("pot", 0.8, 4), ("cup", 1.5, 3)],
)
def test_rendered_scenes_are_true_up_to_a_bas_relief_and_near_the_truth(
    name: str, relief: float, even: float
) -> None:
    rendered, result = scene(name)
    where, bases = result.determined(), result.linearized_bases
    normals = rendered.truth.normals[where].astype(float)
    for coefficients in (None, result.coefficients):
        resolved = resolve_by_integrability(bases, result.mask, coefficients)
        assert bas_relief_error(bases[:, where].T @ resolved.matrix.T, normals) < relief
        assert angles_between(bases[:, where].T @ resolved.matrix.T, normals).mean() < even
        lights = resolved.lights(result.coefficients)
        assert angles_between(lights, rendered.truth.lights.astype(float)).mean() < even
        assert resolved.residual < 0.05


def test_light_powers_that_differ_threefold_do_little_harm() -> None:
    rendered, result = scene("sphere_obstacles")
    powers = np.random.default_rng(1).uniform(0.5, 1.5, (24, 1))
    coefficients = result.coefficients * powers
    resolved = resolve_by_integrability(result.linearized_bases, result.mask, coefficients)
    lights = resolved.lights(coefficients)
    assert angles_between(lights, rendered.truth.lights.astype(float)).mean() < 2


# Symmetries


def test_other_lights_of_the_bases_give_the_same_surface() -> None:
    _, result = scene("sphere_obstacles")
    change = np.array([[0.2, 0.7, 0.1], [0.5, -0.1, 0.4], [0.3, 0.1, 0.8]])
    bases = result.linearized_bases
    first = resolve_by_integrability(bases, result.mask)
    other = resolve_by_integrability(np.tensordot(change, bases, 1), result.mask)
    lights = first.lights(np.eye(3)), other.lights(np.linalg.inv(change))
    assert angles_between(*lights).max() < 0.3


def test_a_mirrored_scene_has_mirrored_lights() -> None:
    bases, mask, _ = ball(0.5 + 0.4 * np.sin(np.arange(100) / 9))
    first = resolve_by_integrability(bases, mask)
    aside = resolve_by_integrability(bases[:, :, ::-1], mask[:, ::-1])
    over = resolve_by_integrability(bases[:, ::-1], mask[::-1])
    lights = first.lights(np.eye(3))
    assert angles_between(aside.lights(np.eye(3)), lights * (-1, 1, 1)).max() < 0.3
    assert angles_between(over.lights(np.eye(3)), lights * (1, -1, 1)).max() < 0.3


def test_the_scale_of_the_bases_does_not_matter_nor_what_lies_outside() -> None:
    bases, mask, _ = ball()
    expected = resolve_by_integrability(bases, mask).matrix
    np.testing.assert_allclose(resolve_by_integrability(4 * bases, mask).matrix, expected)
    spoilt = bases.copy()
    spoilt[:, ~mask] = np.nan
    np.testing.assert_array_equal(resolve_by_integrability(spoilt, mask).matrix, expected)


# What it says


def test_the_note_says_what_was_assumed() -> None:
    _, result = scene("sphere_obstacles")
    plain = resolve_by_integrability(result.linearized_bases, result.mask)
    power = resolve_by_integrability(result.linearized_bases, result.mask, result.coefficients)
    assert "albedo as even as possible and an outline" in plain.note
    assert "lights of about equal power" in power.note
    assert f"differ by {100 * plain.residual:.1f} %" in plain.note
    assert "stretched or tilted" in plain.note
    assert "doubtful" not in plain.note


def test_the_residual_grows_with_what_is_no_surface() -> None:
    """To about 1 for normals at random; a note warns long before."""
    bases, mask, _ = ball()
    rng = np.random.default_rng(0)
    found = []
    for size in (0.0, 0.003, 0.014):
        noise = np.stack([gaussian_filter(rng.normal(size=SHAPE), 3) for _ in range(3)])
        resolved = resolve_by_integrability(bases + size * noise / noise.std() * mask, mask)
        found.append(resolved.residual)
        assert ("lights are doubtful" in resolved.note) == (resolved.residual > 0.1)
    assert found == sorted(found)
    assert found[0] < 0.01
    assert found[-1] > 0.1


# What leaves it open


def surface(p: np.ndarray, q: np.ndarray, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Bases under LIGHTS of a surface of slopes p and q, and a mask of everything."""
    normals = np.stack([-p, -q, np.ones_like(p)])
    bases = np.tensordot(LIGHTS, normals / np.linalg.norm(normals, axis=0), 1)
    return bases + np.random.default_rng(0).normal(0, noise, bases.shape), np.ones(p.shape, bool)


def test_flat_bent_and_random_surfaces_leave_it_open() -> None:
    row, column = np.indices(SHAPE)
    x, y = (column - 50) / 50, (45 - row) / 50
    zero = np.zeros(SHAPE)
    for noise in (0.0, 0.003):
        for p, q in ((zero, zero + 0.2), (x, zero), (zero, np.sin(3 * y))):
            with pytest.raises(DegenerateError, match="plane"):
                resolve_by_integrability(*surface(p, q, noise))
    corner = np.where(x + y > 0, 0.8, np.where(x > y, -0.6, 0.1))
    for noise in (0.0, 0.003):
        with pytest.raises(DegenerateError, match="does not determine the lights"):
            resolve_by_integrability(*surface(corner, corner**2, noise))
    with pytest.raises(DegenerateError, match="does not determine the lights"):
        resolve_by_integrability(*surface(x, 0.7 * y))
    noise = np.random.default_rng(0).normal(size=(3, *SHAPE))
    for field in (noise, np.stack([gaussian_filter(plane, 4) for plane in noise])):
        with pytest.raises(DegenerateError, match="does not determine the lights"):
            resolve_by_integrability(field, np.ones(SHAPE, bool))


def test_masks_that_do_not_fit_and_empty_ones_are_refused() -> None:
    bases, mask, _ = ball()
    with pytest.raises(InputError, match=r"mask has shape \(90, 99\), the bases \(90, 100\)"):
        resolve_by_integrability(bases, mask[:, 1:])
    with pytest.raises(DegenerateError, match="0 pixels have linearized bases"):
        resolve_by_integrability(bases, mask & False)
