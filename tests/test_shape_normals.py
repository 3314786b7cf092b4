"""Normals and albedo from bases: laws of the 3x3 map, what is unknown, what is refused."""

import numpy as np
import pytest

from photolin.errors import DegenerateError, InputError
from photolin.shape.normals import normals_from_bases

RNG = np.random.default_rng(0)
MATRIX = RNG.normal(size=(3, 3)) + 2 * np.eye(3)


def surface(size: tuple[int, int] = (6, 7)) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit normals (H,W,3) that face the camera, albedo (H,W), and bases (3,H,W) for MATRIX."""
    rng = np.random.default_rng(1)
    normals = rng.uniform(-1, 1, (*size, 3))
    normals[..., 2] = rng.uniform(0.2, 1, size)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    albedo = rng.uniform(0.1, 1, size)
    bases = np.einsum("ij,hwj->ihw", np.linalg.inv(MATRIX), normals * albedo[..., None])
    return normals, albedo, bases


def test_the_truth_comes_back() -> None:
    normals, albedo, bases = surface()
    found = normals_from_bases(bases.astype(np.float32), MATRIX)
    assert [array.dtype for array in found] == [np.float32, np.float32]
    np.testing.assert_allclose(found[0], normals, atol=1e-6)
    np.testing.assert_allclose(found[1], albedo, rtol=1e-5)


def test_normals_have_length_one_and_albedo_carries_the_scale() -> None:
    _, albedo, bases = surface()
    unit, scaled = normals_from_bases(bases, 7 * MATRIX), normals_from_bases(bases / 9, MATRIX)
    np.testing.assert_allclose(np.linalg.norm(unit[0], axis=2), 1, atol=1e-6)
    np.testing.assert_allclose(unit[1], 7 * albedo, rtol=1e-5)
    np.testing.assert_allclose(scaled[1], albedo / 9, rtol=1e-5)
    np.testing.assert_allclose(scaled[0], unit[0], atol=1e-6)


def test_a_turn_of_the_matrix_turns_the_normals() -> None:
    _, _, bases = surface()
    turn = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
    straight, turned = normals_from_bases(bases, MATRIX), normals_from_bases(bases, turn @ MATRIX)
    np.testing.assert_allclose(turned[0], straight[0] @ turn.T, atol=1e-6)
    np.testing.assert_allclose(turned[1], straight[1], rtol=1e-5)


def test_a_change_of_base_images_that_the_matrix_follows_changes_nothing() -> None:
    _, _, bases = surface()
    other = RNG.normal(size=(3, 3))
    moved = normals_from_bases(
        np.einsum("ij,jhw->ihw", other, bases), MATRIX @ np.linalg.inv(other)
    )
    for a, b in zip(moved, normals_from_bases(bases, MATRIX), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)


def test_unknown_stays_nan_and_outside_stays_zero() -> None:
    normals, _, bases = surface()
    bases[:, 2, 3], bases[:, 4, 5] = np.nan, 0
    found, albedo = normals_from_bases(bases, MATRIX)
    assert np.isnan(found[2, 3]).all()
    assert np.isnan(albedo[2, 3])
    assert (found[4, 5] == 0).all()
    assert albedo[4, 5] == 0
    assert np.isfinite(found).all(axis=2).sum() == 41
    np.testing.assert_allclose(found[0], normals[0], atol=1e-6)


def test_one_unknown_base_makes_the_pixel_unknown() -> None:
    _, _, bases = surface()
    bases[1, 0, 0] = np.nan
    found, albedo = normals_from_bases(bases, np.eye(3))
    assert np.isnan(found[0, 0]).all()
    assert np.isnan(albedo[0, 0])


def test_surfaces_as_dark_as_single_precision_holds_have_normals() -> None:
    normals, _, bases = surface()
    dark, matrix = (bases * 1e-30).astype(np.float32), MATRIX.astype(np.float32)
    found, albedo = normals_from_bases(dark, matrix)
    np.testing.assert_allclose(found, normals, atol=1e-5)
    assert (albedo > 0).all()


@pytest.mark.parametrize(
    ("bases", "matrix"), [((3, 4), (3, 3)), ((4, 5, 6), (3, 3)), ((3, 4, 5), (3,))]
)
def test_other_shapes_are_refused(bases: tuple[int, ...], matrix: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match=r"\(3, rows, columns\) and \(3, 3\) are accepted"):
        normals_from_bases(np.ones(bases), np.ones(matrix))


@pytest.mark.parametrize("matrix", [np.ones((3, 3)), np.zeros((3, 3)), np.full((3, 3), np.inf)])
def test_a_matrix_onto_a_plane_is_refused(matrix: np.ndarray) -> None:
    with pytest.raises(DegenerateError, match="a regular 3x3 matrix is accepted"):
        normals_from_bases(np.ones((3, 2, 2)), matrix)
