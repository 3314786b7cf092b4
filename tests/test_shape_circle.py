"""The outline of a sphere from clicks on its rim."""

import numpy as np
import pytest

from photolin.errors import DegenerateError, InputError
from photolin.shape.circle import fit_circle


def rim(angles: np.ndarray, centre: tuple[float, float], radius: float) -> tuple[np.ndarray, ...]:
    return centre[0] + radius * np.sin(angles), centre[1] + radius * np.cos(angles)


@pytest.mark.parametrize("count", [3, 4, 20])
@pytest.mark.parametrize(
    ("centre", "radius"), [((40.5, 61.25), 30.0), ((-3e3, 2e4), 900.0), ((0.0, 0.0), 0.7)]
)
def test_exact_points_give_the_exact_circle(
    count: int, centre: tuple[float, float], radius: float
) -> None:
    """Three points on a third of it, too; also far outside the picture."""
    for span in (2 * np.pi, 2.1):
        found, size = fit_circle(*rim(np.linspace(0.3, 0.3 + span * 0.95, count), centre, radius))
        np.testing.assert_allclose([*found, size], [*centre, radius], rtol=1e-7, atol=1e-7)


def test_distances_are_least_squares_not_areas() -> None:
    """Short arcs are where the linear start is biased towards small circles."""
    rng = np.random.default_rng(0)
    angles = np.linspace(0, 1.2, 40)
    radii = []
    for _ in range(50):
        rows, columns = rim(angles, (50, 50), 40)
        radii.append(fit_circle(rows + rng.normal(0, 0.7, 40), columns + rng.normal(0, 0.7, 40))[1])
    assert np.median(radii) == pytest.approx(40, rel=0.04)


def test_moving_and_scaling_the_points_moves_and_scales_the_circle() -> None:
    rng = np.random.default_rng(0)
    points = np.array(rim(np.linspace(0, 5, 9), (30, 40), 20)) + rng.normal(0, 1, (2, 9))
    (row, column), radius = fit_circle(*points)
    (r, c), R = fit_circle(*(3 * points + [[100], [-50]]))
    np.testing.assert_allclose([r, c, R], [3 * row + 100, 3 * column - 50, 3 * radius], rtol=1e-6)


def test_what_is_no_circle_is_refused() -> None:
    with pytest.raises(InputError, match="2 points on the rim; at least three"):
        fit_circle([1, 2], [3, 4])
    with pytest.raises(InputError, match="finite row and column"):
        fit_circle([1, 2, np.nan], [3, 4, 9])
    with pytest.raises(DegenerateError, match="lie on a line"):
        fit_circle([1, 2, 3, 4], [10, 20, 30, 40])
    with pytest.raises(DegenerateError, match="lie on a line"):
        fit_circle([5, 5, 5], [7, 7, 7])
