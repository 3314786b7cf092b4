"""The choice among bas-reliefs: even albedo, even powers, outlines that point outward."""

import numpy as np
import pytest

from photolin.shape.bas_relief import (
    choose_relief,
    entropy,
    points_inward,
    relief,
    weighted_median,
)
from photolin.shape.directions import angles_between
from photolin.shape.sphere import sphere_normals

NORMALS, BALL = sphere_normals((80, 80), (39.5, 39.5), 36)
_, USED = sphere_normals((80, 80), (39.5, 39.5), 33)
TRUE = NORMALS[USED]
EVEN = np.ones(len(TRUE))


def changed(albedo: np.ndarray | float = 1.0, *, flip: bool = False) -> np.ndarray:
    """Surface vectors (N,3) of the ball, stretched, tilted and perhaps turned inside out."""
    change = relief(0.5, -0.3, 0.6)
    change[:2] *= -1 if flip else 1
    return (TRUE * np.reshape(albedo, (-1, 1))) @ change.T


def chosen_error(vectors: np.ndarray, lights: np.ndarray | None = None) -> float:
    """Mean angle to the true normals after the choice, degrees."""
    chosen = choose_relief(vectors, EVEN, lights, USED, BALL)
    return float(angles_between(vectors @ chosen.T, TRUE).mean())


def checks() -> np.ndarray:
    return np.where(np.indices((80, 80)).sum(0) // 7 % 3, 0.9, 0.3)[USED]


@pytest.mark.parametrize("flip", [False, True])
def test_even_albedo_gives_the_truth_and_not_its_inside(flip: bool) -> None:
    assert chosen_error(changed(flip=flip)) < 1


def test_two_paints_are_as_good_as_one() -> None:
    assert chosen_error(changed(checks())) < 1


def test_only_bas_reliefs_are_chosen_for_others_are_no_surfaces() -> None:
    chosen = choose_relief(changed(), EVEN, None, USED, BALL)
    np.testing.assert_allclose(chosen[2], (0, 0, 1))
    assert chosen[0, 0] == pytest.approx(chosen[1, 1])
    assert chosen[0, 1] == chosen[1, 0] == 0


def test_even_powers_help_where_albedo_misleads() -> None:
    """Albedo that grows to the right, as a tilt would make it look."""
    vectors = changed(np.exp(0.6 * TRUE[:, 0]))
    rng = np.random.default_rng(0)
    lights = rng.uniform((-0.6, -0.6, 0.4), (0.6, 0.6, 1.6), (20, 3))
    lights /= np.linalg.norm(lights, axis=1, keepdims=True)
    rays = lights @ np.linalg.inv(relief(0.5, -0.3, 0.6))
    assert chosen_error(vectors) > 8
    assert chosen_error(vectors, rays) < 2
    # a few lights of another power do not matter
    rays[:4] *= 1.7
    assert chosen_error(vectors, rays) < 3


def test_where_no_outline_is_seen_the_surface_is_convex_on_the_whole() -> None:
    everywhere = np.ones_like(BALL)
    for flip in (False, True):
        vectors = changed(flip=flip)
        chosen = choose_relief(vectors, EVEN, None, USED, everywhere)
        assert angles_between(vectors @ chosen.T, TRUE).mean() < 1


def test_an_outline_decides_against_the_whole() -> None:
    """A bowl with a thick round edge is concave for the most part."""
    row, column = np.indices((80, 80))
    x, y = (column - 39.5) / 36, (39.5 - row) / 36
    r = np.hypot(x, y)
    slope = np.where(r < 0.75, 1.1 * r, 12 * (0.817 - r))  # dz/dr
    p, q = (slope * w / np.maximum(r, 1e-9) for w in (x, y))
    normals = np.stack([-p, -q, np.ones_like(p)], -1)
    normals = (normals / np.linalg.norm(normals, axis=-1, keepdims=True))[BALL]
    chosen = choose_relief(normals, np.ones(len(normals)), None, BALL, BALL)
    assert chosen[0, 0] > 0
    chosen = choose_relief(normals * (-1, -1, 1), np.ones(len(normals)), None, BALL, BALL)
    assert chosen[0, 0] < 0


def test_pixels_without_weight_do_not_matter() -> None:
    vectors = changed()
    weights = (np.arange(len(vectors)) % 2).astype(float)
    spoilt = np.where(weights[:, None] > 0, vectors, (0.2, -0.1, 0.3))
    expected = choose_relief(vectors, weights, None, USED, BALL)
    np.testing.assert_allclose(choose_relief(spoilt, weights, None, USED, BALL), expected)


def test_what_nothing_decides_stays_where_normals_face_the_camera() -> None:
    """The four sides of a pyramid have the same albedo under any stretch."""
    sides = np.array([[0.8, 0, 1], [-0.8, 0, 1], [0, 0.8, 1], [0, -0.8, 1]])
    sides += np.array([0.3, -0.2, 0])
    pyramid = sides[np.arange(len(TRUE)) % 4]
    chosen = choose_relief(pyramid, EVEN, None, USED, BALL)
    slopes = np.abs((sides @ chosen.T)[:, :2]).max(axis=1)
    np.testing.assert_allclose(slopes, 1, atol=0.1)


def test_one_normal_for_the_most_part_divides_by_nothing() -> None:
    ridge = np.where(np.arange(len(TRUE))[:, None] % 3, (0.1, 0.2, 1), (0.9, -0.4, 1))
    assert np.isfinite(choose_relief(ridge, EVEN, None, USED, BALL)).all()


def test_a_saddle_is_convex_where_it_bends_most() -> None:
    everywhere = np.ones_like(BALL)
    for factors in ((-0.3, 1, 1), (1, -0.3, 1)):
        assert not points_inward(TRUE * factors, USED, everywhere)
        assert points_inward(TRUE * factors * (-1, -1, 1), USED, everywhere)


def test_entropy_is_that_of_the_smoothed_density_and_blind_to_scale() -> None:
    rng = np.random.default_rng(0)
    share = np.full(20000, 1 / 20000)
    wide = rng.normal(0, 0.2, 20000)
    # of a Gaussian, in bins of 0.01, widened by the smoothing of 0.04
    expected = 0.5 * np.log(2 * np.pi * np.e * (0.2**2 + 0.04**2)) - np.log(0.01)
    assert entropy(wide, share) == pytest.approx(expected, abs=0.02)
    assert entropy(wide + 5, share) == pytest.approx(entropy(wide, share))
    assert entropy(wide / 4, share) < entropy(wide, share)
    assert np.isfinite(entropy(np.array([-90.0, 0, 0, 90]), np.full(4, 0.25)))


def test_the_weighted_median_is_that_of_repeated_values() -> None:
    values, weights = np.array([5.0, 1, 3, 2]), np.array([1.0, 2, 3, 1])
    assert weighted_median(values, weights) == np.median([5, 1, 1, 3, 3, 3, 2])
