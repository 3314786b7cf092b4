"""Suggested T and Ts: sane on every scene, following the noise and the shadows; given ones stay."""

from dataclasses import replace

import numpy as np
import pytest
from lambert import lambertian, wrap

from photolin.analysis import Options
from photolin.errors import DegenerateError
from photolin.factors import Thresholds
from photolin.refine import T_PER_NOISE
from photolin.sample import draw_sample
from photolin.stack import ImageStack
from photolin.synthetic import SCENES, render_scene
from photolin.thresholds import Suggestion, suggest_thresholds


def suggest(stack: ImageStack, options: Options | None = None) -> Suggestion:
    return suggest_thresholds(draw_sample(stack, 0), options or Options(), stack.lights)


@pytest.mark.parametrize("name", SCENES)
def test_clean_scenes_get_thresholds_near_their_floor(name: str) -> None:
    t = suggest(render_scene(name).stack).thresholds
    assert 0.008 <= t.T <= 0.012
    assert 0.001 <= t.Ts <= 0.006


@pytest.mark.parametrize("name", SCENES)
def test_8_bit_scenes_with_noise_get_a_shadow_level_above_it(name: str) -> None:
    """Noise is 0.01: shadows are below 0.02 with 97.7 %, below 0.03 with 99.9 %."""
    t = suggest(render_scene(name, noise=0.01, bits=8).stack).thresholds
    assert 0.03 <= t.T <= 0.06
    assert 0.018 <= t.Ts <= 0.04


def test_more_noise_gives_a_larger_tolerance() -> None:
    stack, _ = lambertian(14)
    rng = np.random.default_rng(0)
    T = []
    for relative in (0.005, 0.01, 0.02):
        noisy = stack.images * rng.normal(1, relative, stack.shape)
        T.append(suggest(wrap(np.clip(noisy, 0, 1)), Options(Ts=0.02)).thresholds.T)
    assert sorted(T) == T
    # less what the fit has taken and the cut at T itself
    np.testing.assert_allclose(T, T_PER_NOISE * np.array([0.005, 0.01, 0.02]), rtol=0.35)


def test_an_ambient_level_lifts_the_shadow_level_over_it() -> None:
    level = suggest(render_scene("sphere_cone", ambient=0.03).stack, Options(T=0.05))
    assert 0.03 < level.thresholds.Ts < 0.06


def test_a_scene_without_shadows_gets_a_level_below_its_pixels() -> None:
    stack, _ = lambertian()
    assert suggest(stack).thresholds.Ts < stack.images.min()


def test_what_is_given_is_kept() -> None:
    stack = render_scene("cup", size=(48, 48)).stack
    both = suggest(stack, Options(T=0.0371, Ts=0.0123, base_images=(3, 9, 14)))
    assert both.thresholds == Thresholds(0.0371, 0.0123)
    assert both.starts == ((3, 9, 14),)
    assert both.coefficients is None
    assert suggest(stack, Options(T=0.0371)).thresholds.T == 0.0371
    assert suggest(stack, Options(Ts=0.0123)).thresholds.Ts == 0.0123


def test_the_suggestion_is_the_same_for_the_same_seed() -> None:
    stack = render_scene("pot", size=(48, 48), noise=0.01, bits=8).stack
    assert suggest(stack).thresholds == suggest(stack).thresholds


def test_known_lights_take_the_place_of_estimated_ones() -> None:
    stack, lights = lambertian()
    found = suggest(replace(stack, lights=lights))
    assert found.coefficients is not None
    # the same column space
    q = np.linalg.qr(found.coefficients)[0]
    np.testing.assert_allclose(q @ (q.T @ lights), lights, atol=1e-9)


def test_a_flat_scene_cannot_suggest_a_tolerance() -> None:
    with pytest.raises(DegenerateError):
        suggest(lambertian(flat=True)[0])
