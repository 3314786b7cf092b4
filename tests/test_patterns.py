"""Patterns tell the classes apart without their colours."""

from itertools import combinations

import numpy as np
import pytest

from photolin.factors import OUTSIDE, Factor
from webapp.patterns import FINEST, MARK, MARKS, TILE, add_marks


def marks(factor: int, shape: tuple[int, int] = (32, 48)) -> np.ndarray:
    """(H,W): where an area of one class has marks."""
    return add_marks(np.full(shape, factor, np.uint8)) != factor


def test_marks_are_added_to_codes_and_taken_away_leave_the_labels() -> None:
    labels = np.random.default_rng(0).integers(0, 5, (60, 70), dtype=np.uint8)
    labels[::7] = OUTSIDE
    before = labels.copy()
    found = add_marks(labels)
    np.testing.assert_array_equal(labels, before)
    assert found.dtype == np.uint8
    extra = found - labels
    assert set(np.unique(extra)) == {0, MARK}
    for factor in Factor:
        area = labels == factor
        np.testing.assert_array_equal(extra[area] > 0, marks(factor, labels.shape)[area])


@pytest.mark.parametrize("code", [5, 6, 7, 9, 200, OUTSIDE])
def test_a_code_that_is_no_class_has_no_marks(code: int) -> None:
    assert not marks(code).any()


def test_each_class_but_diffuse_has_marks_and_more_ground_than_marks() -> None:
    assert {f for f in Factor if marks(f).any()} == set(MARKS) == set(Factor) - {Factor.DIFFUSE}
    assert all(0.1 < marks(f).mean() <= 0.25 for f in MARKS)


def test_shadows_are_lined_along_rows_or_columns_and_the_others_look_the_same_transposed() -> None:
    attached, cast = marks(Factor.ATTACHED), marks(Factor.CAST)
    assert (attached == attached[:, :1]).all()
    assert attached[:, 0].any()
    assert (cast == cast[:1]).all()
    assert cast[0].any()
    for factor in (Factor.SPECULAR, Factor.UNDEFINED):
        square = marks(factor, (TILE, TILE))
        np.testing.assert_array_equal(square, square.T)


def test_patterns_stay_apart_however_they_are_shifted() -> None:
    tiles = {f: marks(f, (TILE, TILE)) for f in Factor}
    for one, other in combinations(tiles, 2):
        shifted = (np.roll(tiles[other], (r, c), (0, 1)) for r in range(TILE) for c in range(TILE))
        assert min(np.sum(tiles[one] != tile) for tile in shifted) >= TILE


@pytest.mark.parametrize("factor", list(MARKS))
def test_marks_grow_with_a_picture_that_is_fitted_into_a_window(factor: Factor) -> None:
    small = marks(factor, (40, FINEST))
    large = marks(factor, (120, 3 * FINEST))
    np.testing.assert_array_equal(large, small.repeat(3, axis=0).repeat(3, axis=1))


@pytest.mark.parametrize("shape", [(1, 1), (3, 500), (0, 4)])
def test_pictures_of_any_size_are_marked(shape: tuple[int, int]) -> None:
    assert marks(Factor.ATTACHED, shape).shape == shape
