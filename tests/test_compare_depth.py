"""Errors of depth: what is left when the free constants are taken off."""

import numpy as np
import pytest

from photolin.errors import DegenerateError, InputError
from photolin.shape.compare_depth import DepthError, compare_depth

ALL = np.ones((4, 5), bool)
DEPTH = np.random.default_rng(0).normal(0, 3, ALL.shape)


def test_a_constant_is_no_error() -> None:
    error = compare_depth(DEPTH + 7, DEPTH, ALL)
    assert error.rms == pytest.approx(0, abs=1e-12)
    assert (error.pixels, error.parts) == (20, 1)


def test_each_connected_part_has_a_constant_of_its_own_but_diagonals_do_not_connect() -> None:
    mask = ALL.copy()
    mask[:, 2] = False
    shifted = DEPTH + np.where(np.arange(5) < 2, 5, -8)
    assert compare_depth(shifted, DEPTH, mask).largest == pytest.approx(0, abs=1e-12)
    assert compare_depth(shifted, DEPTH, ALL).largest > 5
    checks = np.indices(ALL.shape).sum(0) % 2 == 0
    assert compare_depth(DEPTH, 0 * DEPTH, checks) == DepthError(0, 0, 10, 10, 0)


def test_rms_and_largest_are_those_of_the_deviations_in_the_unit_given() -> None:
    true = np.zeros((1, 4))
    depth = np.array([[1.0, 1.0, 1.0, 5.0]])
    error = compare_depth(depth, true, np.ones((1, 4), bool))
    assert error.rms == pytest.approx(np.sqrt(3))
    assert error.largest == pytest.approx(3)
    tenfold = compare_depth(10 * depth, 10 * true, np.ones((1, 4), bool))
    assert tenfold.rms == pytest.approx(10 * error.rms)


def test_each_side_of_a_jump_of_true_depth_has_a_constant_of_its_own() -> None:
    """A slope of 5 is none, where true normals say so."""
    column = np.arange(6.0)
    true = np.tile(5 * column + np.where(column < 3, 0, 40), (4, 1))
    normals = np.broadcast_to(np.array([-5, 0, 1]) / np.sqrt(26), (4, 6, 3))
    mask = np.ones((4, 6), bool)
    found = true - np.where(column < 3, 0, 40)
    whole, split = (compare_depth(found, true, mask, n) for n in (None, normals))
    assert (whole.parts, split.parts) == (1, 2)
    assert whole.largest == pytest.approx(20)
    assert split.largest == pytest.approx(0, abs=1e-12)
    # in mm, with pixels of 10 mm
    assert compare_depth(10 * found, 10 * true, mask, normals, 10.0).parts == 2
    upwards = np.broadcast_to(np.array([0, -5, 1]) / np.sqrt(26), (6, 4, 3))
    rows = -true.T
    assert compare_depth(rows, rows, mask.T, upwards).parts == 2


def test_the_median_is_not_that_of_a_few_large_errors() -> None:
    depth = np.array([[0.0, 0.1, 0.0, 0.1, 90.0]])
    error = compare_depth(depth, 0 * depth, np.ones((1, 5), bool))
    assert error.median == pytest.approx(0.1)
    assert error.rms > 30


def test_nan_of_either_and_pixels_outside_are_not_compared() -> None:
    depth, true, mask = DEPTH.copy(), DEPTH.copy(), ALL.copy()
    depth[0, 0] = true[1, 1] = np.nan
    depth[3, 4], mask[3, 4] = 1e9, False
    error = compare_depth(depth, true, mask)
    assert error.pixels == 17
    assert error.largest == 0


def test_single_precision_far_away_loses_nothing() -> None:
    true = (DEPTH + 1e4).astype(np.float32)
    assert compare_depth(true, true.astype(float) - 1e4, ALL).rms < 1e-9


def test_nothing_to_compare_is_said() -> None:
    with pytest.raises(DegenerateError, match="no pixel of the mask has both"):
        compare_depth(np.full(ALL.shape, np.nan), DEPTH, ALL)


@pytest.mark.parametrize(
    ("depth", "mask"),
    [(DEPTH[1:], ALL), (DEPTH, ALL[:, 1:]), (DEPTH, ALL.astype(int)), (DEPTH[None], ALL[None])],
)
def test_what_does_not_fit_is_refused(depth: np.ndarray, mask: np.ndarray) -> None:
    true = DEPTH[None] if mask.ndim == 3 else DEPTH
    with pytest.raises(InputError, match="and a bool mask are accepted"):
        compare_depth(depth, true, mask)
