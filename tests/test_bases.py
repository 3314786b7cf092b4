"""The choice of base images: what the determinant means, what is preferred, what is refused."""

from itertools import combinations

import numpy as np
import pytest
from lambert import lambertian, wrap

from photolin.bases import choose_bases, draw_triples, gram_determinants, score_triples
from photolin.errors import DegenerateError
from photolin.sample import Sample, draw_sample


def sample(images: np.ndarray) -> Sample:
    return draw_sample(wrap(images), 0)


def test_the_gram_determinant_is_the_squared_volume_of_the_unit_vectors() -> None:
    v = np.random.default_rng(0).normal(size=(50, 3, 3))
    unit = v / np.linalg.norm(v, axis=2, keepdims=True)
    expected = np.linalg.det(unit) ** 2
    np.testing.assert_allclose(gram_determinants(v @ v.transpose(0, 2, 1)), expected, atol=1e-12)
    np.testing.assert_allclose(
        gram_determinants(1e6 * v @ v.transpose(0, 2, 1)), expected, atol=1e-12
    )


def test_vectors_in_a_plane_or_of_no_length_have_no_volume() -> None:
    v = np.array([[[1.0, 2, 3], [2, 4, 6], [0, 1, 0]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    assert gram_determinants(v @ v.transpose(0, 2, 1)) == pytest.approx([0, 0], abs=1e-12)


def test_few_images_give_all_triples_and_many_a_random_choice() -> None:
    rng = np.random.default_rng(0)
    np.testing.assert_array_equal(draw_triples(7, 35, rng), list(combinations(range(7), 3)))
    drawn = draw_triples(60, 500, rng)
    assert drawn.shape == (500, 3)
    assert (np.diff(drawn, axis=1) > 0).all()
    assert (drawn.min(), drawn.max()) == (0, 59)


def test_known_lights_that_stand_at_right_angles_are_chosen() -> None:
    stack, _ = lambertian(8)
    lights = np.tile([0.1, 0.1, 1.0], (8, 1)) + np.arange(8)[:, None] * [0.01, 0.02, 0]
    lights[[2, 5, 7]] = np.eye(3)
    assert choose_bases(draw_sample(stack, 0), 0.01, 0, lights) == [(2, 5, 7)]


def test_the_choice_from_images_alone_is_nearly_the_best_by_their_lights() -> None:
    stack, lights = lambertian(12)
    unit = lights / np.linalg.norm(lights, axis=1, keepdims=True)
    (chosen,) = choose_bases(draw_sample(stack, 0), 0.01, 0)
    volumes = [abs(np.linalg.det(unit[list(t)])) for t in combinations(range(12), 3)]
    assert abs(np.linalg.det(unit[list(chosen)])) > 0.7 * max(volumes)


def test_images_that_are_hardly_lit_are_not_chosen() -> None:
    stack, _ = lambertian(9)
    images = stack.images.copy()
    images[:3, 2:] = 0
    (chosen,) = choose_bases(sample(images), 0.01, 0)
    assert min(chosen) >= 3


def test_highlights_hardly_pass_for_independence() -> None:
    images = lambertian(9)[0].images * np.float32(0.2)
    for k in range(3):  # each image has a highlight of its own
        images[k, :6, 8 * k : 8 * k + 8] = 1
    x = images.reshape(9, -1)
    (bounded,) = score_triples(x, np.array([[0, 1, 2]]), 0.01, None)
    (unbounded,) = np.sqrt(gram_determinants((x[:3] @ x[:3].T)[None]))
    assert bounded < unbounded / 2


def test_choices_are_sorted_and_share_at_most_one_image() -> None:
    s = draw_sample(lambertian(12)[0], 0)
    chosen = choose_bases(s, 0.01, 0, count=6)
    assert len(chosen) == 6
    for one, other in combinations(chosen, 2):
        assert len(set(one) & set(other)) < 2
    scores = score_triples(s.images, np.array(chosen), 0.01, None)
    assert (np.diff(scores) <= 1e-12).all()
    assert chosen[0] == choose_bases(s, 0.01, 0)[0]


def test_the_same_seed_chooses_the_same_among_many_images() -> None:
    s = draw_sample(lambertian(60)[0], 0)
    assert choose_bases(s, 0.01, 3, count=4) == choose_bases(s, 0.01, 3, count=4)


@pytest.mark.parametrize("pixels", [3, 5, 9])
def test_an_object_of_a_few_pixels_has_bases_too(pixels: int) -> None:
    s = sample(lambertian(8)[0].images[:, :1, :pixels])
    assert len(choose_bases(s, 0.01, 0)[0]) == 3


@pytest.mark.parametrize("case", ["dark", "apart", "flat", "same", "zero"])
def test_images_that_cannot_be_bases_are_refused(case: str) -> None:
    images = lambertian(8)[0].images.copy()
    Ts = 0.01
    match case:
        case "dark":
            Ts = 0.99
        case "apart":  # no pixel is lit in three images
            for k in range(8):
                images[k, np.arange(24) % 8 != k] = 0
        case "flat":
            images[:] = 0.5
        case "same":
            images[:] = images[0]
        case "zero":
            images[:, 1:] = 0
            images[:, 0, 1:] = 0
    with pytest.raises(DegenerateError, match=rf"i >= Ts = {Ts:g}\) differ enough .* lower Ts"):
        choose_bases(sample(images), Ts, 0)
