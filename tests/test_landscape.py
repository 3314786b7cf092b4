"""The T-Ts landscape: its counts are those of labelling again, and where it is stable."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from lambert import wrap

from photolin import landscape as module
from photolin.analysis import Analysis, Options
from photolin.errors import Cancelled, InputError, OptionError
from photolin.evaluate import evaluate, tabulate
from photolin.factors import OUTSIDE, Factor, Thresholds, classify
from photolin.label import label_images
from photolin.landscape import Landscape, map_landscape, plateau
from photolin.pipeline import analyze
from photolin.stack import ImageStack
from photolin.synthetic import render_scene

Array = np.ndarray
SCENE = render_scene("sphere_cone", noise=0.01, bits=8, size=(36, 48), images=8)
RESULT = analyze(SCENE.stack, Options(T=0.05, Ts=0.03, samples=40))
TRUTH = SCENE.truth.labels


def made(images: Array, bases: Array, T: float = 0.05, Ts: float = 0.02) -> Analysis:
    """A result of given bases (3,H,W) whose first three images are the bases."""
    c = np.vstack([np.eye(3), np.full((len(images) - 3, 3), 1 / 3)])
    mask = np.ones(images.shape[1:], bool)
    thresholds = Thresholds(T, Ts)
    labels = label_images(images, bases, c, mask, thresholds)
    return replace(
        RESULT,
        thresholds=thresholds,
        coefficients=c,
        linearized_bases=bases,
        labels=labels,
        mask=mask,
        names=tuple(map(str, range(len(images)))),
        confidence=None,
    )


def random_case(seed: int = 0) -> tuple[ImageStack, Analysis]:
    """Values that meet every rule: at thresholds exactly, at 0, unknown, infinite."""
    rng = np.random.default_rng(seed)
    images = rng.choice([0, 0.002, 0.02, 0.1, 0.5, 1], (7, 6, 5)).astype(np.float32)
    images[0, 0, 0] = 1
    images[:, 1, 1] = np.linspace(0.1, 1, 7)
    bases = images[:3] * rng.choice([0.5, 0.9, 1, 1.05, 3], (3, 6, 5)) - rng.choice(
        [0, 0, 0.05, 0.3], (3, 6, 5)
    )
    bases[:, 0, 1], bases[0, 0, 2], bases[1, 0, 3] = np.nan, np.inf, -np.inf
    images[3:, 2, 2] = 0.3
    bases[:, 2, 2] = 0.3 / 1.05  # |i - l| / i is a multiple of T in no cell but nearly
    stack = wrap(np.clip(images + (images.max(axis=(1, 2)) == 0)[:, None, None], 0, 1))
    return stack, made(stack.images, bases.astype(np.float32))


def linearized(analysis: Analysis) -> Array:
    with np.errstate(invalid="ignore"):
        return np.stack([analysis.linearized(k) for k in range(len(analysis.coefficients))])


def labelled(stack: ImageStack, analysis: Analysis, T: float, Ts: float) -> Array:
    """(K,P) the plain way."""
    thresholds: Any = SimpleNamespace(T=T, Ts=Ts)  # the neighbour of the last T may be above 1
    found = classify(stack.images, linearized(analysis), thresholds)
    return found[:, stack.mask]


def check_counts(stack: ImageStack, analysis: Analysis, land: Landscape, truth: Array) -> None:
    """Every cell against labelling it, and its neighbours, by `classify`."""
    n = len(land.T)
    step = land.T[1] / land.T[0], land.Ts[1] / land.Ts[0]
    T, Ts = np.append(land.T, land.T[-1] * step[0]), np.append(land.Ts, land.Ts[-1] * step[1])
    maps = [[labelled(stack, analysis, t, ts) for t in T] for ts in Ts]
    for r in range(n):
        for c in range(n):
            here = maps[r][c]
            shares = [(here == factor).mean() for factor in sorted(Factor)]
            np.testing.assert_allclose(land.shares[:, r, c], shares, atol=1e-12)
            changes = [(here != maps[r][c + 1]).mean(), (here != maps[r + 1][c]).mean()]
            assert land.change[r, c] == pytest.approx(np.mean(changes), abs=1e-12)
            assert land.accuracy is not None
            _, confusion = tabulate(here, truth[:, stack.mask])
            assert land.accuracy[r, c] == pytest.approx(np.nanmean(confusion.diagonal()))


# Against labelling again


@pytest.mark.parametrize("T", [None, (0.01, 0.2), (0.04, 1.0)])
def test_every_cell_counts_what_labelling_again_gives(T: tuple[float, float] | None) -> None:
    land = map_landscape(SCENE.stack, RESULT, T, (0.002, 0.3), cells=7, truth=TRUTH)
    check_counts(SCENE.stack, RESULT, land, TRUTH)


@pytest.mark.parametrize("seed", range(4))
def test_thresholds_met_exactly_zeros_and_unknown_values_are_counted_right(seed: int) -> None:
    stack, analysis = random_case(seed)
    truth = np.random.default_rng(seed).choice([0, 1, 2, 3, 4, 255], stack.shape).astype(np.uint8)
    ranges = (0.05 / 2**0.5, 0.05 * 2**2.5), (0.02 / 10**0.5, 0.02 * 10**1.0)
    land = map_landscape(stack, analysis, *ranges, cells=3, truth=truth)
    check_counts(stack, analysis, land, truth)
    assert land.undetermined == np.isnan(linearized(analysis)).mean()
    assert land.undetermined > 0


def test_a_value_of_zero_is_specular_until_T_is_one() -> None:
    """|i - l| = T i exactly then; the rule's own border."""
    images = np.full((6, 2, 2), 0.5, np.float32)
    analysis = made(images, np.zeros((3, 2, 2), np.float32), T=1.0, Ts=0.5)
    land = map_landscape(wrap(images), analysis, (0.25, 1), (0.25, 0.9), cells=3)
    row, column = land.cell(1, 0.5)
    assert (land.T[column], land.Ts[row]) == (1, 0.5)
    assert land.shares[Factor.DIFFUSE, row, column] == 1
    assert (land.shares[Factor.SPECULAR, : row + 1, :column] == 1).all()


def test_the_present_thresholds_have_a_cell_of_their_own_with_the_present_labels() -> None:
    for T, Ts in ((0.05, 0.03), (0.0471, 0.0219), (0.2999, 0.0011)):
        analysis = analyze(SCENE.stack, Options(T=T, Ts=Ts, samples=20))
        land = map_landscape(SCENE.stack, analysis, truth=TRUTH)
        row, column = land.cell(T, Ts)
        assert (land.Ts[row], land.T[column]) == (Ts, T)
        inside = analysis.labels[:, SCENE.stack.mask]
        shares = [(inside == factor).mean() for factor in sorted(Factor)]
        np.testing.assert_allclose(land.shares[:, row, column], shares, atol=1e-12)
        truth = SCENE.truth
        told = evaluate(analysis.labels, analysis.coefficients, analysis.linearized_bases, truth)
        assert land.accuracy is not None
        assert land.accuracy[row, column] == pytest.approx(told.macro)


def test_cells_are_evenly_spaced_and_within_the_ranges() -> None:
    land = map_landscape(SCENE.stack, RESULT, (0.01, 1), (0.005, 0.5), cells=10)
    assert land.accuracy is None
    for axis, low, high in ((land.T, 0.01, 1), (land.Ts, 0.005, 0.5)):
        np.testing.assert_allclose(np.diff(np.log(axis)), np.log(high / low) / 10)
        assert low <= axis[0] < low * (high / low) ** 0.1
        assert high * (low / high) ** 0.1 < axis[-1] <= high
    far = map_landscape(SCENE.stack, RESULT, (0.1, 1), (0.1, 0.5), cells=2)
    np.testing.assert_allclose(far.T, [0.1 * 10**0.25, 0.1 * 10**0.75])
    assert far.cell(1e-9, 0) == (0, 0)
    assert far.cell(1, 1) == (1, 1)
    assert far.cell(float("nan"), 0.9) == (1, 0)


def test_usual_ranges_hold_the_present_thresholds() -> None:
    for T, Ts in ((0.0005, 1e-6), (1.0, 0.9), (0.05, 0.0)):
        analysis = replace(RESULT, thresholds=Thresholds(T, Ts))
        land = map_landscape(SCENE.stack, analysis, cells=4)
        assert T in land.T
        assert Ts in land.Ts or Ts == 0


# Laws


def test_nothing_is_lost_and_more_tolerance_never_makes_less_diffuse() -> None:
    land = map_landscape(SCENE.stack, RESULT)
    np.testing.assert_allclose(land.shares.sum(axis=0), 1)
    assert (land.shares >= 0).all()
    assert (np.diff(land.shares[Factor.DIFFUSE], axis=1) >= 0).all()
    shadow = land.shares[Factor.ATTACHED] + land.shares[Factor.CAST]
    assert (np.diff(shadow, axis=0) >= 0).all()
    np.testing.assert_array_equal(shadow, shadow[:, :1].repeat(24, 1))
    for array in (land.T, land.Ts, land.shares, land.change):
        assert not array.flags.writeable


def test_the_order_of_images_and_the_size_of_blocks_change_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    order = np.random.default_rng(0).permutation(8)
    stack = wrap(SCENE.stack.images[order], SCENE.stack.mask)
    analysis = replace(RESULT, coefficients=RESULT.coefficients[order], labels=RESULT.labels[order])
    expected = map_landscape(SCENE.stack, RESULT, truth=TRUTH)

    for block in (97, 1 << 20):
        monkeypatch.setattr(module, "BLOCK", block)
        found = map_landscape(stack, analysis, truth=TRUTH[order])
        for name in ("shares", "change", "accuracy"):
            np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_pixels_outside_the_mask_have_no_say() -> None:
    images = SCENE.stack.images.copy()
    images[:, ~SCENE.stack.mask] = 0.77
    other = wrap(images, SCENE.stack.mask)
    mask = SCENE.stack.mask.copy()
    mask[:10] = False
    a, b = (map_landscape(wrap(x.images, mask), RESULT) for x in (SCENE.stack, other))
    np.testing.assert_array_equal(a.shares, b.shares)
    assert a.pixels == mask.sum()


def test_a_sample_tells_shares_as_exactly_as_it_says(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = map_landscape(SCENE.stack, RESULT)
    count = SCENE.stack.mask.sum() // 3
    monkeypatch.setattr(module, "SAMPLE", count)
    found = map_landscape(SCENE.stack, RESULT)
    assert found.pixels == count
    assert 0 < np.abs(found.shares - exact.shares).max() < 3 * 0.5 / np.sqrt(count)
    ranks = module._ranks(10 * count)
    assert (ranks // 10 == np.arange(count)).all()
    assert len(set(ranks % 10)) == 10


# The plateau


def test_of_a_clean_scene_the_plateau_is_nearly_the_best() -> None:
    scene = render_scene("sphere_cone", size=(60, 80), images=12)
    land = map_landscape(scene.stack, analyze(scene.stack), truth=scene.truth.labels)
    assert land.accuracy is not None
    assert land.accuracy[plateau(land)] > land.accuracy.max() - 3


def test_the_plateau_is_the_middle_of_the_widest_stable_area() -> None:
    """Two steps of the shares with flat land between; U is the price of small T."""
    shares = np.zeros((5, 12, 12))
    shares[Factor.DIFFUSE] = 0.6
    shares[Factor.DIFFUSE, :, 5:] += 0.2 * np.arange(7) / 7
    shares[Factor.ATTACHED, 7:] = 0.05 * np.arange(1, 6)[:, None]
    shares[Factor.ATTACHED, :7] = 0.05
    shares[Factor.CAST] = 0.05
    land = replace(map_landscape(SCENE.stack, RESULT, cells=12), shares=shares)
    # flat are rows 0..6, columns 0..4, as wide as high up to the border
    assert plateau(land) == (2, 2)
    shares = shares.copy()
    shares[Factor.UNDEFINED, :, :4] = 0.1
    assert plateau(replace(land, shares=shares))[1] >= 4


# Degenerate and hostile


def test_land_without_any_change_still_has_a_middle() -> None:
    images = np.full((6, 3, 4), 0.9, np.float32)
    land = map_landscape(wrap(images), made(images, images[:3]), (0.01, 0.1), (0.01, 0.1))
    assert (land.shares[Factor.DIFFUSE] == 1).all()
    assert (land.change == 0).all()
    assert plateau(land) == (11, 11)


def test_where_all_is_dark_all_is_shadow() -> None:
    images = np.full((6, 2, 2), 1e-5, np.float32)
    bases = np.zeros((3, 2, 2), np.float32)
    land = map_landscape(
        wrap(images), made(images, bases), cells=3, truth=np.zeros((6, 2, 2), "u1")
    )
    assert (land.shares[Factor.ATTACHED] == 1).all()
    assert np.isnan(land.accuracy).all()  # pyright: ignore
    assert plateau(land) == (1, 1)


def test_bases_that_are_not_known_leave_all_undefined() -> None:
    images = np.full((6, 2, 2), 0.5, np.float32)
    bases = np.full((3, 2, 2), np.nan, np.float32)
    land = map_landscape(wrap(images), made(images, bases))
    assert (land.shares[Factor.UNDEFINED] == 1).all()
    assert (land.undetermined, land.change.max()) == (1, 0)
    plateau(land)


@pytest.mark.parametrize("label", [OUTSIDE, Factor.UNDEFINED])
def test_true_labels_that_are_no_class_have_no_say(label: int) -> None:
    truth = np.where(TRUTH == Factor.SPECULAR, np.uint8(label), TRUTH)
    land = map_landscape(SCENE.stack, RESULT, cells=5, truth=truth)
    check_counts(SCENE.stack, RESULT, land, truth)


def test_one_pixel_makes_a_landscape() -> None:
    images = np.linspace(0.05, 0.9, 6, dtype=np.float32)[:, None, None]
    analysis = made(images, images[:3])
    truth = np.full((6, 1, 1), Factor.DIFFUSE, np.uint8)
    land = map_landscape(wrap(images), analysis, cells=2, truth=truth)
    check_counts(wrap(images), analysis, land, truth)
    assert land.pixels == 1


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"T": (0.3, 0.01)}, r"the range of T is 0.3 to 0.01; accepted is from above 0 to a great"),
        ({"T": (0, 0.1)}, r"the range of T is 0 to 0.1; .* up to 1"),
        ({"T": (0.1, 1.5)}, "the range of T is 0.1 to 1.5"),
        ({"T": (float("nan"), 0.5)}, "the range of T is nan"),
        ({"Ts": (0.1, 0.1)}, r"the range of Ts is 0.1 to 0.1; .* below 1"),
        ({"Ts": (0.1, 1)}, "the range of Ts is 0.1 to 1"),
        ({"Ts": (0.1, float("nan"))}, "the range of Ts is 0.1 to nan"),
        ({"cells": 1}, "cells is 1; accepted is 2 to 64"),
        ({"cells": 65}, "cells is 65"),
    ],
)
def test_ranges_that_make_no_map_are_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(OptionError, match=words):
        map_landscape(SCENE.stack, RESULT, **given)


def test_what_belongs_to_another_stack_is_refused() -> None:
    with pytest.raises(InputError, match=r"the true labels have shape \(8, 36, 47\), the stack"):
        map_landscape(SCENE.stack, RESULT, truth=TRUTH[..., :-1])
    with pytest.raises(InputError, match=r"the result's labels have shape \(8, 36, 48\)"):
        map_landscape(wrap(SCENE.stack.images[:7]), RESULT)


def test_it_tells_progress_and_can_be_cancelled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "BLOCK", 200)
    told: list[tuple[str, float]] = []
    map_landscape(SCENE.stack, RESULT, progress=lambda *what: told.append(what))
    assert {stage for stage, _ in told} == {"landscape"}
    assert len(told) > 3
    assert told[-1][1] == 1
    with pytest.raises(Cancelled, match="landscape was cancelled"):
        map_landscape(SCENE.stack, RESULT, cancel=lambda: True)
