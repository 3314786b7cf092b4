"""Points of known normal taken together with what makes normals those of a surface."""

from functools import cache

import numpy as np
import pytest

from photolin import analyze
from photolin.analysis import Analysis
from photolin.errors import InputError
from photolin.shape.directions import angles_between, normalize
from photolin.shape.points import resolve_from_points
from photolin.shape.resolved import Resolved
from photolin.shape.surface_points import fit_relief, probability, resolve_from_surface_points
from photolin.synthetic import Scene, render_scene

ROWS = np.array([20, 60, 100, 55, 80, 40])
COLUMNS = np.array([80, 45, 90, 115, 60, 60])
"""Pixels on the sphere of the scene, none behind an obstacle."""


@cache
def scene(noise: float) -> tuple[Scene, Analysis]:
    rendered = render_scene("sphere_obstacles", noise=noise)
    return rendered, analyze(rendered.stack)


def true_normals(noise: float = 0.0) -> np.ndarray:
    return normalize(scene(noise)[0].truth.normals[ROWS, COLUMNS].astype(float))


def resolve(normals: np.ndarray, noise: float, count: int = 6) -> Resolved:
    _, a = scene(noise)
    points = ROWS[:count], COLUMNS[:count], normals[:count]
    return resolve_from_surface_points(a.linearized_bases, a.mask, *points)


def error(found: Resolved, noise: float) -> float:
    """Mean angle of the normals, degrees."""
    rendered, a = scene(noise)
    there = a.determined()
    vectors = a.linearized_bases[:, there].T.astype(float) @ found.matrix.T
    return float(angles_between(vectors, rendered.truth.normals[there].astype(float)).mean())


def test_errors_of_single_points_matter_less() -> None:
    """Normals that are read off with errors of two degrees, ten times."""
    rng = np.random.default_rng(0)
    together, alone = [], []
    _, a = scene(0.01)
    for _ in range(10):
        normals = normalize(true_normals() + rng.normal(0, np.radians(2), (6, 3)))
        found = resolve(normals, 0.01)
        together.append(error(found, 0.01))
        alone.append(error(resolve_from_points(a.linearized_bases, ROWS, COLUMNS, normals), 0.01))
    assert np.mean(together) < 0.8 * np.mean(alone)
    assert "taken together with what makes the normals those of a surface" in found.note
    assert found.kind == "points"


def test_exact_points_stay_exact() -> None:
    assert error(resolve(true_normals(), 0.0), 0.0) < 0.02


@pytest.mark.parametrize("change", [(1, -1, 1), (-1, 1, 1)])
def test_points_of_a_mirrored_scene_are_taken_alone(change: tuple[int, int, int]) -> None:
    """No surface fits them; what they say is followed, and doubted elsewhere."""
    found = resolve(true_normals() * change, 0.0)
    assert "taken together" not in found.note
    assert found.residual < 0.1


def test_points_off_by_much_are_taken_alone_however_few_they_are() -> None:
    """By an F test of five points, errors of 15 degrees explain anything."""
    rng = np.random.default_rng(0)
    for _ in range(5):
        normals = normalize(true_normals() + rng.normal(0, np.radians(15), (6, 3)))
        found = resolve(normals, 0.01, 5)
        assert found.residual <= 8 or "taken together" not in found.note


def test_four_points_are_taken_alone() -> None:
    assert "four points are fitted exactly" in resolve(true_normals(), 0.01, 4).note


def test_a_point_that_contradicts_the_others_has_no_say() -> None:
    normals = true_normals()
    normals[2] = normalize(normals[[2]] + (0.9, 0, 0))[0]
    found = resolve(normals, 0.01)
    assert "was left out" in found.note
    assert error(found, 0.01) < 2


def test_a_hollow_start_is_turned_over() -> None:
    normals = true_normals()
    matrix = np.diag([-2.0, -2.0, 1.0])
    found, angles = fit_relief(matrix, normals, normals, np.ones(6, bool))
    np.testing.assert_allclose(found / found[2, 2], np.eye(3), atol=1e-6)
    assert angles.max() < 1e-4


def test_the_probability_is_that_of_f() -> None:
    """F = 3.11 with 5 and 6 degrees of freedom is exceeded with a probability of 0.1."""
    alone = 1.0
    together = np.sqrt(1 + 5 * 3.1075 / 6)
    assert probability(alone, together, 6) == pytest.approx(0.1, abs=1e-3)
    assert probability(1.0, 1.0, 6) == 1


def test_what_points_refuse_is_refused() -> None:
    with pytest.raises(InputError, match="at least 4 are needed"):
        resolve(true_normals(), 0.0, 3)
