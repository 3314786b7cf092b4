"""Suggested T and Ts: sane on every scene, following the noise and the shadows; given ones stay."""

from dataclasses import replace

import numpy as np
import pytest
from lambert import lambertian, wrap

from photolin.analysis import Options
from photolin.errors import DegenerateError
from photolin.factorize import NO_NOISE, Factorization
from photolin.factors import Factor, Thresholds
from photolin.refine import MIN_T
from photolin.stack import ImageStack
from photolin.synthetic import SCENES, render_scene
from photolin.synthetic.render import Bits
from photolin.thresholds import (
    Suggestion,
    clipped_noise,
    scattered_light,
    shorten_above,
    suggest_thresholds,
)


def suggest(stack: ImageStack, options: Options | None = None) -> Suggestion:
    return suggest_thresholds(stack, options)


@pytest.mark.parametrize("name", SCENES)
def test_clean_scenes_get_thresholds_near_their_floor(name: str) -> None:
    t = suggest(render_scene(name).stack).thresholds
    assert 0.015 <= t.T <= 0.018
    assert 0.0005 <= t.Ts <= 0.002


@pytest.mark.parametrize("name", SCENES)
def test_8_bit_scenes_with_noise_get_a_shadow_level_above_it(name: str) -> None:
    """Noise is 0.01: shadows are below 0.02 with 97.7 %, below 0.03 with 99.9 %."""
    t = suggest(render_scene(name, noise=0.01, bits=8).stack).thresholds
    assert 0.035 <= t.T <= 0.055
    assert 0.018 <= t.Ts <= 0.045


@pytest.mark.parametrize("name", SCENES)
def test_broad_noise_that_is_clipped_at_black_is_not_taken_for_black_shadows(name: str) -> None:
    """3 % of noise has no mode in the histogram of all grays."""
    t = suggest(render_scene(name, size=(120, 160), noise=0.03, bits=None, seed=5).stack).thresholds
    assert 0.065 <= t.Ts <= 0.085


def noise_of(shadows: np.ndarray) -> float:
    """What these attached shadows (3,M) show beside as many lit pixels of intensity 0.8."""
    lit = np.full_like(shadows, 0.8)
    bases = np.concatenate([-lit, lit], axis=1)
    found = Factorization(np.eye(3), bases, 0, NO_NOISE)
    return clipped_noise(np.concatenate([shadows, lit], axis=1), found)


def test_faint_light_in_attached_shadows_is_not_taken_for_noise() -> None:
    """Interreflection there says nothing of the shadow level elsewhere."""
    noise = np.random.default_rng(0).normal(0, 0.02, (3, 500)).astype(np.float32)
    assert noise_of(np.abs(noise)) == 0
    np.testing.assert_allclose(noise_of(noise.clip(0)), 0.02, rtol=0.1)
    np.testing.assert_allclose(noise_of(3 * noise.clip(0)), 3 * noise_of(noise.clip(0)))


def light_of(shadows: np.ndarray, lit: np.ndarray) -> float:
    """The Ts that these attached shadows (3,M) ask for beside lit pixels (3,N)."""
    found = Factorization(np.eye(3), np.concatenate([0 * shadows - 0.8, lit], 1), 0, NO_NOISE)
    return scattered_light(np.concatenate([shadows, lit], axis=1), found)


def test_light_from_elsewhere_in_attached_shadows_is_below_the_shadow_level() -> None:
    rng = np.random.default_rng(0)
    faint = rng.uniform(0.001, 0.011, (3, 500)).astype(np.float32)
    lit = rng.uniform(0.02, 0.9, (3, 2000)).astype(np.float32)
    level = light_of(faint, lit)
    np.testing.assert_allclose(level, 0.0105, rtol=0.02)  # 95 % of them
    np.testing.assert_allclose(light_of(2 * faint, 2 * lit), 2 * level, rtol=1e-5)
    order = rng.permutation(500)
    assert light_of(faint[:, order], lit) == level
    assert light_of(0 * faint, lit) == 0


def test_attached_shadows_as_bright_as_what_is_lit_say_nothing() -> None:
    """It is the fit that is wrong there, as in highlights taken for the surface."""
    rng = np.random.default_rng(0)
    lit = rng.uniform(0.02, 0.9, (3, 2000)).astype(np.float32)
    assert light_of(rng.uniform(0.001, 0.5, (3, 500)).astype(np.float32), lit) == 0
    assert light_of(np.full((3, 500), 0.01, np.float32), lit[:, :0]) == 0


def test_few_attached_shadows_say_nothing_of_light_from_elsewhere() -> None:
    lit = np.random.default_rng(0).uniform(0.02, 0.9, (3, 50_000)).astype(np.float32)
    assert light_of(np.full((3, 30), 0.01, np.float32), lit) == 0
    assert light_of(np.full((3, 40), 0.01, np.float32), lit) == 0  # of 150 000 observations
    assert light_of(np.full((3, 60), 0.01, np.float32), lit) > 0


def test_suggested_shadow_level_follows_light_from_elsewhere() -> None:
    scene = render_scene("sphere_cone", size=(120, 160), images=12)
    images, shadow = scene.stack.images.copy(), scene.truth.labels == Factor.ATTACHED
    images[shadow] += np.random.default_rng(1).uniform(0, 0.008, shadow.sum()).astype(np.float32)
    plain = suggest(scene.stack).thresholds
    t = suggest(replace(scene.stack, images=images)).thresholds
    assert plain.Ts < 0.002
    assert 0.0076 < t.Ts < 0.02
    assert abs(t.T - plain.T) < 0.002


@pytest.mark.parametrize("name", ["pot", "sphere_obstacles"])
def test_light_that_no_histogram_shows_is_told_by_attached_shadows_alone(name: str) -> None:
    """Light of all levels up to 0.06 has no mode; by the histogram Ts would be near its floor."""
    scene = render_scene(name, size=(120, 160), images=24)
    images, shadow = scene.stack.images.copy(), scene.truth.labels == Factor.ATTACHED
    images[shadow] += np.random.default_rng(1).uniform(0, 0.06, shadow.sum()).astype(np.float32)
    t = suggest(replace(scene.stack, images=images.clip(0, 1))).thresholds
    assert 0.054 < t.Ts < 0.06


def test_a_fit_that_calls_lit_pixels_shadows_says_nothing_of_the_noise() -> None:
    lit = np.random.default_rng(0).normal(0, 0.5, (3, 500)).clip(0, 1).astype(np.float32)
    assert noise_of(lit) == 0


def test_few_attached_shadows_say_nothing_of_the_noise() -> None:
    few = np.tile(np.array([0, 0, 0, 0.02, 0.03], np.float32), (3, 2))
    assert noise_of(few) == 0
    assert noise_of(np.tile(few, 10)) > 0


def test_more_noise_gives_a_larger_tolerance() -> None:
    stack, _ = lambertian(14)
    rng = np.random.default_rng(0)
    T = []
    for relative in (0.005, 0.01, 0.02):
        noisy = stack.images * rng.normal(1, relative, stack.shape)
        T.append(suggest(wrap(np.clip(noisy, 0, 1)), Options(Ts=0.02)).thresholds.T)
    assert sorted(T) == T
    # the floor twice, then 1.41 standard deviations
    np.testing.assert_allclose(T, [MIN_T, MIN_T, 0.0281], rtol=0.08)


@pytest.mark.parametrize("level", [25, 28])
def test_shadows_that_all_have_one_gray_are_below_the_shadow_level(level: int) -> None:
    """Of 8 bits: between two levels of four decimals, of which only the upper one covers them."""
    stack = render_scene("sphere_cone", images=24, ambient=level / 255, bits=8).stack
    Ts = suggest(stack).thresholds.Ts
    assert np.float32(level / 255) < np.float32(Ts) < np.float32((level + 1) / 255)


def test_a_level_rounded_upwards_is_above_it_also_in_single_precision_and_close() -> None:
    levels = np.float32(np.arange(1, 9990) / 1e4)
    between = levels + np.float32(0.00005)
    for level in map(float, [*levels, *np.nextafter(levels, np.float32(0)), *between]):
        above = shorten_above(level)
        assert np.float32(level) < np.float32(above)
        assert above - level < 1.11e-4 or level < 0.001
    dark = [10.0**-n * f for n in range(3, 9) for f in (1, 1.04, 2.5, 9.99)]
    assert all(level < shorten_above(level) < 1.2 * level + 1e-12 for level in dark)


@pytest.mark.parametrize("level", [0.9999, 0.99999, 1.0])
def test_a_level_near_full_scale_gives_one_that_is_accepted(level: float) -> None:
    assert Thresholds(0.05, shorten_above(level)).Ts < 1


def test_an_ambient_level_lifts_the_shadow_level_over_it() -> None:
    level = suggest(render_scene("sphere_cone", ambient=0.03).stack, Options(T=0.05))
    assert 0.03 < level.thresholds.Ts < 0.06


SHADOWS = Options(T=0.05, method="classification")
"""Nothing but the shadow level is asked for."""


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(("noise", "bits"), [(0, 16), (0.01, 8), (0.01, 16)])
def test_an_ambient_level_is_measured(name: str, noise: float, bits: Bits) -> None:
    """Measured: within 0.6 bins, 1.3 where 8 bits are about as coarse as the bins."""
    stack = render_scene(name, size=(80, 100), ambient=0.02, noise=noise, bits=bits).stack
    found = suggest(stack, SHADOWS)
    assert abs(found.offset - 0.02) < (1.5 if bits == 8 else 1) * found.bin_width


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(("noise", "bits"), [(0, 8), (0.002, 8), (0.01, 8), (0.02, 16)])
def test_black_shadows_have_no_ambient_level_even_with_noise_clipped_at_zero(
    name: str, noise: float, bits: Bits
) -> None:
    stack = render_scene(name, size=(48, 64), noise=noise, bits=bits).stack
    assert suggest(stack, SHADOWS).offset == 0


@pytest.mark.parametrize("exponent", [1, 2, 4, 8, 20])
def test_a_darker_stack_gets_a_shadow_level_as_much_lower(exponent: int) -> None:
    """It was rounded to four decimals, hence to 0 on dark stacks."""
    stack = render_scene("sphere_cone", size=(48, 64), noise=0.01, bits=None).stack
    bright = suggest(stack, SHADOWS).thresholds.Ts
    dark = suggest(wrap(stack.images * np.float32(10.0**-exponent)), SHADOWS).thresholds.Ts
    assert dark == pytest.approx(bright * 10.0**-exponent, rel=0.05)


def test_a_scene_without_shadows_gets_a_level_below_its_pixels() -> None:
    stack, _ = lambertian()
    assert suggest(stack).thresholds.Ts < stack.images.min()


def test_what_is_given_is_kept() -> None:
    stack = render_scene("cup", size=(48, 48)).stack
    both = suggest(stack, Options(T=0.0371, Ts=0.0123, base_images=(3, 9, 14)))
    assert both.thresholds == Thresholds(0.0371, 0.0123)
    assert both.starts == ((3, 9, 14),)
    assert both.found is not None
    assert suggest(stack, replace(SHADOWS, Ts=0.0123)).found is None
    assert suggest(stack, Options(T=0.0371)).thresholds.T == 0.0371
    assert suggest(stack, Options(Ts=0.0123)).thresholds.Ts == 0.0123


def test_the_suggestion_is_the_same_for_the_same_seed() -> None:
    stack = render_scene("pot", size=(48, 48), noise=0.01, bits=8).stack
    assert suggest(stack).thresholds == suggest(stack).thresholds


def test_known_lights_take_the_place_of_estimated_ones() -> None:
    stack, lights = lambertian()
    found = suggest(replace(stack, lights=lights))
    assert found.found is not None
    # the same column space
    q = np.linalg.qr(found.found.coefficients)[0]
    np.testing.assert_allclose(q @ (q.T @ lights), lights, atol=1e-9)


def test_a_flat_scene_cannot_suggest_a_tolerance() -> None:
    with pytest.raises(DegenerateError):
        suggest(lambertian(flat=True)[0])
