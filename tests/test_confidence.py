"""What a result rests on: counted right, and doubted where and only where something is wrong."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lambert import lambertian, wrap

from photolin import analyze, render_scene
from photolin.analysis import METHODS, Analysis, Confidence, Method, Options
from photolin.confidence import judge_images
from photolin.errors import PhotolinError
from photolin.factors import Factor, Thresholds
from photolin.stack import ImageStack
from photolin.synthetic import SCENES, Scene
from photolin.synthetic import render as render_module

NOISES: list[dict[str, Any]] = [{}, {"noise": 0.01, "bits": 8}]


def scene(name: str = "sphere_cone", **noise: Any) -> tuple[ImageStack, np.ndarray]:
    """A stack and its lights (K,3)."""
    rendered: Scene = render_scene(name, size=(56, 70), **noise)
    truth = rendered.truth
    return rendered.stack, (truth.lights * truth.power[:, None]).astype(float)


def certain(a: Analysis) -> Confidence:
    assert a.confidence is not None
    return a.confidence


def accused(a: Analysis) -> set[str]:
    """Names of images in the warnings, each with its right number."""
    found = set()
    for warning in a.warnings:
        for k, name in enumerate(a.names):
            if name in warning:
                assert warning.startswith(f"image {k} ({name}) ")
                found.add(name)
    return found


def besides_unlit(a: Analysis) -> list[str]:
    return [w for w in a.warnings if "too few to determine them" not in w]


# What is counted


@pytest.mark.parametrize("method", METHODS)
def test_lit_and_diffuse_images_of_a_pixel_are_counted(method: Method) -> None:
    stack, _ = scene(noise=0.01, bits=8)
    mask = np.random.default_rng(0).random(stack.mask.shape) > 0.3
    a = analyze(replace(stack, mask=mask), Options(method=method, samples=100))
    c, Ts = certain(a), np.float32(a.thresholds.Ts)
    lit = (stack.images >= Ts) & (stack.images < 1)
    np.testing.assert_array_equal(c.lit, lit.sum(axis=0) * mask)
    np.testing.assert_array_equal(c.diffuse, (a.labels == Factor.DIFFUSE).sum(axis=0))
    for image in (c.lit, c.diffuse, c.margin, c.spread):
        assert image.shape == mask.shape
        assert (image[~mask] == 0).all()
    assert (c.margin > 0).any() == (method == "robust")
    assert 0 <= c.spread.min() <= c.spread.max() <= 1.01
    assert all(not array.flags.writeable for array in vars(c).values())


def test_a_pixel_that_all_lights_but_a_plane_of_them_miss_has_no_spread() -> None:
    stack, lights = lambertian(12)
    images = stack.images.copy()
    images[:, 5, 7] = lights @ (0, 0.4, 0.9) * (np.abs(lights[:, 0]) < 0.2)
    a = analyze(wrap(images))
    assert certain(a).spread[5, 7] < 0.25
    assert np.median(certain(a).spread) > 0.99


def test_images_are_judged_by_what_is_impossible() -> None:
    """Darker than the fit by more than T i and three times the noise, or lit facing away."""
    l = np.tile(np.linspace(0.1, 0.8, 1000), (4, 1))
    i = l.astype(np.float32)
    i[1] += np.float32(0.3)  # highlights are possible
    i[2, ::4] *= np.float32(0.7)
    l[3, ::2] = -0.5
    support, residual, gain = judge_images(i, l, Thresholds(0.05, 0.02), 0.001)
    np.testing.assert_allclose(support, [1, 1, 0.75, 0.5])
    assert gain[1] > 1.5
    np.testing.assert_allclose(gain[[0, 2, 3]], 1, atol=1e-6)
    assert residual[0] < 1e-6 < residual[1]


def test_noise_makes_nothing_impossible() -> None:
    rng = np.random.default_rng(0)
    l = np.full((1, 100_000), 0.1)
    i = (l + rng.normal(0, 0.01, l.shape)).astype(np.float32)
    (loose,), _, _ = judge_images(i, l, Thresholds(0.01, 0.02), 0.01)
    (strict,), _, _ = judge_images(i, l, Thresholds(0.01, 0.02), 0.0)
    assert loose > 0.998
    assert strict < 0.6


def test_images_without_lit_pixels_are_not_judged() -> None:
    dark, unknown = np.zeros((1, 5), np.float32), np.full((1, 5), np.nan)
    for i, l in ((dark, dark.astype(float)), (dark + 1, unknown)):
        judged = judge_images(i.astype(np.float32), l, Thresholds(0.05, 0), 0.0)
        assert [float(values[0]) for values in judged] == [1, 0, 1]


@pytest.mark.parametrize("threads", [1, 3])
def test_threads_change_no_bit(threads: int) -> None:
    stack, _ = scene(noise=0.01, bits=8)
    one, other = certain(analyze(stack)), certain(analyze(stack, threads=threads))
    for name, array in vars(one).items():
        np.testing.assert_array_equal(array, vars(other)[name])


# No doubt where nothing is wrong


@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("name", SCENES)
def test_good_stacks_raise_no_doubt(name: str, noise: dict[str, Any], known: bool) -> None:
    """But for the few pixels of `sphere_obstacles` that hardly any light reaches."""
    stack, lights = scene(name, **noise)
    a = analyze(replace(stack, lights=lights) if known else stack)
    assert besides_unlit(a) == []
    assert len(a.warnings) == (name == "sphere_obstacles")
    assert certain(a).support.min() > 0.98
    assert np.abs(certain(a).gain - 1).max() < 0.02


# Images that do not belong


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize(("name", "moved"), [("sphere_cone", 5), ("cup", 0), ("pot", 19)])
def test_a_moved_image_is_named_and_no_other(name: str, noise: dict[str, Any], moved: int) -> None:
    """By 2 pixels of 70; with noise by 5, as the share of impossible pixels has to reach 8 %."""
    stack, _ = scene(name, **noise)
    images = stack.images.copy()
    images[moved] = np.roll(images[moved], 5 if noise else 2, axis=1)
    a = analyze(replace(stack, images=images))
    assert accused(a) == {stack.names[moved]}
    assert any("does not fit the others: " in w and " % of its lit" in w for w in a.warnings)


@pytest.mark.parametrize(("noise", "factor"), [(NOISES[0], 0.88), (NOISES[1], 0.8)])
@pytest.mark.parametrize("name", SCENES)
def test_another_exposure_is_named_where_light_powers_are_known(
    name: str, noise: dict[str, Any], factor: float
) -> None:
    stack, lights = scene(name, **noise)
    images = stack.images.copy()
    images[7] *= np.float32(factor)
    a = analyze(replace(stack, images=images, lights=lights))
    assert accused(a) == {"007.png"}
    assert any(f"is {factor:.2f} times as bright as its light power says" in w for w in a.warnings)
    assert certain(a).gain[7] == pytest.approx(factor, abs=0.02)
    assert accused(analyze(replace(stack, images=images))) == set()


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("name", ["sphere_cone", "pot"])
def test_two_lights_given_in_the_wrong_order_are_named(name: str, noise: dict[str, Any]) -> None:
    stack, lights = scene(name, **noise)
    lights[[3, 11]] = lights[[11, 3]]
    a = analyze(replace(stack, lights=lights))
    assert accused(a) == {"003.png", "011.png"}


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("name", ["cup", "sphere_obstacles"])
def test_lights_shuffled_altogether_are_said_not_to_belong(
    name: str, noise: dict[str, Any]
) -> None:
    """Measured: 16 to 24 % are D then, 80 to 97 % with the right lights."""
    stack, lights = scene(name, **noise)
    shuffled = np.random.default_rng(0).permutation(lights)
    (warning,) = besides_unlit(analyze(replace(stack, lights=shuffled)))
    assert warning.startswith(("only 1", "only 2"))
    assert "% of the lit observations agree" in warning
    assert warning.endswith("belong to these images, not be in their order, or have other powers")


@pytest.mark.parametrize("name", ["pot", "sphere_obstacles"])
def test_images_that_are_cut_off_are_not_said_to_be_darker_than_possible(name: str) -> None:
    stack, _ = scene(name, **NOISES[1])
    top = np.float32(np.quantile(stack.images[:, stack.mask], 0.9))
    cut = replace(stack, images=np.minimum(stack.images / top, np.float32(1)))
    a = analyze(cut)
    assert accused(a) == set()
    assert certain(a).support.min() > 0.97
    assert certain(a).saturated.mean() == pytest.approx(0.1, abs=0.01)
    assert any(w.startswith("10 % of the observations are saturated") for w in a.warnings)


# Pixels without light


def test_unlit_pixels_are_counted() -> None:
    images = lambertian()[0].images.copy()
    images[2:, 3, 4:9] = 0
    a = analyze(wrap(images))
    (warning,) = a.warnings
    assert warning.startswith("5 of 720 pixels are lit in fewer than three images (i >= Ts = ")
    assert (certain(a).lit[3, 4:9] == 2).all()
    assert np.isnan(a.linearized_bases[:, 3, 4:9]).all()


@pytest.mark.parametrize(("share", "warned"), [(0.15, False), (0.3, True)])
def test_many_pixels_lit_in_three_images_are_said_to_be_unchecked(
    share: float, warned: bool
) -> None:
    images = lambertian()[0].images.copy()
    rows = round(24 * share)
    images[3:, :rows] = 0
    a = analyze(wrap(images))
    expected = f"{100 * rows / 24:.0f} % of the pixels are lit in fewer than 4 images"
    assert [w.startswith(expected) for w in a.warnings] == [True] * warned


# Two dimensions only


@pytest.mark.parametrize("count", [8, 24])
@pytest.mark.parametrize("noise", [0.005, 0.02])
@pytest.mark.parametrize("case", ["flat", "coplanar", "good"])
def test_flat_scenes_and_lights_in_a_plane_are_refused_or_warned_whatever_the_noise(
    case: str, noise: float, count: int
) -> None:
    """Measured: two dimensions explain 94 to 99 % there, 35 to 78 % of the good stacks."""
    stack, _ = lambertian(count, (30, 40), flat=case == "flat", coplanar=case == "coplanar")
    noisy = stack.images + np.random.default_rng(0).normal(0, noise, stack.shape)
    try:
        a = analyze(wrap(np.clip(noisy, 0, 1)))
    except PhotolinError:
        assert case != "good"
        return
    found = [w for w in a.warnings if "hardly has three dimensions: two explain 9" in w]
    assert len(found) == (case != "good")
    assert case == "good" or " % of its diffuse observations" in found[0]


@pytest.mark.parametrize("noise", [0, 0.02])
@pytest.mark.parametrize("name", SCENES)
def test_lights_in_a_plane_are_seen_through_highlights_and_shadows(
    name: str, noise: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Measured: two dimensions explain 90 to 99 %; 6 to 65 % where lights are spread."""
    place = render_module.place_lights

    def arc(setup: Any, count: int) -> tuple[np.ndarray, np.ndarray]:
        angle = np.radians(np.linspace(-60, 60, count))
        lights = np.stack((np.sin(angle), 0.3 * np.cos(angle), np.cos(angle)), axis=1)
        return lights / np.linalg.norm(lights, axis=1, keepdims=True), place(setup, count)[1]

    monkeypatch.setattr(render_module, "place_lights", arc)
    stack, _ = scene(name, noise=noise, bits=8 if noise else 16)
    try:
        warnings = analyze(stack).warnings
    except PhotolinError as error:
        assert "lie in one plane" in str(error)
        return
    (warning,) = (w for w in warnings if "hardly has three dimensions: two explain " in w)
    assert float(warning.split("two explain ")[1].split(" %")[0]) >= 88


def test_a_flat_scene_with_known_lights_is_no_matter_of_doubt() -> None:
    stack, lights = lambertian(flat=True)
    noisy = stack.images + np.random.default_rng(0).normal(0, 0.005, stack.shape)
    a = analyze(replace(wrap(np.clip(noisy, 0, 1)), lights=lights))
    assert a.warnings == ()


@pytest.mark.parametrize(("width", "relief"), [(0.3, 1), (0.1, 1), (1, 0.2), (0.2, 0.3)])
def test_narrow_lights_and_shallow_relief_without_noise_raise_no_doubt(
    width: float, relief: float
) -> None:
    """Two dimensions explain nearly all within T, but leave far more than the noise."""
    rng = np.random.default_rng(0)
    lights = rng.uniform(-0.6, 0.6, (12, 3)) * (width, width, 0) + (0, 0, 0.8)
    normals = rng.uniform(-0.5, 0.5, (3, 900)) * [[relief], [relief], [0]] + [[0], [0], [1]]
    assert analyze(wrap((lights @ normals).reshape(12, 30, 30))).warnings == ()


# An ambient level


@pytest.mark.parametrize("name", ["cup", "sphere_obstacles"])
def test_an_ambient_level_is_warned_of_with_its_number_and_the_way_out(name: str) -> None:
    stack, _ = scene(name, ambient=0.02, noise=0.005)
    (warning,) = (w for w in analyze(stack).warnings if "not black" in w)
    number = float(warning.split("not black but ")[1].split(" of full scale")[0])
    assert number == pytest.approx(0.02, abs=0.004)
    assert f"option offset ({number:.4f})" in warning
