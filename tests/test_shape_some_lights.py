"""The ambiguity from known lights of some images."""

import numpy as np
import pytest
from lambert import lambertian

from photolin.coefficients import relate_to_bases
from photolin.errors import DegenerateError, InputError
from photolin.shape.directions import angles_between, normalize
from photolin.shape.some_lights import resolve_from_lights

BASES = (0, 6, 9)


def known() -> tuple[np.ndarray, np.ndarray]:
    """Coefficients and lights of ten images; powers between 0.8 and 1."""
    _, lights = lambertian()
    return relate_to_bases(lights, BASES), lights


@pytest.mark.parametrize("images", [(2, 3, 5), (2, 5, 6, 9), range(10), (9, 0, 5, 2)])
def test_lights_with_powers_give_all_lights_and_the_scale(images) -> None:
    coefficients, lights = known()
    resolved = resolve_from_lights(coefficients, images, lights[list(images)], powers=True)
    np.testing.assert_allclose(resolved.lights(coefficients), lights, atol=1e-9)
    np.testing.assert_allclose(resolved.matrix, np.linalg.inv(lights[list(BASES)]), atol=1e-9)
    assert resolved.scaled
    assert resolved.residual < 1e-5


@pytest.mark.parametrize("images", [(2, 3, 5, 1), (2, 5, 6, 9, 0), range(10)])
def test_directions_alone_give_all_directions_and_relative_powers(images) -> None:
    coefficients, lights = known()
    lengths = np.random.default_rng(0).uniform(0.1, 9, (len(images), 1))
    given = lights[list(images)] * lengths
    resolved = resolve_from_lights(coefficients, images, given, powers=False)
    found = resolved.lights(coefficients)
    assert angles_between(found, lights).max() < 1e-4
    ratio = np.linalg.norm(found, axis=1) / np.linalg.norm(lights, axis=1)
    np.testing.assert_allclose(ratio, ratio.mean(), rtol=1e-6)
    assert np.linalg.norm(found[list(BASES)], axis=1).mean() == pytest.approx(1)
    assert not resolved.scaled


def test_where_only_directions_count_lengths_do_not() -> None:
    coefficients, lights = known()
    rng = np.random.default_rng(0)
    noisy = lights + rng.normal(0, 0.03, lights.shape)
    first, other = (
        resolve_from_lights(coefficients, range(10), noisy * lengths, powers=False).matrix
        for lengths in (1, rng.uniform(0.1, 9, (10, 1)))
    )
    np.testing.assert_allclose(other, first, rtol=1e-3)


def test_the_kind_tells_whether_all_lights_were_known() -> None:
    coefficients, lights = known()
    some = resolve_from_lights(coefficients, [1, 4, 8, 2], lights[[1, 4, 8, 2]], powers=True)
    every = resolve_from_lights(coefficients, range(10), lights, powers=True)
    assert (some.kind, every.kind) == ("some lights", "lights")
    assert some.note.startswith("resolved by the lights of 4 of 10 images")


def test_so_few_that_nothing_checks_them_are_called_that() -> None:
    coefficients, lights = known()
    order = [3, 6, 0, 5, 9, 2]
    for count, powers in ((3, True), (4, False)):
        start = order[:count]
        few = resolve_from_lights(coefficients, start, lights[start], powers=powers)
        more = resolve_from_lights(coefficients, order, lights[order], powers=powers)
        assert "one more would check them" in few.note
        assert "one more" not in more.note


@pytest.mark.parametrize("powers", [True, False])
def test_a_light_that_is_off_is_the_worst_and_named(powers: bool) -> None:
    coefficients, lights = known()
    given = lights.copy()
    given[6] = given[6] @ [[1, 0, 0.4], [0, 1, 0], [-0.4, 0, 1]]
    resolved = resolve_from_lights(coefficients, range(10), given, powers=powers)
    assert resolved.residuals is not None
    assert resolved.residuals.argmax() == 6
    assert resolved.residual == pytest.approx(np.sqrt(np.mean(resolved.residuals**2)))
    assert f"worst {resolved.residuals[6]:.2f} degrees in image 6" in resolved.note


@pytest.mark.parametrize("powers", [True, False])
def test_the_order_of_the_images_does_not_matter(powers: bool) -> None:
    coefficients, lights = known()
    images = np.array([1, 5, 3, 2, 9])
    given = lights[images] + np.random.default_rng(0).normal(0, 0.02, (5, 3))
    order = np.array([3, 0, 4, 2, 1])
    first = resolve_from_lights(coefficients, images, given, powers=powers)
    other = resolve_from_lights(coefficients, images[order], given[order], powers=powers)
    np.testing.assert_allclose(other.matrix, first.matrix, rtol=1e-4)


@pytest.mark.parametrize(
    ("images", "powers", "words"),
    [
        ([0, 1], True, "2 known lights with power; at least 3"),
        ([0, 1, 2], False, "3 known light directions; at least 4"),
        ([0, 1, 10, 2], True, "10 is not in the stack; different numbers from 0 to 9"),
        ([0, 1, -1, 2], True, "-1 is not in the stack"),
        ([0, 1, 2.5], True, "2.5]; whole numbers are accepted"),
        ([0, 1, 1, 2], True, "one is given twice"),
    ],
)
def test_images_that_cannot_be_used_are_refused(images, powers: bool, words: str) -> None:
    coefficients, lights = known()
    given = lights[np.clip(images, 0, 9).astype(int)]
    with pytest.raises(InputError, match=words):
        resolve_from_lights(coefficients, images, given, powers=powers)


@pytest.mark.parametrize("value", [0, np.nan, np.inf, 1e-200, 1e200])
def test_a_light_that_is_no_direction_is_refused(value: float) -> None:
    coefficients, lights = known()
    given = lights[:5].copy()
    given[3] = value
    with pytest.raises(InputError, match="light of image 3 is zero or not finite"):
        resolve_from_lights(coefficients, range(5), given, powers=True)
    with pytest.raises(InputError, match=r"shape \(4, 3\) for 5 images"):
        resolve_from_lights(coefficients, range(5), given[:4], powers=True)


@pytest.mark.parametrize("powers", [True, False])
def test_lights_in_a_plane_leave_it_open(powers: bool) -> None:
    coefficients, lights = known()
    flat = normalize(lights * (1, 0.005, 1))
    with pytest.raises(DegenerateError, match=r"the lights of the 10 images .* in one plane"):
        resolve_from_lights(coefficients, range(10), flat, powers=powers)
    with pytest.raises(DegenerateError, match="the coefficients of the 10 images"):
        resolve_from_lights(coefficients * (1, 1, 0), range(10), lights, powers=powers)
