"""Photometric stereo on all observations and on D alone: exact answers, and what errors do."""

from dataclasses import replace

import numpy as np
import pytest
from lambert import lambertian, wrap

from photolin import analyze, render_scene
from photolin.analysis import Analysis, Options
from photolin.errors import Cancelled, DegenerateError, InputError
from photolin.factors import Factor
from photolin.shape.normals import normals_from_bases
from photolin.shape.photometric_stereo import factorize_all, fit_all, fit_diffuse
from photolin.stack import ImageStack


@pytest.fixture(scope="module")
def relief() -> tuple[ImageStack, np.ndarray]:
    return lambertian(12)


def analyzed(stack: ImageStack) -> Analysis:
    return analyze(stack, Options(T=0.02, Ts=0.01))


def product(bases: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    return np.tensordot(coefficients, bases, 1)


# All observations


def test_a_diffuse_stack_is_explained_exactly(relief: tuple[ImageStack, np.ndarray]) -> None:
    stack, lights = relief
    np.testing.assert_allclose(product(fit_all(stack, lights), lights), stack.images, atol=1e-5)
    np.testing.assert_allclose(product(*factorize_all(stack)), stack.images, atol=1e-5)


def test_fit_all_is_linear_and_follows_the_lights(relief: tuple[ImageStack, np.ndarray]) -> None:
    stack, lights = relief
    once = fit_all(stack, lights)
    half = fit_all(replace(stack, images=stack.images / 2), lights)
    np.testing.assert_allclose(half, once / 2, atol=1e-6)
    np.testing.assert_allclose(fit_all(stack, 3 * lights), once / 3, atol=1e-6)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turned = fit_all(stack, lights @ turn.T)
    np.testing.assert_allclose(turned, np.einsum("ij,jhw->ihw", turn, once), atol=1e-5)


def test_the_order_of_images_does_not_matter(relief: tuple[ImageStack, np.ndarray]) -> None:
    stack, lights = relief
    order = np.random.default_rng(0).permutation(12)
    other = replace(stack, images=stack.images[order])
    np.testing.assert_allclose(fit_all(other, lights[order]), fit_all(stack, lights), atol=1e-5)
    _, coefficients = factorize_all(stack)
    np.testing.assert_allclose(factorize_all(other)[1], coefficients[order], atol=1e-6)


def test_the_factorization_is_the_lights_up_to_a_matrix(
    relief: tuple[ImageStack, np.ndarray],
) -> None:
    stack, lights = relief
    _, c = factorize_all(stack)
    np.testing.assert_allclose(c.T @ c, 4 * np.eye(3), atol=1e-9)
    matrix = np.linalg.lstsq(c, lights)[0]
    np.testing.assert_allclose(c @ matrix, lights, atol=1e-5)


def test_the_factorization_is_the_best_of_rank_three() -> None:
    images = np.random.default_rng(0).uniform(0.1, 0.9, (8, 5, 6)).astype(np.float32)
    mask = np.ones((5, 6), bool)
    mask[0] = False
    bases, c = factorize_all(wrap(images, mask))
    u, s, v = np.linalg.svd(images[:, mask], full_matrices=False)
    np.testing.assert_allclose(product(bases, c)[:, mask], (u[:, :3] * s[:3]) @ v[:3], atol=1e-5)
    assert (bases[:, ~mask] == 0).all()
    assert (c.sum(axis=0) > 0).all()


def test_shadows_and_highlights_pull_all_observations_and_not_the_labels() -> None:
    """What section 4.C is about."""
    scene = render_scene("pot", size=(64, 64))
    lights = scene.truth.lights * scene.truth.power[:, None].astype(float)
    stack = replace(scene.stack, lights=lights)
    a = analyze(stack)
    matrix = np.linalg.inv(lights[list(a.base_images)])
    errors = []
    for bases, m in ((fit_all(stack, lights), np.eye(3)), (fit_diffuse(stack, a), matrix)):
        normals, _ = normals_from_bases(bases, m)
        cosine = (normals * scene.truth.normals).sum(axis=2)[stack.mask]
        errors.append(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    assert np.mean(errors[0]) > 2
    assert np.nanmean(errors[1]) < 0.1


def test_lights_of_another_count_or_in_a_plane_are_refused(
    relief: tuple[ImageStack, np.ndarray],
) -> None:
    stack, lights = relief
    with pytest.raises(InputError, match="11 lights for 12 images"):
        fit_all(stack, lights[1:])
    with pytest.raises(DegenerateError, match="lights lie in one plane"):
        fit_all(stack, lights * (1, 0, 1))


@pytest.mark.parametrize("kind", ["flat", "coplanar"])
def test_a_stack_of_rank_two_or_one_has_no_factorization(kind: str) -> None:
    stack, _ = lambertian(8, **{kind: True})
    with pytest.raises(DegenerateError, match="fewer than three independent parts"):
        factorize_all(stack)


def test_two_pixels_have_no_factorization(relief: tuple[ImageStack, np.ndarray]) -> None:
    mask = np.zeros((24, 30), bool)
    mask[3, 4:6] = True
    with pytest.raises(DegenerateError, match="fewer than three independent parts"):
        factorize_all(replace(relief[0], mask=mask))


# D observations


def test_on_a_diffuse_stack_labels_give_the_linearized_bases(
    relief: tuple[ImageStack, np.ndarray],
) -> None:
    a = analyzed(relief[0])
    np.testing.assert_allclose(fit_diffuse(relief[0], a), a.linearized_bases, atol=2e-4)


def test_what_is_not_d_has_no_say(relief: tuple[ImageStack, np.ndarray]) -> None:
    stack, a = relief[0], analyzed(relief[0])
    labels, images = a.labels.copy(), stack.images.copy()
    for k, code in enumerate((Factor.SPECULAR, Factor.ATTACHED, Factor.CAST, Factor.UNDEFINED)):
        labels[k, 5:9], images[k, 5:9] = code, 0.001 * k
    found = fit_diffuse(replace(stack, images=images), replace(a, labels=labels))
    np.testing.assert_allclose(found, fit_diffuse(stack, replace(a, labels=labels)), atol=0)
    np.testing.assert_allclose(found, a.linearized_bases, atol=1e-3)


def test_too_few_observations_or_lights_in_a_plane_are_marked_not_invented(
    relief: tuple[ImageStack, np.ndarray],
) -> None:
    stack, lights = relief
    lights = lights.copy()
    lights[3] = lights[0] + lights[1]  # coplanar with images 0 and 1
    a = analyzed(stack)
    coefficients = lights @ np.linalg.inv(lights[list(a.base_images)])
    a = replace(a, coefficients=coefficients)
    labels = np.full_like(a.labels, Factor.CAST)
    labels[:3, 0], labels[:2, 1], labels[[0, 1, 3], 2] = (
        Factor.DIFFUSE,
        Factor.DIFFUSE,
        Factor.DIFFUSE,
    )
    found = fit_diffuse(stack, replace(a, labels=labels))
    assert np.isfinite(found[:, 0]).all()
    assert np.isnan(found[:, 1:4]).all()


def test_outside_the_mask_is_zero_and_threads_do_not_matter() -> None:
    scene = render_scene("pot", size=(48, 48), noise=0.01)
    a = analyze(scene.stack)
    one, two = (fit_diffuse(scene.stack, a, threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one, two)
    assert (one[:, ~scene.stack.mask] == 0).all()


def test_a_foreign_analysis_is_refused_and_work_can_be_cancelled(
    relief: tuple[ImageStack, np.ndarray],
) -> None:
    a = analyzed(relief[0])
    with pytest.raises(InputError, match="the analysis of this stack is accepted"):
        fit_diffuse(lambertian(12, (5, 6))[0], a)
    with pytest.raises(Cancelled):
        fit_diffuse(relief[0], a, cancel=lambda: True)
