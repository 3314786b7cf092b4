"""Alternation: coefficients of all images at once, from poor starts, narrow lights, few pixels."""

import numpy as np
import pytest
from lambert import lambertian, wrap

from photolin.errors import Cancelled, DegenerateError
from photolin.evaluate import light_error
from photolin.factorize import (
    alternate,
    balance_directions,
    fit_bases,
    orthogonalize,
    search_coefficients,
    start_coefficients,
)
from photolin.factors import Thresholds
from photolin.refine import refine_coefficients
from photolin.sample import Sample, draw_sample
from photolin.synthetic import render_scene

THRESHOLDS = Thresholds(0.02, 0.01)


@pytest.fixture(scope="module")
def diffuse() -> tuple[Sample, np.ndarray]:
    stack, lights = lambertian()
    return draw_sample(stack, 0), lights


# Laws


def test_orthogonal_columns_span_the_same_and_have_the_stated_length() -> None:
    c = np.random.default_rng(0).normal(size=(12, 3)) * (1, 0.1, 0.01)
    q = orthogonalize(c)
    np.testing.assert_allclose(q.T @ q, np.eye(3) * 4, atol=1e-12)
    np.testing.assert_allclose(q @ np.linalg.lstsq(q, c)[0], c, atol=1e-12)


@pytest.mark.parametrize("triple", [(0, 1, 2), (1, 4, 7), (9, 5, 2)])
def test_any_base_images_lead_to_the_lights_of_diffuse_images(
    diffuse: tuple[Sample, np.ndarray], triple: tuple[int, int, int]
) -> None:
    sample, lights = diffuse
    rough = search_coefficients(sample, [triple], THRESHOLDS, 0, 500)
    found = refine_coefficients(sample, rough, 0.01, 0, 500)
    assert light_error(found.coefficients, lights) < 1e-3
    np.testing.assert_allclose(found.coefficients @ found.bases, sample.images, atol=1e-5)
    assert found.score == sample.images.size


def test_alternation_leaves_the_truth_where_it_is(diffuse: tuple[Sample, np.ndarray]) -> None:
    sample, lights = diffuse
    found = alternate(sample, lights, THRESHOLDS, (1.0, 1.0), 0, 500)
    assert found is not None
    np.testing.assert_allclose(found.coefficients, orthogonalize(lights), atol=1e-5)


def test_the_same_seed_gives_the_same_bytes(diffuse: tuple[Sample, np.ndarray]) -> None:
    one, other = (search_coefficients(diffuse[0], [(0, 1, 2)], THRESHOLDS, 4, 50) for _ in "ab")
    np.testing.assert_array_equal(one, other)


def test_bases_of_a_pixel_lit_in_two_images_are_undetermined(
    diffuse: tuple[Sample, np.ndarray],
) -> None:
    sample, lights = diffuse
    images = sample.images.copy()
    images[2:, 7] = 0
    holed = Sample(images, images.T.copy(), sample.places)
    bases, _ = fit_bases(holed, lights, 0.02, 0.01, 0, 500)
    assert np.argwhere(np.isnan(bases)).tolist() == [[r, 7] for r in range(3)]


# A plane counts once


def test_a_dominant_direction_is_thinned_and_rare_ones_are_kept() -> None:
    rng = np.random.default_rng(0)
    bases = rng.normal(size=(3, 1200))
    bases[:, :1000] = np.array([[0.2], [0.3], [0.9]]) * rng.uniform(0.5, 1, 1000)
    bases[:, 5] = np.nan
    bases = bases.astype(np.float32)
    balanced = balance_directions(bases, rng)
    voting = np.isfinite(balanced[0])
    assert 16 <= voting[:1000].sum() <= 40
    assert voting[1000:].all()
    np.testing.assert_array_equal(balanced[:, voting], bases[:, voting])
    assert np.isnan(balanced[:, ~voting]).all()


def test_bases_of_no_length_have_no_say() -> None:
    bases = np.zeros((3, 40), np.float32)
    bases[:, 1] = 1
    assert np.isfinite(balance_directions(bases, np.random.default_rng(0))[0]).sum() == 1
    for nothing in (np.zeros((3, 4), np.float32), np.full((3, 4), np.nan, np.float32)):
        balanced = balance_directions(nothing, np.random.default_rng(0))
        np.testing.assert_array_equal(balanced, nothing)


# Truth


def test_a_dominant_plane_does_not_fool_it() -> None:
    """The scene of the paper, whose ground plane fills most of the picture."""
    scene = render_scene("sphere_cone", size=(60, 80))
    sample, t = draw_sample(scene.stack, 0), Thresholds(0.01, 0.003)
    rough = search_coefficients(sample, [(0, 3, 10), (1, 2, 9)], t, 0, 500)
    found = refine_coefficients(sample, rough, 0.003, 0, 500)
    assert light_error(rough, scene.truth.lights) < 3
    assert light_error(found.coefficients, scene.truth.lights) < 0.3


@pytest.mark.parametrize(("width", "relief"), [(0.3, 1), (0.1, 1), (1, 0.2), (0.2, 0.3)])
def test_narrow_lights_and_shallow_relief_are_solved(width: float, relief: float) -> None:
    rng = np.random.default_rng(0)
    lights = rng.uniform(-0.6, 0.6, (12, 3)) * (width, width, 0) + (0, 0, 0.8)
    normals = rng.uniform(-0.5, 0.5, (3, 900)) * [[relief], [relief], [0]] + [[0], [0], [1]]
    sample = draw_sample(wrap((lights @ normals).reshape(12, 30, 30)), 0)
    starts = [(0, 1, 2), (3, 4, 5), (6, 7, 8)]
    rough = search_coefficients(sample, starts, THRESHOLDS, 0, 500)
    found = refine_coefficients(sample, rough, 0.01, 0, 500)
    assert light_error(found.coefficients, lights) < 0.01


# What is not determined


@pytest.mark.parametrize("case", ["flat", "coplanar", "same", "noisy flat"])
def test_images_that_span_too_little_are_refused(case: str) -> None:
    stack, _ = lambertian(flat="flat" in case, coplanar=case == "coplanar")
    images = stack.images.copy()
    if case == "same":
        images[:] = images[0]
    if case == "noisy flat":
        images += np.random.default_rng(0).normal(0, 5e-4, images.shape).astype(np.float32)
    with pytest.raises(DegenerateError, match=r"lie in one plane, the scene may be flat, .* Ts"):
        search_coefficients(draw_sample(wrap(images), 0), [(0, 1, 2)], THRESHOLDS, 0, 500)


def test_an_image_without_light_is_named() -> None:
    images = lambertian()[0].images.copy()
    images[6] = 0
    images[6, 0, :2] = 0.5
    with pytest.raises(DegenerateError, match=r"image 6 is lit in fewer than three .* take it out"):
        search_coefficients(draw_sample(wrap(images), 0), [(0, 1, 2)], THRESHOLDS, 0, 500)


def test_a_start_needs_pixels_lit_in_all_three(diffuse: tuple[Sample, np.ndarray]) -> None:
    images = diffuse[0].images.copy()
    for k in range(3):
        images[k, np.arange(images.shape[1]) % 3 == k] = 0
    sample = Sample(images, images.T.copy(), np.arange(images.shape[1]))
    for Ts in (0.01, 0.0):
        assert start_coefficients(sample, (0, 1, 2), Thresholds(0.02, Ts), 0, 500) is None
        assert start_coefficients(sample, (3, 4, 5), Thresholds(0.02, Ts), 0, 500) is not None


def test_it_can_be_cancelled(diffuse: tuple[Sample, np.ndarray]) -> None:
    with pytest.raises(Cancelled):
        search_coefficients(diffuse[0], [(0, 1, 2)], THRESHOLDS, 0, 500, cancel=lambda: True)
    with pytest.raises(Cancelled):
        refine_coefficients(*diffuse, 0.01, 0, 500, cancel=lambda: True)
