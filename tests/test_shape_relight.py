"""Relighting: the images of the stack again, linear in the light, the truth of a scene."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from lambert import lambertian

from photolin import analyze
from photolin.analysis import Analysis
from photolin.errors import OptionError
from photolin.shape.recover import Shape, recover_shape
from photolin.shape.relight import relight
from photolin.shape.resolve import resolve_ambiguity
from photolin.synthetic import render_scene

Light = tuple[float, float, float]


@cache
def matte() -> tuple[Analysis, Shape]:
    """Of a matte relief with known lights: nothing grazes it, its bases are the robust ones."""
    stack, lights = lambertian()
    stack = replace(stack, lights=lights)
    analysis = analyze(stack)
    return analysis, recover_shape(stack, analysis, resolve_ambiguity(analysis), depth=False)


def light(of: np.ndarray) -> Light:
    x, y, z = of.tolist()
    return x, y, z


# Laws


def test_each_light_of_the_stack_gives_its_linearized_image() -> None:
    analysis, shape = matte()
    for k, s in enumerate(shape.lights):
        np.testing.assert_allclose(relight(shape, light(s)), analysis.linearized(k), atol=1e-6)


def test_the_lights_of_an_unknown_stack_give_its_linearized_images_too() -> None:
    """Whatever the matrix is: it cancels out of albedo, normals and lights."""
    stack = render_scene("sphere_cone", size=(48, 64)).stack
    analysis = analyze(stack)
    shape = recover_shape(stack, analysis, resolve_ambiguity(analysis), depth=False)
    there = analysis.determined()
    # where observations near grazing lights give other bases, the images differ
    bases = list(analysis.base_images)
    same = there.copy()
    for k, s in zip(bases, shape.lights[bases], strict=True):
        same &= np.abs(relight(shape, light(s)) - analysis.linearized(k)) < 1e-5
    assert same[there].mean() > 0.5
    for k, s in enumerate(shape.lights):
        found, expected = relight(shape, light(s)), analysis.linearized(k)
        np.testing.assert_allclose(found[same], expected[same], atol=1e-4)


def test_it_is_linear_in_the_light() -> None:
    shape = matte()[1]
    a, b = np.array([0.3, -0.2, 0.9]), np.array([-0.5, 0.1, 0.4])
    both = relight(shape, light(2 * a - 3 * b))
    np.testing.assert_allclose(
        both, 2 * relight(shape, light(a)) - 3 * relight(shape, light(b)), atol=1e-6
    )


def test_a_light_from_behind_is_the_negative_of_that_from_before() -> None:
    shape = matte()[1]
    np.testing.assert_array_equal(relight(shape, (0, 0, -1)), -relight(shape, (0, 0, 1)))


# Truth


def test_a_light_that_no_image_has_shows_albedo_times_cosine() -> None:
    scene = render_scene("sphere_obstacles")
    truth = scene.truth
    stack = replace(scene.stack, lights=truth.lights.astype(float) * truth.power[:, None])
    analysis = analyze(stack)
    shape = recover_shape(stack, analysis, resolve_ambiguity(analysis), depth=False)
    s = np.array([0.2, 0.7, 0.4])
    found = relight(shape, light(s))
    lit = truth.mask & (np.isin(truth.labels, (1, 2)).sum(axis=0) >= 4)
    np.testing.assert_allclose(found[lit], (truth.albedo * (truth.normals @ s))[lit], atol=0.005)
    assert found.dtype == np.float32
    assert found[lit].min() < -0.05  # attached shadow is not clipped
    assert (found[~truth.mask] == 0).all()
    open_there = truth.mask & ~analysis.determined()
    assert open_there.any()
    assert np.isnan(found[open_there]).all()


# Hostile


@pytest.mark.parametrize(
    "wrong",
    [(0, 0, 0), (np.nan, 0, 1), (np.inf, 0, 1), (0, 0, 1e300), (0, 0, 1e-30), (0, 1), (1, 2, 3, 4)],
)
def test_what_is_no_light_is_refused(wrong) -> None:
    with pytest.raises(OptionError, match="x y z of a length from 1e-9 to 1e9 is accepted"):
        relight(matte()[1], wrong)
