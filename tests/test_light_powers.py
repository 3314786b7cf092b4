"""Powers of known lights that are not those of the images: noticed, and nothing else is."""

from dataclasses import replace

import numpy as np
import pytest

from photolin import ImageStack, analyze
from photolin.light_powers import doubt_powers, is_uneven
from photolin.synthetic import render_scene

SIZE = {"sphere_cone": (60, 80), "cup": (64, 64), "pot": (64, 64), "sphere_obstacles": (60, 80)}
CHANGES = 1 + 0.2 * np.random.default_rng(0).uniform(-1, 1, 24)


def scene(name: str, powers: np.ndarray, noise: float = 0.0) -> tuple[ImageStack, np.ndarray]:
    """A stack under lights of these powers, and their directions."""
    rendered = render_scene(name, size=SIZE[name], noise=noise, bits=8 if noise else 16)
    truth = rendered.truth
    change = (0.65 * powers[: len(truth.power)] / truth.power)[:, None, None]
    images = np.clip(rendered.stack.images * change, 0, 1).astype(np.float32)
    return replace(rendered.stack, images=images), truth.lights.astype(float)


def accused(stack: ImageStack, lights: np.ndarray) -> list[str]:
    found = analyze(replace(stack, lights=lights)).warnings
    return [warning for warning in found if warning.startswith("the light powers given")]


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("name", SIZE)
def test_directions_alone_for_lights_of_other_powers_are_named_with_their_number(
    name: str, noise: float
) -> None:
    stack, directions = scene(name, CHANGES, noise)
    (said,) = accused(stack, directions)
    assert said.startswith("the light powers given, which are all equal, are not those of the")
    powers = CHANGES[: len(directions)] / np.median(CHANGES[: len(directions)])
    worst = int(np.abs(np.log(powers)).argmax())
    ratio = float(said.split(f" in image {worst} (")[0].split()[-1])
    assert ratio == pytest.approx(powers[worst], abs=0.03)
    assert said.endswith("let photolin shape STACK OUT --powers unknown find the powers")


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("name", SIZE)
def test_right_powers_are_not_doubted(name: str, noise: float) -> None:
    stack, directions = scene(name, np.ones(24), noise)
    assert accused(stack, directions) == []
    stack, directions = scene(name, CHANGES, noise)
    assert accused(stack, directions * CHANGES[: len(directions), None]) == []


def test_wrong_lengths_are_named_too() -> None:
    stack, directions = scene("pot", np.ones(24))
    (said,) = accused(stack, directions * CHANGES[:, None])
    assert said.startswith("the light powers given are not those of the images")


def test_lights_of_other_images_are_no_matter_of_powers() -> None:
    stack, directions = scene("pot", CHANGES)
    assert accused(stack, np.random.default_rng(0).permutation(directions)) == []


def test_directions_that_determine_nothing_are_not_judged() -> None:
    coefficients = np.random.default_rng(0).normal(size=(6, 3))
    names = tuple("abcdef")
    assert doubt_powers(np.eye(3)[[0, 1, 0, 1, 0, 1]], names, coefficients) == []


def test_exposures_vary_from_two_percent_on() -> None:
    sides = np.array([-1, 1] * 10)
    assert not is_uneven(1 + 0.015 * sides)
    assert is_uneven(1 + 0.04 * sides)
    assert not is_uneven(np.full(20, 7.0))
