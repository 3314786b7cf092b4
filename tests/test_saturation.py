"""Saturated observations: found at full scale and below it, and kept from having a say."""

from dataclasses import replace

import numpy as np
import pytest
from lambert import lambertian, wrap

from photolin import analyze, render_scene
from photolin.analysis import Options
from photolin.evaluate import light_error
from photolin.factors import Thresholds
from photolin.linearize import Quality, linearize
from photolin.sample import draw_sample
from photolin.saturation import find_white
from photolin.stack import ImageStack
from photolin.synthetic import SCENES
from photolin.synthetic.render import Bits

LEVEL = np.float32(0.7)


def clipped(level: float = LEVEL) -> tuple[ImageStack, np.ndarray, np.ndarray]:
    """Diffuse images cut off at `level`, what they were before, and their lights."""
    stack, lights = lambertian(16)
    return wrap(np.minimum(stack.images, np.float32(level))), stack.images, lights


# What counts as saturated


def test_full_scale_is_saturated_and_images_that_do_not_reach_it_are_not() -> None:
    images = lambertian()[0].images.copy()
    images[3, 2, 5] = 1
    expected = np.full(10, np.inf, np.float32)
    expected[3] = 1
    np.testing.assert_array_equal(find_white(wrap(images)), expected)


def test_a_pile_below_full_scale_is_found_in_each_image() -> None:
    """As a division by the powers of the lights leaves it."""
    stack, _, _ = clipped()
    power = np.linspace(0.6, 1.4, 16, dtype=np.float32)[:, None, None]
    white = find_white(wrap(stack.images * power))
    # four times the next five levels, which hold one pixel each
    piled = (stack.images == LEVEL).sum(axis=(1, 2)) > 20
    assert 10 <= piled.sum() < 16
    np.testing.assert_array_equal(white[piled], (LEVEL * power.ravel())[piled])
    assert np.isinf(white[~piled]).all()


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(("noise", "bits"), [(0, 16), (0, 8), (0.01, 8)])
def test_highlights_that_are_not_cut_off_are_not_saturated(
    name: str, noise: float, bits: Bits
) -> None:
    stack = render_scene(name, size=(80, 100), noise=noise, bits=bits).stack
    white = find_white(wrap(stack.images * np.float32(0.9), stack.mask))
    short = stack.images[:, stack.mask].max(axis=1) < 1
    assert short.any() == (name != "sphere_cone")
    assert np.isinf(white[short]).all()


def test_what_lies_outside_the_mask_does_not_count() -> None:
    images = lambertian()[0].images.copy()
    images[:, :4] = 1
    mask = np.ones(images.shape[1:], bool)
    mask[:4] = False
    assert np.isinf(find_white(wrap(images, mask))).all()
    assert (find_white(wrap(images)) == 1).all()


@pytest.mark.parametrize("value", [1.0, 0.5])
def test_an_image_of_one_value_is_saturated(value: float) -> None:
    """It tells nothing, whatever the value."""
    images = lambertian()[0].images.copy()
    images[2] = value
    assert find_white(wrap(images))[2] == np.float32(value)


# What becomes of it


def test_saturated_observations_are_black_in_the_sample() -> None:
    stack, _, _ = clipped()
    white = np.full(16, LEVEL)
    plain, dimmed = draw_sample(stack, 0), draw_sample(stack, 0, white)
    assert 0.05 < (plain.images == LEVEL).mean() < 0.5
    np.testing.assert_array_equal(dimmed.images, np.where(plain.images < LEVEL, plain.images, 0))
    np.testing.assert_array_equal(dimmed.pixels, dimmed.images.T)


def test_the_fit_of_clipped_images_is_right_with_white_known_and_wrong_without() -> None:
    stack, ideal, lights = clipped()
    c = lights @ np.linalg.inv(lights[:3])
    options, thresholds = Options(T=0.05, Ts=0.01), Thresholds(0.05, 0.01)
    error = []
    for white in (np.full(16, LEVEL), np.full(16, np.inf, np.float32)):
        quality = Quality(white, 0.0)
        bases, _ = linearize(stack, c, (0, 1, 2), thresholds, options, quality)
        found = np.tensordot(c, bases, 1)
        enough = (stack.images < LEVEL).sum(axis=0) >= 4
        assert enough.mean() > 0.7
        error.append(np.abs(found - ideal)[:, enough])
    assert error[0].max() < 1e-4
    assert np.quantile(error[1], 0.98) > 0.01


def test_the_lights_of_clipped_images_are_found_and_the_share_is_said() -> None:
    stack, ideal, lights = clipped()
    a = analyze(stack)
    assert a.confidence is not None
    share = (stack.images == LEVEL).mean(axis=(1, 2))
    share[share * 720 <= 20] = 0  # too few to be told from a highlight
    np.testing.assert_allclose(a.confidence.saturated, share)
    assert light_error(a.coefficients, lights) < 0.01
    seen = (stack.images < LEVEL) | (share == 0)[:, None, None]
    linearized = np.stack([a.linearized(k) for k in range(16)])
    enough = (a.confidence.lit >= 4) & ~(seen & (stack.images == LEVEL)).any(axis=0)
    assert enough.mean() > 0.6
    assert np.abs(linearized - ideal)[:, enough].max() < 1e-3
    (warning,) = (w for w in a.warnings if "saturated" in w)
    assert warning.startswith(f"{100 * share.mean():.0f} % of the observations are saturated")
    assert "shorten the exposure" in warning
    np.testing.assert_array_equal(a.confidence.lit, seen.sum(axis=0))


@pytest.mark.parametrize(("quantile", "warned"), [(0.92, True), (0.97, False)])
def test_a_stack_is_warned_of_from_5_percent_on(quantile: float, warned: bool) -> None:
    """Shadows count, and no image is accused of not fitting for being cut off."""
    stack = render_scene("sphere_cone", size=(80, 100)).stack
    top = np.float32(np.quantile(stack.images, quantile))
    a = analyze(replace(stack, images=np.minimum(stack.images / top, np.float32(1))))
    assert a.confidence is not None
    assert (a.confidence.saturated.mean() > 0.05) == warned
    assert [w[:42] for w in a.warnings] == ["8 % of the observations are saturated and "] * warned
