"""The matrix that resolves the ambiguity: the lights it implies, its scale, what it says."""

from typing import get_args

import numpy as np
import pytest
from lambert import lambertian

from photolin.coefficients import relate_to_bases
from photolin.shape.resolved import RESIDUALS, Kind, Resolved, set_scale

BASES = (0, 6, 9)


def known() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Linearized bases (3,P), coefficients and lights of a relief."""
    stack, lights = lambertian()
    return stack.images[list(BASES)].reshape(3, -1), relate_to_bases(lights, BASES), lights


def resolved(matrix: np.ndarray, kind: Kind = "lights") -> Resolved:
    return Resolved(matrix, kind, 0.0, True, "")


def test_the_lights_of_the_true_matrix_are_the_true_lights() -> None:
    _, coefficients, lights = known()
    given = resolved(np.linalg.inv(lights[list(BASES)]))
    np.testing.assert_allclose(given.lights(coefficients), lights, atol=1e-12)


def test_lights_and_surface_vectors_give_the_images_whatever_the_matrix() -> None:
    bases, coefficients, _ = known()
    given = resolved(np.random.default_rng(0).normal(size=(3, 3)))
    images = given.lights(coefficients) @ (given.matrix @ bases)
    np.testing.assert_allclose(images, coefficients @ bases, atol=1e-6)


def test_with_no_scale_the_lights_of_the_bases_have_the_mean_power_one() -> None:
    matrix = np.random.default_rng(1).normal(size=(3, 3))
    scaled = set_scale(matrix)
    assert np.linalg.norm(resolved(scaled).lights(np.eye(3)), axis=1).mean() == pytest.approx(1)
    np.testing.assert_allclose(scaled / scaled[0, 0], matrix / matrix[0, 0])
    assert scaled[0, 0] * matrix[0, 0] > 0
    np.testing.assert_allclose(set_scale(7 * matrix), scaled)


def test_it_is_read_only() -> None:
    given = Resolved(np.eye(3), "points", 0.0, False, "", np.zeros(5))
    for array in (given.matrix, given.residuals):
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


@pytest.mark.parametrize("kind", get_args(Kind))
def test_every_kind_says_what_its_residual_is(kind: Kind) -> None:
    assert set(RESIDUALS) == set(get_args(Kind))
    assert ("degrees" in resolved(np.eye(3), kind).residual_means) == (kind != "integrability")
