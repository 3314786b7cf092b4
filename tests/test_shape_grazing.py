"""Bases from grazing lights: nearer to the truth on surfaces that are not Lambertian, the same ones
on those that are."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from lambert import lambertian

from photolin import Analysis, ImageStack, Options, analyze, render_scene
from photolin.errors import Cancelled, InputError
from photolin.shape.grazing import fit_grazing
from photolin.shape.normals import normals_from_bases

Reflect = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Radiance at cosines n·s and n·v of incidence and view and n·h (half-way), all (K,P)."""
K = 60


def rough(ns: np.ndarray, nv: np.ndarray, nh: np.ndarray) -> np.ndarray:
    """Flatter than Lambert where bright, as rough surfaces are (Minnaert's law)."""
    return 0.6 * ns**0.8 * nv**-0.2


def sharp(ns: np.ndarray, nv: np.ndarray, nh: np.ndarray) -> np.ndarray:
    return 0.5 * ns + 0.4 * nh**150


def glazed(ns: np.ndarray, nv: np.ndarray, nh: np.ndarray) -> np.ndarray:
    return rough(ns, nv, nh) + 0.3 * nh**100


def broad(ns: np.ndarray, nv: np.ndarray, nh: np.ndarray) -> np.ndarray:
    """A highlight that half of all directions see."""
    return 0.5 * ns + 0.15 * nh**12


def sphere(
    reflect: Reflect, noise: float = 0.0, side: int = 40, seed: int = 0
) -> tuple[ImageStack, np.ndarray]:
    """A sphere under K lights up to 50 degrees from the camera, and its normals (H,W,3)."""
    row, column = np.mgrid[:side, :side]
    x, y = (column + 0.5 - side / 2) * 2.1 / side, (side / 2 - row - 0.5) * 2.1 / side
    mask = x**2 + y**2 < 0.95
    normals = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=2) * mask[..., None]
    turn = np.arange(K) * 2.399963
    slant = np.radians(50) * np.sqrt((np.arange(K) + 0.5) / K)
    lights = np.stack(
        [np.sin(slant) * np.cos(turn), np.sin(slant) * np.sin(turn), np.cos(slant)], axis=1
    )
    half = lights + np.eye(3)[2]
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    n = normals[mask]
    ns, nh = lights @ n.T, np.clip(half @ n.T, 0, 1)
    values = np.where(ns > 0, reflect(np.maximum(ns, 0), n[:, 2], nh), 0)
    images = np.zeros((K, side, side), np.float32)
    images[:, mask] = np.clip(
        values + np.random.default_rng(seed).normal(0, noise, values.shape), 0, 1
    )
    names = tuple(map(str, range(K)))
    return ImageStack(images, mask, names, lights=lights), normals


def mean_error(stack: ImageStack, a: Analysis, bases: np.ndarray, normals: np.ndarray) -> float:
    """Mean angle to the truth, degrees."""
    assert stack.lights is not None
    found, _ = normals_from_bases(bases, np.linalg.inv(stack.lights[list(a.base_images)]))
    cosine = (found * normals).sum(axis=2)[stack.mask]
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean())


@pytest.fixture(scope="module")
def uneven() -> tuple[ImageStack, Analysis, np.ndarray]:
    stack, normals = sphere(rough, 0.002)
    return stack, analyze(stack), normals


# What it gains


@pytest.mark.parametrize(("reflect", "change"), [(rough, -0.9), (glazed, -0.9), (broad, 0.5)])
def test_rough_surfaces_gain_more_than_broad_highlights_lose(
    reflect: Reflect, change: float
) -> None:
    """Degrees. Highlights so broad that all lights make some are a matter of all observations."""
    stack, normals = sphere(reflect, 0.002)
    a = analyze(stack)
    before = mean_error(stack, a, a.linearized_bases, normals)
    after = mean_error(stack, a, fit_grazing(stack, a), normals)
    assert before > 0.5
    assert after < before + change


# What it leaves


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("scene", ["pot", "sphere_obstacles"])
def test_lambertian_surfaces_with_highlights_keep_their_bases(scene: str, noise: float) -> None:
    """Noisy or not, half of the observations know less than all."""
    stack = render_scene(scene, size=(64, 64), images=60, noise=noise).stack
    a = analyze(stack)
    np.testing.assert_array_equal(fit_grazing(stack, a), a.linearized_bases)


def test_sharp_highlights_alone_change_nothing() -> None:
    stack, _ = sphere(sharp, 0.002)
    a = analyze(stack)
    np.testing.assert_array_equal(fit_grazing(stack, a), a.linearized_bases)


def test_stacks_of_few_images_keep_their_bases() -> None:
    stack, _ = sphere(rough)
    assert stack.lights is not None
    few = ImageStack(stack.images[:20], stack.mask, stack.names[:20], lights=stack.lights[:20])
    a = analyze(few)
    np.testing.assert_array_equal(fit_grazing(few, a), a.linearized_bases)


def test_unknown_pixels_stay_nan_and_those_outside_zero(
    uneven: tuple[ImageStack, Analysis, np.ndarray],
) -> None:
    stack, a, _ = uneven
    bases = a.linearized_bases.copy()
    bases[:, 20, 20] = np.nan
    out = fit_grazing(stack, replace(a, linearized_bases=bases))
    assert out.dtype == np.float32
    assert np.isnan(out[:, 20, 20]).all()
    assert np.isnan(out).sum() == 3
    assert (out[:, ~stack.mask] == 0).all()


def test_pixels_lit_in_few_images_keep_theirs_to_the_bit(
    uneven: tuple[ImageStack, Analysis, np.ndarray],
) -> None:
    stack, a, _ = uneven
    images = stack.images.copy()
    images[20:, 10:14] = 0
    out = fit_grazing(replace(stack, images=images), a)
    np.testing.assert_array_equal(out[:, 10:14], a.linearized_bases[:, 10:14])
    assert (out[:, 14:30] != a.linearized_bases[:, 14:30]).any()


# Laws


def test_the_answer_is_the_same_with_any_base_images(
    uneven: tuple[ImageStack, Analysis, np.ndarray],
) -> None:
    """And where lights are unknown."""
    stack, a, _ = uneven
    other = np.random.default_rng(0).normal(size=(3, 3)) + 2 * np.eye(3)
    turned = replace(
        a,
        lights=None,
        coefficients=a.coefficients @ np.linalg.inv(other),
        linearized_bases=np.einsum("ij,jhw->ihw", other, a.linearized_bases).astype(np.float32),
    )
    right = np.einsum("ij,jhw->ihw", other, fit_grazing(stack, a))
    difference = np.abs(fit_grazing(stack, turned) - right)
    # observations at the very limits may change sides
    assert np.quantile(difference, 0.99) < 1e-4
    assert np.median(difference) < 1e-6


def test_brightness_scales_the_bases(uneven: tuple[ImageStack, Analysis, np.ndarray]) -> None:
    stack, a, _ = uneven
    half = replace(
        a,
        linearized_bases=a.linearized_bases / 2,
        thresholds=replace(a.thresholds, Ts=a.thresholds.Ts / 2),
    )
    dim = ImageStack(stack.images / np.float32(2), stack.mask, stack.names, lights=stack.lights)
    np.testing.assert_allclose(2 * fit_grazing(dim, half), fit_grazing(stack, a), atol=1e-6)


def test_known_powers_order_the_observations(
    uneven: tuple[ImageStack, Analysis, np.ndarray],
) -> None:
    stack, a, normals = uneven
    powers = np.random.default_rng(0).uniform(0.3, 1, K)
    dim = ImageStack(
        (stack.images * powers[:, None, None]).astype(np.float32),
        stack.mask,
        stack.names,
        lights=stack.lights * powers[:, None],  # pyright: ignore[reportOptionalOperand]
    )
    b = analyze(dim, Options(base_images=a.base_images))
    told = mean_error(dim, b, fit_grazing(dim, b, powers), normals)
    np.testing.assert_array_equal(fit_grazing(dim, b, 5 * powers), fit_grazing(dim, b, powers))
    untold = mean_error(dim, b, fit_grazing(dim, b), normals)
    assert told < 0.9 * untold


def test_threads_do_not_change_a_bit(uneven: tuple[ImageStack, Analysis, np.ndarray]) -> None:
    stack, a, _ = uneven
    one = fit_grazing(stack, a, threads=1)
    np.testing.assert_array_equal(fit_grazing(stack, a, threads=3), one)
    assert (one != a.linearized_bases).any()


# What is refused


def test_another_stack_and_impossible_powers_are_refused(
    uneven: tuple[ImageStack, Analysis, np.ndarray],
) -> None:
    stack, a, _ = uneven
    with pytest.raises(InputError, match="the analysis of this stack is accepted"):
        fit_grazing(lambertian(K, (40, 40))[0], a)
    with pytest.raises(InputError, match="the analysis of this stack is accepted"):
        fit_grazing(lambertian(12, (40, 40))[0], a)
    for powers in (np.ones(K - 1), np.zeros(K), np.full(K, np.nan)):
        with pytest.raises(InputError, match=f"{K} numbers above 0 are accepted"):
            fit_grazing(stack, a, powers)


def test_work_can_be_cancelled_and_is_told(uneven: tuple[ImageStack, Analysis, np.ndarray]) -> None:
    stack, a, _ = uneven
    told: list[tuple[str, float]] = []
    fit_grazing(stack, a, progress=lambda stage, f: told.append((stage, f)))
    assert told[-1] == ("normals", 1.0)
    with pytest.raises(Cancelled):
        fit_grazing(stack, a, cancel=lambda: True)
