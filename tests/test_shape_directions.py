"""The map of given vectors to known directions: exact, invariant, robust when asked."""

import numpy as np
import pytest

from photolin.errors import DegenerateError
from photolin.shape.directions import (
    angles_between,
    fit_directions,
    normalize,
)


def directions(count: int, seed: int = 0, noise: float = 0.0) -> tuple[np.ndarray, ...]:
    """Given vectors, known directions within 61 degrees of z, and the map between them."""
    rng = np.random.default_rng(seed)
    slopes = rng.uniform(-1, 1, (count, 2))
    slopes[:4] = (0, 0.1), (0.9, 0.1), (-0.5, 0.7), (-0.3, -0.8)
    known = normalize(np.column_stack([slopes, np.full(count, 0.8)]))
    matrix = rng.normal(size=(3, 3))
    given = rng.uniform(0.2, 1, (count, 1)) * (known @ np.linalg.inv(matrix).T)
    return given, normalize(known + noise * rng.normal(size=known.shape)), matrix


def same_up_to_scale(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference of two matrices of length 1; a negative multiple is not the same."""
    return float(np.abs(a / np.linalg.norm(a) - b / np.linalg.norm(b)).max())


@pytest.mark.parametrize("count", [4, 5, 8, 100])
def test_exact_directions_give_the_exact_map_whatever_the_lengths(count: int) -> None:
    for seed in range(10):
        given, known, matrix = directions(count, seed)
        assert same_up_to_scale(fit_directions(given, known), matrix) < 1e-6


def test_the_ambiguity_of_the_given_vectors_changes_nothing_but_the_map() -> None:
    given, known, _ = directions(12, noise=0.02)
    change = np.array([[1, 0.9, 0.8], [0, 0.3, 0.2], [0, 0, 0.01]])
    plain, other = fit_directions(given, known), fit_directions(given @ change.T, known)
    assert same_up_to_scale(other @ change, plain) < 1e-4


def test_a_turn_of_the_known_directions_turns_the_map() -> None:
    given, known, _ = directions(12, noise=0.02)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    plain, other = fit_directions(given, known), fit_directions(given, known @ turn.T)
    assert same_up_to_scale(other, turn @ plain) < 1e-4


def test_the_refined_map_has_smaller_angles_than_any_near_it() -> None:
    given, known, _ = directions(15, noise=0.05)
    best = fit_directions(given, known)

    def error(matrix: np.ndarray) -> float:
        return float(np.square(normalize(given @ matrix.T) - known).sum())

    steps = np.random.default_rng(0).normal(size=(50, 3, 3)) * 1e-3 * np.abs(best).mean()
    assert min(error(best + step) for step in steps) > error(best)


def test_directions_in_a_plane_leave_it_open() -> None:
    given, known, _ = directions(8)
    flat = normalize(known * (1, 0.01, 1))
    with pytest.raises(DegenerateError, match=r"8 directions lie nearly in one plane"):
        fit_directions(given, flat)
    with pytest.raises(DegenerateError, match=r"8 directions lie nearly in one plane"):
        fit_directions(given * (1, 0, 1), known)


def test_three_of_four_in_a_plane_leave_it_open() -> None:
    given, known, _ = directions(4)
    weights = np.array([[0.5], [0.5]])
    for vectors in (given, known):
        vectors[2] = (weights * vectors[:2]).sum(axis=0)
    with pytest.raises(DegenerateError, match="no three lie in one plane"):
        fit_directions(given, normalize(known))
    with pytest.raises(DegenerateError, match="at least four"):
        fit_directions(*(v[[0, 1, 3]] for v in directions(4)[:2]))


def test_angles_are_exact_from_0_to_180_degrees() -> None:
    a = np.array([[1.0, 0, 0]] * 4)
    b = np.array([[2, 0, 0], [1, 1e-8, 0], [0, 3, 0], [-1, 0, 0]])
    expected = [0, np.degrees(1e-8), 90, 180]
    np.testing.assert_allclose(angles_between(a, b), expected, rtol=1e-12)
