"""Derivatives of the bases: exact where smooth, absent at edges."""

import numpy as np
import pytest

from photolin.errors import DegenerateError
from photolin.shape.derivatives import SMOOTH, differentiate
from photolin.shape.directions import normalize

H, W = 60, 80


def hill(shift: float = 0.0) -> np.ndarray:
    """(3,H,W) unit normals of a smooth hill, its middle `shift` columns to the right."""
    row, column = np.indices((H, W))
    x, y = (column - 39.5 - shift) / 45, (29.5 - row) / 45
    p, q = -1.2 * x + 0.5 * x * y, -0.9 * y + 0.3 * np.sin(3 * x)
    return normalize(np.stack([-p, -q, np.ones((H, W))], -1).reshape(-1, 3)).T.reshape(3, H, W)


EVERY = np.ones((H, W), bool)


def test_derivatives_are_those_of_whitened_directions_to_the_right_and_upwards() -> None:
    found = differentiate(hill(), EVERY)
    values = np.tensordot(found.whitening, hill(), 1)
    values /= np.linalg.norm(values, axis=0)
    right = (values[:, :, 2:] - values[:, :, :-2])[:, 5:-5, 4:-4] / 2
    up = (values[:, :-2] - values[:, 2:])[:, 4:-4, 5:-5] / 2
    inner = found.used[5:-5, 5:-5]
    rows = (np.cumsum(found.used.ravel()).reshape(H, W) - 1)[5:-5, 5:-5][inner]
    for exact, got in ((right, found.by_x), (up, found.by_y)):
        scale = np.abs(exact).max()
        np.testing.assert_allclose(got[rows].T, exact[:, inner], atol=0.03 * scale)


def test_values_spread_evenly_whatever_the_lights() -> None:
    change = np.array([[0.9, 0.5, 0.3], [0.8, 0.6, 0.3], [0.7, 0.5, 0.5]])
    first, other = (
        differentiate(hill(), EVERY),
        differentiate(np.tensordot(change, hill(), 1), EVERY),
    )
    for found, lights in ((first, np.eye(3)), (other, change)):
        unit = normalize((lights @ hill().reshape(3, -1)).T) @ found.whitening.T
        np.testing.assert_allclose(unit.T @ unit / len(unit), np.eye(3) / 3, atol=1e-9)
    np.testing.assert_array_equal(first.used, other.used)


def test_only_edges_and_what_they_touch_are_left_out() -> None:
    """A step in depth: the same hill, elsewhere, in the right half."""
    bases = hill()
    bases[:, :, 50:] = hill(-40)[:, :, 50:]
    found = differentiate(bases, EVERY)
    assert not found.used[5:-5, 48:52].any()
    assert found.used[5:-5, 5:44].mean() > 0.95
    assert found.used[5:-5, 56:-5].mean() > 0.95
    plain = differentiate(hill(), EVERY)
    left = found.used[:, :45]
    assert np.abs(found.by_x).max() < 3 * np.abs(plain.by_x).max()
    assert left.sum() > 0.8 * plain.used[:, :45].sum()


def test_albedo_makes_no_edges() -> None:
    paint = np.where(np.indices((H, W)).sum(0) // 9 % 2, 0.2, 0.9)
    np.testing.assert_array_equal(
        differentiate(hill() * paint, EVERY).used, differentiate(hill(), EVERY).used
    )


def test_what_is_unknown_takes_no_part() -> None:
    known = EVERY.copy()
    known[20:35, 10:30] = False
    bases = hill()
    bases[:, ~known] = np.nan
    found = differentiate(bases, known)
    assert not found.used[19:36, 9:31].any()
    assert np.isfinite(found.values).all()
    other = differentiate(np.where(known, bases, 7), known)
    np.testing.assert_array_equal(other.values, found.values)


def test_noise_of_differences_is_smoothed() -> None:
    noise = np.random.default_rng(0).normal(0, 0.01, (3, H, W))
    plain, noisy = differentiate(hill(), EVERY), differentiate(hill() + noise, EVERY)
    both = plain.used & noisy.used
    inner = [
        found.by_x[both[found.used]] @ np.linalg.inv(found.whitening).T for found in (plain, noisy)
    ]
    error = (inner[1] - inner[0]).std()
    # of differences over two pixels of noise smoothed by a Gaussian
    expected = 0.01 / np.sqrt(8 * np.pi) / SMOOTH**2
    assert error == pytest.approx(expected, rel=0.2)


def test_too_little_and_too_flat_surfaces_are_refused() -> None:
    few = EVERY & False
    few[:9, :9] = True
    with pytest.raises(DegenerateError, match="81 pixels have linearized bases; integrability nee"):
        differentiate(hill(), few)
    comb = EVERY & (np.arange(W) % 4 < 2)
    with pytest.raises(DegenerateError, match="0 pixels lie away from outlines and edges"):
        differentiate(hill(), comb)
    with pytest.raises(DegenerateError, match="lie nearly in one plane"):
        differentiate(hill() * np.array([1, 0, 1])[:, None, None], EVERY)
    noise = np.random.default_rng(0).normal(0, 0.01, (3, H, W))
    with pytest.raises(DegenerateError, match="but for noise, the normals lie in a plane"):
        differentiate(hill() * np.array([1, 0, 1])[:, None, None] + noise, EVERY)
