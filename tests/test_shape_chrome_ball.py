"""Lights seen in a mirror ball: truth, wide and clipped spots, doubts, every misuse."""

import re

import numpy as np
import pytest

from photolin.errors import InputError
from photolin.shape.chrome_ball import BallLights, estimate_lights
from photolin.shape.directions import angles_between

SHAPE, CENTRE, RADIUS = (150, 160), (72.3, 81.6), 60.0
FINE = 6
"""Parts of a pixel's side that are rendered."""


def sky() -> np.ndarray:
    """(8,3) lights up to 60 degrees from the camera, one straight behind it."""
    tilt, turn = np.radians([0, 15, 25, 35, 45, 50, 55, 60]), np.arange(8) * 2.4
    flat = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn)], axis=1)
    return np.column_stack([flat, np.cos(tilt)])


def mirror(
    lights: np.ndarray, size: float = 3.0, power: float = 0.9, ground: float = 0.04
) -> tuple[np.ndarray, np.ndarray]:
    """Images (K,H,W), clipped at 1, of a mirror ball under round lights of `size` degrees radius,
    and its mask; every pixel is the mean of FINE x FINE points."""
    H, W = SHAPE
    row, column = ((np.arange(n * FINE) + 0.5) / FINE - 0.5 for n in (H, W))
    x, y = (column - CENTRE[1]) / RADIUS, (CENTRE[0] - row[:, None]) / RADIUS
    z2 = 1 - x**2 - y**2
    z = np.sqrt(np.maximum(z2, 0))
    # the reflection of (0, 0, 1), written out
    towards = np.stack([2 * z * x, 2 * z * y, 2 * z**2 - 1])

    def shrink(fine: np.ndarray) -> np.ndarray:
        return fine.reshape(H, FINE, W, FINE).mean(axis=(1, 3))

    cosine = np.cos(np.radians(size))
    images = [
        shrink((power * (np.tensordot(s, towards, 1) > cosine) + ground) * (z2 > 0)) for s in lights
    ]
    return np.minimum(images, 1), shrink(1.0 * (z2 > 0)) > 0.5


def errors(found: BallLights, lights: np.ndarray) -> np.ndarray:
    return angles_between(found.directions, lights)


@pytest.mark.parametrize("size", [1.3, 3.0])
def test_lights_are_found_within_half_a_degree(size: float) -> None:
    """Of spots a pixel wide, too, whose partly covered pixels decide."""
    found = estimate_lights(*mirror(sky(), size))
    assert errors(found, sky()).max() < 0.5
    assert found.directions.shape == (8, 3)
    np.testing.assert_allclose(np.linalg.norm(found.directions, axis=1), 1)
    assert found.doubts == ("",) * 8
    np.testing.assert_array_equal(found.found, np.arange(8))
    np.testing.assert_allclose(found.centre, CENTRE, atol=0.1)
    assert found.radius == pytest.approx(RADIUS, abs=0.1)


def test_x_is_right_y_up_and_the_spot_lies_half_way_to_the_light() -> None:
    lights = np.array([[0.8, 0, 0.6], [0, 0.8, 0.6]])
    found = estimate_lights(*mirror(lights))
    assert errors(found, lights).max() < 0.5
    half = RADIUS * np.sin(np.arccos(0.6) / 2)
    expected = [[CENTRE[0], CENTRE[1] + half], [CENTRE[0] - half, CENTRE[1]]]
    np.testing.assert_allclose(found.spots, expected, atol=0.3)


@pytest.mark.parametrize("size", [8.0, 15.0])
def test_wide_clipped_spots_have_their_middle_in_the_light_s(size: float) -> None:
    """Near the rim a spot is squeezed; the mean of its pixels would be degrees off."""
    images, mask = mirror(sky(), size, power=1.5)
    assert (images == 1).any(axis=(1, 2)).all()
    found = estimate_lights(images, mask)
    assert errors(found, sky()).max() < 0.5
    assert found.doubts == ("",) * 8


def test_noise_and_a_sloping_background_hardly_matter() -> None:
    images, mask = mirror(sky())
    slope = np.linspace(0, 0.1, SHAPE[1])
    noisy = np.clip(images + slope + np.random.default_rng(0).normal(0, 0.01, images.shape), 0, 1)
    assert errors(estimate_lights(noisy, mask), sky()).max() < 0.6


def test_what_is_bright_outside_the_ball_does_not_matter() -> None:
    images, mask = mirror(sky())
    expected = estimate_lights(images, mask).directions
    images[:, ~mask] = 1
    np.testing.assert_array_equal(estimate_lights(images, mask).directions, expected)


def test_images_are_seen_one_by_one_and_their_exposure_does_not_matter() -> None:
    images, mask = mirror(sky())
    found = estimate_lights(images, mask).directions
    order = [3, 1, 7]
    np.testing.assert_array_equal(estimate_lights(images[order], mask).directions, found[order])
    np.testing.assert_allclose(estimate_lights(images / 2, mask).directions, found, atol=1e-9)


def test_no_spot_is_doubted_and_the_others_are_found() -> None:
    images, mask = mirror(sky())
    images[2] = 0.04 * mask
    found = estimate_lights(images, mask)
    assert np.isnan(found.directions[2]).all()
    assert np.isnan(found.spots[2]).all()
    assert "no spot: nothing on the ball is brighter than the rest by 0.1" in found.doubts[2]
    assert [bool(doubt) for doubt in found.doubts] == [k == 2 for k in range(8)]
    assert found.found.tolist() == [0, 1, 3, 4, 5, 6, 7]


def test_several_spots_are_doubted_and_the_one_with_most_light_is_taken() -> None:
    images, mask = mirror(sky()[:3])
    faint, _ = mirror(sky()[5:], power=0.5)
    both = np.maximum(images, faint)
    found = estimate_lights(both, mask)
    assert errors(found, sky()[:3]).max() < 0.5
    assert set(found.doubts) == {"2 spots of similar light; the one with most is taken"}
    weaker, _ = mirror(sky()[5:], size=1.0, power=0.5)
    assert estimate_lights(np.maximum(images, weaker), mask).doubts == ("",) * 3


def test_a_spot_as_large_as_a_window_is_doubted() -> None:
    found = estimate_lights(*mirror(sky()[:2], size=60))
    assert all(re.search("the spot covers 2[456] % of the ball", doubt) for doubt in found.doubts)


def test_masks_that_are_no_ball_are_refused() -> None:
    images, mask = mirror(sky()[:1])
    box = np.zeros(SHAPE, bool)
    box[20:80, 30:140] = True
    for wrong in (box, mask & (np.arange(SHAPE[1]) > 70), mask ^ np.roll(mask, 12, 0)):
        with pytest.raises(
            InputError, match=r"the ball's mask is no disk: .* whole outline of one"
        ):
            estimate_lights(images, wrong)
    with pytest.raises(InputError, match=r"mask has 0 pixels, a radius of 0.0; .* at least 6"):
        estimate_lights(images, mask & False)
    with pytest.raises(InputError, match=r"mask of shape \(150, 159\); \(K,H,W\)"):
        estimate_lights(images, mask[:, 1:])
    with pytest.raises(InputError, match=r"images of shape \(150, 160\)"):
        estimate_lights(images[0], mask)


def test_a_mask_a_little_too_large_or_ragged_is_accepted() -> None:
    images, mask = mirror(sky())
    ragged = mask.copy()
    ragged[:, ::5] &= np.roll(mask, 2, 0)[:, ::5]
    ragged[100:105, 100:105] = False
    images[:, mask & ~ragged] = 1
    assert errors(estimate_lights(images, ragged), sky()).max() < 1.5


def test_a_ball_that_mirrors_nothing_is_refused() -> None:
    images, mask = mirror(sky())
    with pytest.raises(InputError, match="none of 8 images shows a bright spot on the ball at row"):
        estimate_lights(images * 0.1, mask)


def test_a_slightly_oval_mask_is_accepted() -> None:
    images, _ = mirror(sky())
    row, column = np.indices(SHAPE)
    oval = np.hypot((row - CENTRE[0]) / 0.95, column - CENTRE[1]) < RADIUS
    assert errors(estimate_lights(images, oval), sky()).max() < 10


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_images_that_are_not_finite_on_the_ball_are_refused(value: float) -> None:
    images, mask = mirror(sky()[:3])
    images[:, 0, 0] = value
    estimate_lights(images, mask)
    images[1, 70, 80] = value
    with pytest.raises(InputError, match="image 1 of the ball holds NaN or infinity"):
        estimate_lights(images, mask)


def test_it_is_read_only() -> None:
    found = estimate_lights(*mirror(sky()[:1]))
    with pytest.raises(ValueError, match="read-only"):
        found.directions[0] = 0
