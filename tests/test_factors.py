"""Eq. (3) and (4): every (i, l) has exactly one label, by exactly the rule written down."""

import itertools

import numpy as np
import pytest

from photolin.errors import OptionError
from photolin.factors import (
    LETTERS,
    OUTSIDE,
    PALETTE,
    TITLES,
    Factor,
    Thresholds,
    classifiable,
    classify,
)

U, D, S, A, C = 0, 1, 2, 3, 4
SETTINGS = [(0.05, 0.02), (0.25, 0.0), (1.0, 0.5), (0.008, 0.003), (1e-9, 0.99)]


def plane(T: float, Ts: float) -> tuple[np.ndarray, np.ndarray]:
    """A grid over (i, l) with all boundaries, their float32 neighbours, infinity and NaN."""
    i = np.array([0, Ts, Ts / 2, 0.1, 0.25, 0.5, 1, -0.1, np.nan, np.inf, -np.inf], np.float32)
    i = np.concatenate([i, np.linspace(-0.2, 1.2, 57, dtype=np.float32)])
    i = np.unique(np.concatenate([i, *(np.nextafter(i, np.float32(d)) for d in (-9, 9))]))
    with np.errstate(invalid="ignore", over="ignore"):
        bounds = [i, i - np.float32(T) * i, i + np.float32(T) * i, np.zeros_like(i), -i]
        near = [np.nextafter(b, np.float32(d)) for b in bounds for d in (-9, 9)]
    special = np.array([np.nan, np.inf, -np.inf, -0.0, 2, -2], np.float32)
    l = np.stack([*bounds, *near, *(np.full_like(i, s) for s in special)], axis=1)
    return np.broadcast_to(i[:, None], l.shape), l


def by_the_paper(i: np.float32, l: np.float32, T: float, Ts: float) -> list[int]:
    """All labels whose rule, as in the paper's Eq. (3), holds for one (i, l)."""
    slack = np.float32(T) * i
    rules = {
        D: i >= np.float32(Ts) and abs(i - l) <= slack,
        S: i >= np.float32(Ts) and i - l > slack and l >= 0,
        A: i < np.float32(Ts) and l <= 0,
        C: i < np.float32(Ts) and l > 0,
    }
    return [label for label, holds in rules.items() if holds]


@pytest.mark.parametrize(("T", "Ts"), SETTINGS)
def test_every_point_of_the_plane_has_exactly_the_label_of_eq_3(T: float, Ts: float) -> None:
    i, l = plane(T, Ts)
    labels = classify(i, l, Thresholds(T, Ts))
    assert labels.dtype == np.uint8
    assert labels.shape == i.shape
    with np.errstate(invalid="ignore", over="ignore"):
        for found, a, b in zip(labels.flat, i.flat, l.flat, strict=True):
            held = by_the_paper(a, b, T, Ts)
            assert len(held) <= 1
            assert found == (held[0] if held else U), (a, b)


def test_all_five_labels_occur_on_the_plane() -> None:
    assert set(classify(*plane(0.05, 0.02), Thresholds(0.05, 0.02)).flat) == {U, D, S, A, C}


@pytest.mark.parametrize(
    ("i", "l", "label"),
    [
        (0.5, 0.5, D),
        (0.5, 0.375, D),  # i - l = T i exactly
        (0.5, 0.625, D),  # l - i = T i exactly
        (0.5, 0.374, S),
        (0.5, 0.626, U),
        (0.5, 0.0, S),  # grazing, with a highlight
        (0.5, -0.001, U),  # lit, though it faces away
        (0.25, 0.25, D),  # i = Ts is lit
        (0.249, 0.3, C),
        (0.249, 0.0, A),  # l = 0 is attached
        (0.249, -0.3, A),
        (0.0, 1e-30, C),
        (0.0, -0.0, A),
        (np.nan, 0.5, U),
        (0.5, np.nan, U),
        (0.1, np.nan, U),
        (np.nan, np.nan, U),
        (0.5, np.inf, U),
        (0.5, -np.inf, U),
        (0.1, np.inf, C),
        (0.1, -np.inf, A),
        (np.inf, 0.5, D),  # an infinite input has an infinite tolerance
        (np.inf, np.inf, U),
        (-np.inf, -1, A),
    ],
)
def test_boundaries_belong_where_the_rule_puts_them(i: float, l: float, label: int) -> None:
    assert classify(i, l, Thresholds(0.25, 0.25)) == label


def test_zero_shadow_level_leaves_no_shadow() -> None:
    i, l = np.meshgrid(np.linspace(0, 1, 33), np.linspace(-1, 1, 65))
    labels = classify(i, l, Thresholds(0.05, 0))
    assert not np.isin(labels, (A, C)).any()
    assert classify(0, 0, Thresholds(0.05, 0)) == D


def test_doubles_are_compared_in_single_precision() -> None:
    level = 0.1  # its float32 is above it
    assert classify(level, level, Thresholds(0.05, level)) == D
    assert classify(np.float64(level) - 1e-12, level, Thresholds(0.05, level)) == D


def test_shapes_broadcast_and_inputs_stay() -> None:
    i, l = np.full((3, 1), 0.5), np.zeros(4)
    assert classify(i, l, Thresholds(0.1, 0.1)).shape == (3, 4)
    assert (i == 0.5).all()


def test_only_diffuse_and_shadows_are_classifiable() -> None:
    codes = np.array([U, D, S, A, C, OUTSIDE], np.uint8)
    np.testing.assert_array_equal(classifiable(codes), [False, True, False, True, True, False])


def test_every_factor_has_a_letter_a_title_and_a_colour_of_its_own() -> None:
    for table in (LETTERS, TITLES, PALETTE):
        assert set(table) == set(Factor)
        assert len(set(table.values())) == len(Factor)
    for one, other in itertools.combinations(PALETTE.values(), 2):
        assert np.abs(np.subtract(one, other)).sum() > 60
    assert OUTSIDE not in list(Factor)


@pytest.mark.parametrize("T", [0, -0.1, 1.001, np.nan, np.inf, -np.inf])
def test_a_tolerance_out_of_range_is_refused(T: float) -> None:
    with pytest.raises(OptionError, match=r"^T is .*accepted is a number above 0 and up to 1$"):
        Thresholds(T, 0.02)


@pytest.mark.parametrize("Ts", [-0.001, 1, np.nan, np.inf])
def test_a_shadow_level_out_of_range_is_refused(Ts: float) -> None:
    with pytest.raises(OptionError, match=r"^Ts is .*accepted is a number from 0 to below 1$"):
        Thresholds(0.05, Ts)


def test_the_ends_of_the_ranges_are_accepted() -> None:
    assert Thresholds(1, 0) == Thresholds(1.0, 0.0)
    Thresholds(1e-12, np.nextafter(1, 0))
