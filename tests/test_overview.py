"""The overview: it finds what was done to an image, and nothing where nothing was."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lambert import lambertian, wrap
from scipy.ndimage import shift as move

from photolin.analysis import Analysis, Options
from photolin.errors import Cancelled, InputError, OptionError
from photolin.factors import OUTSIDE, Factor
from photolin.overview import count_classes, find_copies, measure_shift, review_images
from photolin.pipeline import analyze
from photolin.stack import ImageStack
from photolin.synthetic import render_scene

Array = np.ndarray
STACK = render_scene("pot", size=(96, 128), images=16, noise=0.002).stack
NAN = float("nan")


def changed(k: int, image: Array, lights: Array | None = None) -> ImageStack:
    images = STACK.images.copy()
    images[k] = image
    return replace(STACK, images=images.clip(0, 1).astype(np.float32), lights=lights)


def findings(stack: ImageStack, analysis: Analysis | None = None) -> dict[int, tuple[str, ...]]:
    reviews = review_images(stack, analysis or analyze(stack, Options(T=0.03, Ts=0.01)))
    return {k: review.findings for k, review in enumerate(reviews) if review.findings}


RESULT = analyze(STACK, Options(T=0.03, Ts=0.01))


# Per image


def test_nothing_stands_out_where_nothing_was_done() -> None:
    assert findings(STACK, RESULT) == {}
    for k, review in enumerate(review_images(STACK, RESULT)):
        inside = RESULT.labels[k][STACK.mask]
        assert review.shares.tolist() == [(inside == f).mean() for f in sorted(Factor)]
        assert review.name == STACK.names[k]
        assert RESULT.confidence is not None
        assert review.support == RESULT.confidence.support[k]
        assert review.gain == RESULT.confidence.gain[k]
        assert review.saturated == RESULT.confidence.saturated[k]
        assert review.residual == RESULT.confidence.residual[k]
        assert review.copy_of is None


@pytest.mark.parametrize(
    ("down", "right", "words"),
    [
        (2, -1, "2.0 px below and 1.0 px left"),
        (-3, 2, "3.0 px above and 2.0 px right"),
    ],
)
def test_a_moved_image_is_told_with_its_direction(down: int, right: int, words: str) -> None:
    stack = changed(3, np.roll(STACK.images[3], (down, right), (0, 1)))
    found = findings(stack)
    assert any(words in sentence for sentence in found[3])
    assert [k for k, told in found.items() if any(" px " in s for s in told)] == [3]
    assert found[3][-1].startswith("image 3 (") or found[3][0].startswith("image 3 (")


def test_a_small_movement_is_measured_and_not_told() -> None:
    stack = changed(3, move(STACK.images[3], (0.4, 0), order=1, mode="nearest"))
    reviews = review_images(stack, analyze(stack, Options(T=0.03, Ts=0.01)))
    shift = reviews[3].shift
    assert shift is not None
    assert not shift.sure
    assert shift.rows == pytest.approx(0.4, abs=0.25)


def test_copies_are_told_once_with_the_one_they_repeat() -> None:
    same = changed(5, STACK.images[2])
    assert any("is the same as image 2 (" in s for s in findings(same)[5])
    assert 2 not in findings(same)
    noise = np.random.default_rng(0).normal(0, 5e-4, STACK.shape[1:])
    dimmer = changed(5, 0.8 * STACK.images[2] + noise)
    assert any(
        "nearly the light of image 2 (" in s and "0.80 times" in s for s in findings(dimmer)[5]
    )
    assert review_images(dimmer, RESULT)[5].copy_of == 2


def test_one_differing_pixel_makes_no_same_image() -> None:
    image = STACK.images[2].copy()
    image[tuple(np.argwhere(STACK.mask)[1])] += 0.01
    copy = find_copies(changed(5, image))[5]
    assert copy == (2, pytest.approx(1, abs=1e-3))
    assert find_copies(STACK) == {}


def test_neighbouring_lights_are_no_copies() -> None:
    """4 degrees apart, all lit, which is the hardest; shadows tell nearer ones."""
    stack, lights = lambertian(8, (40, 40))
    turned = lights[0] + [0.07 * np.linalg.norm(lights[0]), 0, 0]
    bases = np.linalg.lstsq(lights, stack.images.reshape(8, -1), rcond=None)[0]
    images = stack.images.copy()
    images[7] = (turned @ bases).reshape(40, 40)
    assert 7 not in find_copies(wrap(images))


def test_what_confidence_doubts_is_not_said_twice() -> None:
    """Known lights, one image brighter than its power says: in the words of confidence."""
    scene = render_scene("pot", size=(96, 128), images=16)
    lights = (scene.truth.lights * scene.truth.power[:, None]).astype(np.float64)
    stack = replace(scene.stack, images=scene.stack.images * np.float32(0.6), lights=lights)
    images = stack.images.copy()
    images[4] *= 1.3
    stack = replace(stack, images=images)
    result = analyze(stack, Options(T=0.03, Ts=0.01))
    told = findings(stack, result)[4]
    about = [s for s in told if "times as bright" in s]
    assert len(about) == 1
    assert about[0] in result.warnings


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("saturated", 0.31, "31 % of image 6"),
        ("residual", 0.4, "is 40 % of i from its linearization"),
        ("gain", 1.5, "is 1.50 times as bright as its linearization"),
        ("gain", 0.7, "is 0.70 times as bright as its linearization"),
        ("support", 0.5, "does not fit the others: 50 %"),
    ],
)
def test_values_far_from_the_others_are_told(field: str, value: float, words: str) -> None:
    confidence = RESULT.confidence
    assert confidence is not None
    values = np.full_like(getattr(confidence, field), 1.0 if field in ("gain", "support") else 0)
    values[6] = value
    given: dict[str, Any] = {field: values}
    found = findings(STACK, replace(RESULT, confidence=replace(confidence, **given)))
    assert list(found) == [6]
    assert any(words in sentence for sentence in found[6])
    # where all are so, none stands out, but for saturation
    given = {field: np.full_like(values, value)}
    found = findings(STACK, replace(RESULT, confidence=replace(confidence, **given)))
    assert len(found) == (16 if field == "saturated" else 0)


@pytest.mark.parametrize("field", ["gain", "residual"])
def test_where_all_images_scatter_none_stands_out(field: str) -> None:
    confidence = RESULT.confidence
    assert confidence is not None
    given: dict[str, Any] = {field: np.linspace(0.7, 1.3, 16)}
    assert findings(STACK, replace(RESULT, confidence=replace(confidence, **given))) == {}


def test_image_1_does_not_get_the_words_on_image_11() -> None:
    confidence = RESULT.confidence
    assert confidence is not None
    support = np.ones(16)
    support[11] = 0.2
    stack = replace(STACK, names=tuple("a" for _ in STACK.names))
    result = replace(RESULT, confidence=replace(confidence, support=support))
    assert list(findings(stack, result)) == [11]


# Per pixel


def test_classes_are_counted_pixel_by_pixel() -> None:
    labels = np.random.default_rng(0).choice([0, 1, 2, 3, 4], (7, 5, 6)).astype(np.uint8)
    labels[:, 0, 0] = OUTSIDE
    for factors in [(Factor.SPECULAR,), (Factor.DIFFUSE, Factor.SPECULAR), tuple(Factor)]:
        count = count_classes(labels, *factors)
        np.testing.assert_array_equal(count, np.isin(labels, factors).sum(axis=0))
        assert count.dtype == np.uint16
        assert count[0, 0] == 0
    many = np.full((300, 1, 1), Factor.CAST, np.uint8)
    assert count_classes(many, Factor.CAST) == 300


@pytest.mark.parametrize("factors", [(), (7,), (255,), (Factor.CAST, 9)])
def test_what_is_no_class_is_not_counted(factors: tuple[Any, ...]) -> None:
    with pytest.raises(OptionError, match=r"accepted are one or more of 0, 1, 2, 3, 4"):
        count_classes(RESULT.labels, *factors)


# Degenerate and hostile


def test_a_result_without_confidence_still_has_an_overview() -> None:
    (first, *_) = review_images(STACK, replace(RESULT, confidence=None))
    assert np.isnan([first.saturated, first.support, first.residual, first.gain]).all()
    assert first.shares.sum() == pytest.approx(1)


def test_one_pixel_black_inside_and_unknown_bases_are_reviewed() -> None:
    mask = np.zeros(STACK.mask.shape, bool)
    mask[40, 60] = True
    images = STACK.images.copy()
    images[2, 40, 60] = 0
    one = replace(STACK, images=images, mask=mask)
    labels = np.where(mask, RESULT.labels, np.uint8(OUTSIDE))
    nothing = np.where(mask, np.float32(NAN), np.float32(0)).repeat(3).reshape(*mask.shape, 3)
    result = replace(
        RESULT, labels=labels, mask=mask, linearized_bases=np.moveaxis(nothing, 2, 0).copy()
    )
    for review in review_images(one, replace(result, confidence=None)):
        assert review.shift is None
        assert review.findings == ()


def test_nothing_tells_a_shift_in_a_flat_or_a_black_image() -> None:
    mask, flat = np.ones((40, 50), bool), np.full((40, 50), 0.5, np.float32)
    black = np.zeros_like(flat)
    texture = np.random.default_rng(0).random((40, 50), np.float32)
    for image, linearized in [(black, texture), (texture, -texture), (black, black)]:
        assert measure_shift(image, linearized, mask) is None
    far = np.roll(texture, 15, axis=0)
    assert measure_shift(far, texture, mask) is None
    for image, linearized in [(flat, flat), (texture, texture), (flat, texture)]:
        shift = measure_shift(image, linearized, mask)
        assert shift is None or not shift.sure


def test_a_shift_between_pictures_of_different_things_is_not_sure() -> None:
    rng, mask = np.random.default_rng(0), np.ones((128, 128), bool)
    pairs = [[rng.random((128, 128), np.float32) for _ in range(2)] for _ in range(40)]
    shifts = [measure_shift(one, other, mask) for one, other in pairs]
    assert max(abs(shift.rows) for shift in shifts if shift is not None) > 2
    assert not any(shift.sure for shift in shifts if shift is not None)


def test_outside_the_mask_nothing_counts() -> None:
    images = np.roll(STACK.images, 2, axis=1)
    here, mask = images.copy(), STACK.mask.copy()
    mask[:, 100:] = False
    images[:, ~mask] = np.random.default_rng(0).random((16, int((~mask).sum())))
    a = [measure_shift(x[3], RESULT.linearized(3), mask) for x in (images, here)]
    assert a[0] is not None
    assert a[0] == a[1]
    assert a[0].left < 1
    assert find_copies(replace(STACK, images=images, mask=mask)) == {}


def test_what_belongs_to_another_stack_is_refused() -> None:
    with pytest.raises(InputError, match=r"labels have shape \(16, 96, 128\), the stack \(10, 24"):
        review_images(lambertian()[0], RESULT)


def test_it_tells_progress_and_can_be_cancelled() -> None:
    told: list[float] = []
    review_images(STACK, RESULT, progress=lambda _, fraction: told.append(fraction))
    assert told == pytest.approx(np.arange(1, 17) / 16)
    with pytest.raises(Cancelled, match="the overview was cancelled"):
        review_images(STACK, RESULT, cancel=lambda: True)
