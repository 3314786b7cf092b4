"""ImageStack: what it accepts, what it refuses and how, and that it cannot be changed."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from photolin.errors import DegenerateError, InputError, PhotolinError
from photolin.stack import ImageStack


def images(count: int = 6) -> np.ndarray:
    return np.random.default_rng(0).uniform(0.1, 0.9, (count, 4, 5)).astype(np.float32)


def stack(count: int = 6) -> ImageStack:
    names = tuple(f"{k}.png" for k in range(count))
    return ImageStack(images(count), np.ones((4, 5), bool), names, title="bench")


def lights() -> np.ndarray:
    return np.random.default_rng(1).normal(size=(6, 3))


# Laws


def test_pixels_are_the_flat_indices_of_the_mask_in_order() -> None:
    mask = np.zeros((4, 5), bool)
    mask[[0, 3, 2], [4, 1, 2]] = True
    s = replace(stack(), mask=mask)
    np.testing.assert_array_equal(s.pixels, [4, 12, 16])
    np.testing.assert_array_equal(s.pick(np.array([2, 0])), [16, 4])
    np.testing.assert_array_equal(stack().pick(np.array([7, 3])), [7, 3])
    assert s.shape == (6, 4, 5)


def test_nothing_of_a_stack_can_be_changed() -> None:
    s = replace(stack(), lights=lights())
    for array in (s.images, s.mask, s.lights):
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(FrozenInstanceError):
        s.title = "other"  # pyright: ignore[reportAttributeAccessIssue]


def test_the_ends_of_the_range_are_accepted() -> None:
    x = images()
    x[0, 0, 0], x[0, 0, 1] = 0, 1
    assert replace(stack(), images=x).images[0, 0, 1] == 1


# Refusals


def broken(change: str) -> ImageStack:  # noqa: PLR0911
    """A stack that is wrong in one way."""
    s, x = stack(), images()
    match change:
        case "float64":
            return replace(s, images=x.astype(np.float64))
        case "one image":
            return replace(s, images=x[0])
        case "five":
            return replace(s, images=x[:5], names=s.names[:5])
        case "no image":
            return replace(s, images=x[:0], names=())
        case "mask of another size":
            return replace(s, mask=np.ones((5, 4), bool))
        case "mask of numbers":
            return replace(s, mask=np.ones((4, 5), np.uint8))  # type: ignore[arg-type]
        case "empty mask":
            return replace(s, mask=np.zeros((4, 5), bool))
        case "names":
            return replace(s, names=s.names[:5])
        case "lights":
            return replace(s, lights=lights()[:5])
        case "flat lights":
            return replace(s, lights=np.ones(6))
    x[3, 2, 1] = {"nan": np.nan, "inf": np.inf, "-inf": -np.inf, "below": -0.1, "above": 1.5}.get(
        change, 0
    )
    if change == "black":
        x[3] = 0
    return replace(s, images=x)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("float64", r"float64 of shape .* float32 of shape \(images, rows, columns\) is accepted"),
        ("one image", r"of shape \(4, 5\)"),
        ("five", r"5 images; at least 6 are needed"),
        ("no image", r"0 images; at least 6 are needed"),
        ("mask of another size", r"the mask is 5 x 4 \(rows x columns\), the images are 4 x 5"),
        ("mask of numbers", r"a mask of the images' size is accepted"),
        ("empty mask", r"the mask is empty; mark the object's pixels"),
        ("names", r"5 names for 6 images"),
        ("lights", r"5 lights for 6 images; one line of x y z for each image"),
        ("flat lights", r"one line of x y z for each image"),
        ("nan", r"image 3 holds NaN or infinity"),
        ("inf", r"image 3 holds NaN or infinity"),
        ("-inf", r"image 3 holds NaN or infinity"),
        ("below", r"image 3 spans -0.1 to .*0 to 1, are accepted"),
        ("above", r"image 3 spans .* to 1.5; fractions of full scale"),
        ("black", r"image 3 is all black; take it out or replace it"),
    ],
)
def test_what_is_no_stack_is_refused_with_its_name(change: str, words: str) -> None:
    with pytest.raises(InputError, match=f"^bench: .*{words}"):
        broken(change)


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
def test_a_light_without_a_direction_is_refused(value: float) -> None:
    s = lights()
    s[2] = value
    with pytest.raises(InputError, match="bench: a light is zero or not finite"):
        replace(stack(), lights=s)


@pytest.mark.parametrize("power", [1.0, 1e-6, 1e6])
def test_lights_in_one_plane_are_refused_whatever_their_power(power: float) -> None:
    s = lights()
    s[:, 1] = 2 * s[:, 0] - s[:, 2]
    with pytest.raises(DegenerateError, match="the lights lie in one plane"):
        replace(stack(), lights=s * power)
    replace(stack(), lights=lights() * power)


def test_every_refusal_is_one_sentence_of_the_users() -> None:
    with pytest.raises(PhotolinError) as caught:
        broken("five")
    assert "\n" not in str(caught.value)
