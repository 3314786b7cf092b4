"""Step 1 as published: exact where nothing disturbs, laws, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from lambert import lambertian, wrap

from photolin.analysis import Method, Options
from photolin.coefficients import draw_samples, estimate_coefficients
from photolin.errors import Cancelled, DegenerateError
from photolin.factors import Thresholds
from photolin.stack import ImageStack

BASES = (1, 4, 8)
PUBLISHED: list[Method] = ["classification", "statistical"]


def estimate(stack: ImageStack, method: Method, seed: int = 0, Ts: float = 0.01) -> np.ndarray:
    options = Options(method=method, seed=seed, samples=200)
    return estimate_coefficients(stack, BASES, Thresholds(0.02, Ts), options)


@pytest.mark.parametrize("method", PUBLISHED)
def test_diffuse_images_have_the_coefficients_of_their_lights(method: Method) -> None:
    stack, lights = lambertian()
    found = estimate(stack, method)
    expected = lights @ np.linalg.inv(lights[list(BASES)])
    np.testing.assert_array_equal(found[list(BASES)], np.eye(3))
    # any exact sample has full support, the worst conditioned one too: rounding is all that is lost
    np.testing.assert_allclose(found, expected, atol=2e-4)


def test_the_published_way_finds_the_majority_among_highlights() -> None:
    stack, lights = lambertian()
    images = stack.images.copy()
    images[2, :, :12] = np.minimum(images[2, :, :12] + 0.2, 1)
    expected = (lights @ np.linalg.inv(lights[list(BASES)]))[2]
    stack = wrap(images)
    assert np.abs(estimate(stack, "classification")[2] - expected).max() < 2e-3


@pytest.mark.parametrize("method", PUBLISHED)
def test_half_the_light_is_half_the_row_exactly(method: Method) -> None:
    """Exact: a power of two changes no rounding, and with Ts = 0 no pixel turns dark."""
    stack, _ = lambertian()
    images = stack.images.copy()
    images[6] /= 2
    one, half = estimate(stack, method, Ts=0), estimate(wrap(images), method, Ts=0)
    one[6] /= 2
    np.testing.assert_array_equal(half, one)


@pytest.mark.parametrize("method", PUBLISHED)
def test_the_same_seed_gives_the_same_and_another_one_not(method: Method) -> None:
    stack, _ = lambertian()
    images = stack.images * np.random.default_rng(0).uniform(0.97, 1, stack.shape)
    stack = wrap(images.astype(np.float32))
    np.testing.assert_array_equal(estimate(stack, method, 5), estimate(stack, method, 5))
    assert (estimate(stack, method, 5) != estimate(stack, method, 6)).any()


def test_the_winner_has_the_most_support_of_the_candidates_drawn() -> None:
    stack, _ = lambertian()
    images = stack.images * np.random.default_rng(0).uniform(0.97, 1, stack.shape)
    stack = wrap(images.astype(np.float32))
    X = stack.images.reshape(10, -1)
    triples, inverses = draw_samples(X[list(BASES)], 200, np.random.default_rng([0, 1]))
    candidates = np.einsum("nij,nj->ni", inverses, X[5][triples])
    support = (np.abs(X[5] - candidates @ X[list(BASES)]) <= 0.02 * X[5]).sum(axis=1)
    found = estimate(stack, "classification")[5]
    np.testing.assert_allclose(found, candidates[support.argmax()], rtol=1e-5)


def test_samples_solve_their_observations_and_singular_ones_are_drawn_again() -> None:
    rng = np.random.default_rng(0)
    A = rng.normal(size=(3, 5))
    A[:, 1] = 2 * A[:, 0]
    triples, inverses = draw_samples(A, 300, rng)
    assert len(triples) == len(inverses) == 300
    for triple, inverse in zip(triples, inverses, strict=True):
        assert len(set(triple)) == 3
        assert not {0, 1} <= set(triple)
        np.testing.assert_allclose(inverse @ A[:, triple].T, np.eye(3), atol=1e-3)


def test_drawing_ends_where_hardly_any_sample_is_regular() -> None:
    A = np.zeros((3, 100))
    A[:, :3] = np.eye(3)
    triples, _ = draw_samples(A, 2000, np.random.default_rng(0))
    assert len(triples) < 2000
    assert {tuple(sorted(t)) for t in triples.tolist()} <= {(0, 1, 2)}


def test_samples_of_next_to_nothing_are_dropped_without_a_warning() -> None:
    A = np.random.default_rng(0).random((3, 50)) * 1e-41
    assert len(draw_samples(A.astype(np.float32), 100, np.random.default_rng(0))[0]) == 0


@pytest.mark.parametrize("method", PUBLISHED)
@pytest.mark.parametrize("case", ["flat", "coplanar", "one pixel", "same image"])
def test_bases_that_nothing_tells_apart_are_refused(method: Method, case: str) -> None:
    stack, _ = lambertian(flat=case == "flat", coplanar=case == "coplanar")
    match case:
        case "one pixel":
            stack = wrap(stack.images[:, :1, :1])
        case "same image":
            images = stack.images.copy()
            images[BASES[1]] = images[BASES[0]]
            stack = replace(stack, images=images)
    with pytest.raises(DegenerateError, match=r"base images \(1, 4, 8\): no three pixels tell"):
        estimate(stack, method)


def test_it_can_be_cancelled() -> None:
    stack, _ = lambertian()
    with pytest.raises(Cancelled, match="coefficients was cancelled"):
        estimate_coefficients(
            stack,
            BASES,
            Thresholds(0.02, 0.01),
            Options(method="classification"),
            cancel=lambda: True,
        )
