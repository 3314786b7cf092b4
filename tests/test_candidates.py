"""The cloud of candidates: the published methods' own, exact without noise, laws, refusals."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lambert import lambertian, wrap

from photolin.analysis import Analysis, Method, Options
from photolin.candidates import SOURCES, Cloud, Source, draw_candidates
from photolin.coefficients import estimate_coefficients
from photolin.errors import Cancelled, DegenerateError, InputError, OptionError
from photolin.factors import Factor, Thresholds, classifiable, classify
from photolin.pipeline import analyze
from photolin.stack import ImageStack
from photolin.synthetic import render_scene

CLEAN, LIGHTS = lambertian()
EXACT = analyze(CLEAN, Options(T=0.02, Ts=0.01, samples=50))
TRUE = LIGHTS @ np.linalg.inv(LIGHTS[list(EXACT.base_images)])
OTHERS = [k for k in range(10) if k not in EXACT.base_images]
SCENE = render_scene("sphere_cone", size=(48, 64), images=8).stack
RESULT = analyze(SCENE, Options(T=0.05, Ts=0.02, samples=100))
IMAGE = next(k for k in range(8) if k not in RESULT.base_images)


def cloud(**question: Any) -> Cloud:
    return draw_candidates(SCENE, RESULT, IMAGE, **({"count": 300} | question))


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("image", OTHERS[:3])
def test_without_noise_every_candidate_and_the_winner_are_the_true_coefficients(
    source: Source, image: int
) -> None:
    found = draw_candidates(CLEAN, EXACT, image, source=source, count=200)
    np.testing.assert_allclose(found.best, TRUE[image], atol=2e-4)
    assert found.inliers.all()
    assert len(found.candidates) == 200
    assert found.support[found.winner] == found.pixels == found.lit == 24 * 30


@pytest.mark.parametrize("image", [*range(8)])
def test_from_base_images_they_are_what_the_published_methods_drew(image: int) -> None:
    def step(method: Method) -> np.ndarray:
        options = replace(RESULT.options, method=method)
        args = (SCENE, RESULT.base_images, RESULT.thresholds, options)
        return estimate_coefficients(*args)[image]

    found = draw_candidates(SCENE, RESULT, image, count=RESULT.options.samples)
    assert image in RESULT.base_images or (found.best == step("classification")).all()
    np.testing.assert_allclose(found.path[-1], step("statistical"), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("source", SOURCES)
def test_support_counts_the_labels_of_each_candidates_image(source: Source) -> None:
    found = cloud(source=source, count=60)
    K = len(SCENE.images)
    if source == "base images":
        bases, pixels = SCENE.images[list(RESULT.base_images)], SCENE.mask
    else:
        bases, pixels = RESULT.linearized_bases, RESULT.determined()
    i, A = SCENE.images.reshape(K, -1)[IMAGE, pixels.ravel()], bases[:, pixels]
    v = found.candidates
    l = v[:, :1] * A[0] + v[:, 1:2] * A[1] + v[:, 2:] * A[2]
    labels = classify(i, l, RESULT.thresholds)
    expected = classifiable(labels).sum(axis=1)
    if source == "linearized bases":
        expected = expected - (labels == Factor.UNDEFINED).sum(axis=1)
    np.testing.assert_array_equal(found.support, expected)
    assert found.winner == expected.argmax()
    assert found.pixels == len(i)
    assert found.lit == (i >= np.float32(RESULT.thresholds.Ts)).sum()


def test_candidates_of_linearized_bases_lie_nearer_to_the_coefficients_of_robust() -> None:
    rough, fine = (cloud(source=source) for source in SOURCES)
    away = [float(np.median(c.distances(RESULT.coefficients[IMAGE]))) for c in (rough, fine)]
    assert away[1] < 0.2 * away[0]
    assert fine.inliers.mean() > 2 * rough.inliers.mean()


@pytest.mark.parametrize("source", SOURCES)
def test_half_the_light_halves_all_candidates_exactly(source: Source) -> None:
    """Exact: a power of two changes no rounding, and with Ts = 0 no pixel turns dark."""
    images = SCENE.images.copy()
    images[IMAGE] /= 2
    question: Any = {"source": source, "count": 100, "thresholds": Thresholds(0.05, 0)}
    one = cloud(**question)
    half = draw_candidates(replace(SCENE, images=images), RESULT, IMAGE, **question)
    np.testing.assert_array_equal(half.candidates, one.candidates / 2)
    np.testing.assert_array_equal(half.support, one.support)
    np.testing.assert_array_equal(half.inliers, one.inliers)
    np.testing.assert_allclose(half.path, one.path / 2)


def test_a_seed_gives_the_same_cloud_on_any_threads_and_another_seed_another() -> None:
    one, again = cloud(threads=1), cloud(threads=2, seed=RESULT.options.seed)
    for name in ("candidates", "support", "inliers", "path", "left", "gram"):
        np.testing.assert_array_equal(getattr(again, name), getattr(one, name), err_msg=name)
    assert again.winner == one.winner
    assert (cloud(seed=1).candidates != one.candidates).any()


def test_the_path_goes_from_the_mean_of_all_to_that_of_the_nearest() -> None:
    found = cloud()
    assert found.left[0] == 300
    assert (np.diff(found.left) < 0).all()
    assert len(found.path) == len(found.left) > 2
    mean = found.candidates.astype(float).mean(axis=0)
    np.testing.assert_allclose(found.path[0], mean, rtol=1e-6)
    away = np.linalg.norm(found.candidates - found.path[0], axis=1)
    near = found.candidates[away <= away.mean()].astype(float)
    assert found.left[1] == len(near)
    np.testing.assert_allclose(found.path[1], near.mean(axis=0), rtol=1e-6)


def test_distances_are_those_of_linearized_images_where_the_image_is_lit() -> None:
    found = cloud(source="linearized bases")
    lit = RESULT.determined() & (SCENE.images[IMAGE] >= np.float32(RESULT.thresholds.Ts))
    bases = RESULT.linearized_bases[:, lit].astype(float)
    best = found.best.astype(float)
    for v in (RESULT.coefficients[IMAGE], best * 1.5, best):
        expected = np.linalg.norm((v - best) @ bases) / np.linalg.norm(best @ bases)
        assert found.distances(v) == pytest.approx(expected, abs=1e-9)
    T = RESULT.thresholds.T
    np.testing.assert_array_equal(found.inliers, found.distances(found.candidates) <= T)
    assert found.inliers[found.winner]


def test_a_cloud_is_read_only() -> None:
    with pytest.raises(ValueError, match="read-only"):
        cloud(count=10).support[0] = 1


def test_support_of_a_large_picture_is_counted_on_some_of_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("photolin.candidates.MOST_PIXELS", 500)
    found = cloud()
    assert found.pixels == 500
    assert found.support.max() <= 500


# --- refusals ---


@pytest.mark.parametrize("source", SOURCES)
def test_an_image_too_dark_is_refused(source: Source) -> None:
    images = SCENE.images.copy()
    images[IMAGE] *= np.float32(0.01)
    with pytest.raises(
        DegenerateError,
        match=rf"image {IMAGE} is lit in fewer than three .* \(i >= Ts = 0.02\).*lower Ts",
    ):
        draw_candidates(replace(SCENE, images=images), RESULT, IMAGE, source=source)


@pytest.mark.parametrize("case", ["flat", "coplanar"])
def test_base_images_that_nothing_tells_apart_are_refused(case: str) -> None:
    stack, _ = lambertian(flat=case == "flat", coplanar=case == "coplanar")
    with pytest.raises(DegenerateError, match="no three pixels tell them apart"):
        draw_candidates(stack, EXACT, 0)


def test_a_result_without_a_determined_pixel_is_refused() -> None:
    nothing = replace(EXACT, linearized_bases=np.full((3, 24, 30), np.nan, np.float32))
    with pytest.raises(DegenerateError, match="lit in fewer than three"):
        draw_candidates(CLEAN, nothing, 0, source="linearized bases")


@pytest.mark.parametrize(
    ("question", "words"),
    [
        ({"image": 8}, "image is 8; accepted is 0 to 7"),
        ({"image": -1}, "image is -1; accepted is 0 to 7"),
        ({"source": "guess"}, "source is 'guess'; accepted are base images, linearized bases"),
        ({"count": 9}, "candidates are 9; accepted is 10 to 100000"),
        ({"count": 100_001}, "candidates are 100001"),
    ],
)
def test_what_cannot_be_asked_is_refused(question: dict[str, Any], words: str) -> None:
    with pytest.raises(OptionError, match=words):
        draw_candidates(SCENE, RESULT, **({"image": 0} | question))


@pytest.mark.parametrize(
    ("stack", "result"),
    [
        (SCENE, EXACT),
        (wrap(CLEAN.images, np.arange(720).reshape(24, 30) > 0), EXACT),
    ],
)
def test_a_result_of_another_stack_is_refused(stack: ImageStack, result: Analysis) -> None:
    with pytest.raises(InputError, match="the analysis of this stack is accepted"):
        draw_candidates(stack, result, 0)


def test_it_can_be_cancelled() -> None:
    with pytest.raises(Cancelled, match="candidates was cancelled"):
        cloud(cancel=lambda: True)
