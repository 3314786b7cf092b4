"""The ambiguity from points of known normal: truth, the wrong click, every misuse."""

from functools import cache

import numpy as np
import pytest

from photolin import analyze
from photolin.analysis import Analysis
from photolin.errors import DegenerateError, InputError
from photolin.shape.directions import angles_between, normalize
from photolin.shape.points import resolve_from_points
from photolin.shape.resolved import Resolved
from photolin.shape.sphere import sphere_normals
from photolin.synthetic import Scene, render_scene

ROWS = np.array([20, 60, 100, 55, 80, 40, 70, 90])
COLUMNS = np.array([80, 45, 90, 115, 60, 60, 90, 110])
"""Pixels on the sphere of the scene, none behind an obstacle."""


@cache
def scene() -> tuple[Scene, Analysis]:
    """The sphere with obstacles, as the program sees it."""
    rendered = render_scene("sphere_obstacles", noise=0.002)
    return rendered, analyze(rendered.stack)


def clicked(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Bases, rows, columns and true normals of the first points."""
    rendered, result = scene()
    rows, columns = ROWS[:count], COLUMNS[:count]
    normals = normalize(rendered.truth.normals[rows, columns].astype(float))
    return result.linearized_bases, rows, columns, normals


def light_errors(resolved: Resolved) -> np.ndarray:
    rendered, result = scene()
    lights = resolved.lights(result.coefficients)
    return angles_between(lights, rendered.truth.lights.astype(float))


def test_the_points_lie_on_the_sphere() -> None:
    """Truth of the scene, and the formula that a user of a sphere goes by, are one."""
    truth = scene()[0].truth
    normals, _ = sphere_normals(truth.mask.shape, (59.5, 79.5), 50 / truth.px_mm)
    np.testing.assert_allclose(truth.normals[ROWS, COLUMNS], normals[ROWS, COLUMNS], atol=1e-6)


def test_five_points_on_the_sphere_give_all_lights_within_a_degree() -> None:
    resolved = resolve_from_points(*clicked(5))
    assert light_errors(resolved).max() < 1
    assert (resolved.kind, resolved.scaled) == ("points", False)
    assert resolved.residual < 0.5
    assert resolved.note.startswith("resolved by 5 points of known normal: they fit to 0.")
    powers = np.linalg.norm(resolved.lights(scene()[1].coefficients), axis=1)
    relative = powers / scene()[0].truth.power
    np.testing.assert_allclose(relative, relative.mean(), rtol=0.02)


def test_four_points_are_fitted_exactly_and_the_note_says_so() -> None:
    resolved = resolve_from_points(*clicked(4))
    assert resolved.residual < 1e-3
    assert "a fifth would check them" in resolved.note
    assert light_errors(resolved).max() < 3
    assert "a fifth" not in resolve_from_points(*clicked(5)).note


def test_the_order_of_points_and_the_scale_of_the_bases_do_not_matter() -> None:
    bases, rows, columns, normals = clicked(7)
    first = resolve_from_points(bases, rows, columns, normals)
    order = np.array([3, 6, 0, 5, 1, 4, 2])
    other = resolve_from_points(bases * 4, rows[order], columns[order], normals[order])
    np.testing.assert_allclose(other.matrix, first.matrix, atol=1e-5)
    assert first.residuals is not None
    assert other.residuals is not None
    np.testing.assert_allclose(other.residuals, first.residuals[order], atol=1e-4)


def test_other_bases_of_the_same_images_give_the_same_lights() -> None:
    bases, *points = clicked(6)
    change = np.array([[0.2, 0.7, 0.1], [0.5, -0.1, 0.4], [0.3, 0.1, 0.8]])
    other = resolve_from_points(np.tensordot(change, bases, 1), *points)
    plain = resolve_from_points(bases, *points)
    lights = plain.lights(np.eye(3)), other.lights(np.linalg.inv(change))
    assert angles_between(*lights).max() < 1e-3


def test_one_wrong_click_of_six_or_more_is_left_out_and_named() -> None:
    for count in (6, 7, 8):
        bases, rows, columns, normals = clicked(count)
        normals[2] = normalize(normals[2:3] * (-1, 1, 1) + (0.3, 0, 0))[0]
        resolved = resolve_from_points(bases, rows, columns, normals)
        assert "row 100, column 90 was left out" in resolved.note
        assert resolved.residuals is not None
        assert resolved.residuals.argmax() == 2
        assert resolved.residuals[2] > 5
        assert f"worst {np.delete(resolved.residuals, 2).max():.2f} degrees at" in resolved.note
        assert resolved.residual < 0.5
        assert light_errors(resolved).max() < 1.5
        assert f"resolved by {count - 1} points" in resolved.note


def test_of_five_none_is_left_out_but_the_residual_tells() -> None:
    bases, rows, columns, normals = clicked(5)
    normals[2] = normalize(normals[2:3] * (-1, 1, 1) + (0.3, 0, 0))[0]
    resolved = resolve_from_points(bases, rows, columns, normals)
    assert "left out" not in resolved.note
    assert resolved.residual > 10 * resolve_from_points(*clicked(5)).residual


def test_a_click_that_is_little_off_is_kept_even_among_exact_ones() -> None:
    truth = scene()[0].truth
    _, rows, columns, normals = clicked(8)
    normals[2] = normalize(normals[2:3] + np.array([0.05, 0, 0]))[0]
    resolved = resolve_from_points(truth.normals.transpose(2, 0, 1), rows, columns, normals)
    assert "left out" not in resolved.note
    assert resolved.residual > 0.3


def test_inaccurate_normals_are_all_kept() -> None:
    """Errors of two degrees, as of clicks."""
    bases, rows, columns, normals = clicked(8)
    for seed in range(20):
        errors = np.random.default_rng(seed).normal(0, 0.025, normals.shape)
        resolved = resolve_from_points(bases, rows, columns, normalize(normals + errors))
        assert "left out" not in resolved.note
        assert 0.2 < resolved.residual < 4


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda b, r, c, n: (b, r[:3], c[:3], n[:3]), "3 points of known normal; at least 4"),
        (lambda b, r, c, n: (b, r, c[:4], n), r"shapes \(5,\), \(4,\) and \(5, 3\)"),
        (lambda b, r, c, n: (b, r, c, n[:, :2]), r"\(N,\), \(N,\) and \(N,3\) are accepted"),
        (lambda b, r, c, n: (b, r + 0.5, c, n), "are not whole; pixels are accepted"),
        (lambda b, r, c, n: (b, [], [], n[:0]), "0 points of known normal; at least 4"),
        (lambda b, r, c, n: (b, r + 100, c, n), "row 120, column 80 is outside the image of 120"),
        (lambda b, r, c, n: (b, r, c - 90, n), "column -10 is outside"),
        (lambda b, r, c, n: (b * np.nan, r, c, n), "row 20, column 80 has no linearized bases"),
        (lambda b, r, c, n: (b * 0, r, c, n), "row 20, column 80 has no linearized bases"),
        (lambda b, r, c, n: (b, r, c, n * 0), "row 20, column 80 has length 0; unit vectors"),
        (lambda b, r, c, n: (b, r, c, n * 1.1), "has length 1.1; unit vectors x y z"),
        (lambda b, r, c, n: (b, r, c, n * np.nan), "has length nan; unit vectors"),
        (lambda b, r, c, n: (b, r, c, n * (1, 1, -1)), "faces away from the camera"),
    ],
)
def test_points_that_cannot_be_used_are_refused(change, words: str) -> None:
    with pytest.raises(InputError, match=words):
        resolve_from_points(*change(*clicked(5)))


def test_points_along_a_line_through_the_middle_of_a_sphere_leave_it_open() -> None:
    rendered, result = scene()
    rows, columns = np.full(6, 59), np.array([45, 55, 65, 95, 105, 115])
    normals = normalize(rendered.truth.normals[rows, columns].astype(float))
    with pytest.raises(DegenerateError, match="the 6 points do not determine the ambiguity"):
        resolve_from_points(result.linearized_bases, rows, columns, normals)


def test_one_pixel_clicked_five_times_leaves_it_open() -> None:
    bases, rows, columns, normals = clicked(5)
    again = np.zeros(5, int)
    with pytest.raises(DegenerateError, match="spread to all sides"):
        resolve_from_points(bases, rows[again], columns[again], normals[again])
