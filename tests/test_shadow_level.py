"""Ts from pointed-out pixels, and a constant that lies on all images."""

from pathlib import Path

import numpy as np
import pytest

from photolin.errors import OptionError
from photolin.factors import Factor, Thresholds
from photolin.label import label_images
from photolin.load import LoadOptions, load_stack
from photolin.pipeline import analyze
from photolin.shadow_level import sample_shadow_level
from photolin.synthetic import render_scene


def test_where_the_samples_leave_a_gap_Ts_is_close_above_the_shadows() -> None:
    shadows = np.clip(np.random.default_rng(0).normal(0.02, 0.002, 400), 0.015, 0.025)
    level = sample_shadow_level(shadows, np.array([0.3, 0.5]))
    assert level == sample_shadow_level(shadows)
    assert level.Ts == pytest.approx(0.026, abs=0.001)
    assert level.error == 0


def test_lit_pixels_dimmer_than_that_bring_Ts_down_to_the_dimmest_of_them() -> None:
    shadows = np.linspace(0.01, 0.03, 400)
    lone = sample_shadow_level(shadows).Ts
    assert lone > 0.035
    found = [
        sample_shadow_level(shadows, np.array([dim, 0.3])).Ts for dim in (0.05, 0.034, 0.032, 0.031)
    ]
    assert found == [lone, 0.034, 0.032, 0.031]  # an observation at Ts is lit


def test_overlapping_samples_give_the_smallest_share_of_wrong_ones() -> None:
    rng = np.random.default_rng(1)
    shadows, lit = rng.normal(0.02, 0.005, 3000), rng.normal(0.04, 0.005, 3000)
    level = sample_shadow_level(shadows, lit)
    assert level.Ts == pytest.approx(0.03, abs=0.0015)
    wrong = ((shadows >= level.Ts).mean() + (lit < level.Ts).mean()) / 2
    assert level.error == pytest.approx(wrong, abs=1e-12)
    others = [
        ((shadows >= Ts).mean() + (lit < Ts).mean()) / 2 for Ts in np.linspace(0.01, 0.05, 401)
    ]
    standard_error = np.sqrt(wrong * (1 - wrong) / 6000)
    assert wrong <= min(others) + standard_error


def test_each_kind_counts_alike_however_often_it_was_sampled() -> None:
    rng = np.random.default_rng(2)
    shadows, lit = rng.normal(0.02, 0.005, 2000), rng.normal(0.04, 0.005, 2000)
    many = np.tile(lit, 30)
    assert sample_shadow_level(shadows, many).Ts == pytest.approx(
        sample_shadow_level(shadows, lit).Ts, abs=0.001
    )


@pytest.mark.parametrize("dim", [0.2, 0.02], ids=["apart", "overlapping"])
def test_Ts_is_scaled_and_shifted_with_the_samples_and_their_order_does_not_count(
    dim: float,
) -> None:
    rng = np.random.default_rng(3)
    shadows, lit = rng.uniform(0.0, 0.03, 500), rng.uniform(dim, 0.4, 500)
    for kinds in ((shadows,), (shadows, lit)):
        level = sample_shadow_level(*kinds)
        scaled = sample_shadow_level(*(0.5 * kind for kind in kinds))
        moved = sample_shadow_level(*(kind + 0.1 for kind in kinds))
        mixed = sample_shadow_level(*(rng.permutation(kind) for kind in kinds))
        assert scaled.Ts == pytest.approx(0.5 * level.Ts, abs=1e-5)
        assert moved.Ts == pytest.approx(level.Ts + 0.1, abs=1e-5)
        assert mixed.Ts == pytest.approx(level.Ts, rel=1e-12)
        assert scaled.error == moved.error == mixed.error == level.error


def test_the_dimmer_the_lit_samples_the_lower_Ts() -> None:
    rng = np.random.default_rng(4)
    shadows, lit = rng.normal(0.05, 0.005, 800), rng.uniform(0.04, 0.1, 800)
    found = [sample_shadow_level(shadows, lit - d).Ts for d in (-0.05, -0.01, 0.0)]
    assert (np.diff(found) < 0).all()


def test_shadows_clipped_at_black_show_their_noise_above_their_middle() -> None:
    noise = np.random.default_rng(5).normal(0, 0.01, 5000)
    clipped, whole = sample_shadow_level(np.clip(noise, 0, 1)), sample_shadow_level(noise + 0.1)
    assert clipped.Ts == pytest.approx(0.03, rel=0.05)
    assert whole.Ts == pytest.approx(0.13, rel=0.01)


def test_a_few_lit_pixels_among_the_shadows_do_not_move_Ts() -> None:
    shadows = np.random.default_rng(6).normal(0.02, 0.002, 500)
    spoilt = np.concatenate([shadows, np.full(20, 0.4)])
    level = sample_shadow_level(spoilt)
    assert level.Ts == pytest.approx(sample_shadow_level(shadows).Ts, abs=0.001)
    assert level.error == pytest.approx(20 / 520, abs=0.005)


@pytest.mark.parametrize("shadow", [0.0, 1 / 255, 0.3, 1.0])
def test_one_gray_level_of_shadow_is_below_Ts_and_the_next_one_is_lit(shadow: float) -> None:
    level = sample_shadow_level(np.full(25, shadow, np.float32))
    assert 0 < level.Ts < 1
    Thresholds(0.05, level.Ts)
    if shadow < 1:
        assert np.float32(shadow) < np.float32(level.Ts) < shadow + 1 / 65535
        assert level.error == 0
    tight = sample_shadow_level(np.array([0.5]), np.array([0.5 + 1e-7]))
    assert 0.5 < tight.Ts <= 0.5 + 1e-7


@pytest.mark.parametrize("lit", [0.0, 0.1])
def test_lit_pixels_darker_than_all_shadows_give_a_Ts_that_can_be_set(lit: float) -> None:
    level = sample_shadow_level(np.array([0.9, 1.0]), np.array([lit, lit]))
    Thresholds(0.05, level.Ts)
    assert level.error == pytest.approx(0.5)


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("kind", ["sphere_cone", "cup", "pot", "sphere_obstacles"])
def test_a_few_true_shadows_give_nearly_the_labels_of_the_suggested_Ts(
    kind: str, noise: float
) -> None:
    scene = render_scene(kind, size=(60, 80), images=9, noise=noise, bits=8 if noise else 16)
    result = analyze(scene.stack)
    dark = np.isin(scene.truth.labels, (Factor.ATTACHED, Factor.CAST))
    rows = np.random.default_rng(7).choice(np.flatnonzero(dark), 150, replace=False)
    T, suggested = result.thresholds.T, result.thresholds.Ts
    found = sample_shadow_level(scene.stack.images.ravel()[rows]).Ts
    given, other = (
        label_images(
            scene.stack.images,
            result.linearized_bases,
            result.coefficients,
            scene.stack.mask,
            Thresholds(T, Ts),
        )
        for Ts in (suggested, found)
    )
    assert found != suggested
    assert (given != other)[:, scene.stack.mask].mean() < 0.02
    right = [(labels == scene.truth.labels)[dark].mean() for labels in (given, other)]
    assert right[1] > right[0] - 0.01


def test_no_shadow_is_refused() -> None:
    with pytest.raises(OptionError, match="no shadow pixel is sampled"):
        sample_shadow_level(np.array([]), np.array([0.5]))


@pytest.mark.parametrize("value", [float("nan"), -0.1, 1.1, float("inf")])
def test_what_is_no_intensity_is_refused(value: float) -> None:
    for kinds in ((np.array([0.1, value]), None), (np.array([0.1]), np.array([value]))):
        with pytest.raises(OptionError, match="fractions of full scale, 0 to 1, are accepted"):
            sample_shadow_level(*kinds)


def test_an_offset_is_subtracted_counted_and_kept_above_zero(tmp_path: Path) -> None:
    images = np.full((6, 4, 5), 0.5, np.float32)
    images[:, 0, 0] = 0.01
    np.save(tmp_path / "stack.npy", images)
    stack = load_stack(tmp_path / "stack.npy", LoadOptions(offset=0.02))
    np.testing.assert_allclose(stack.images[:, 1:], 0.48, rtol=1e-6)
    assert (stack.images[:, 0, 0] == 0).all()
    assert any("offset: 0.02 is subtracted" in note and "as 0: 6" in note for note in stack.notes)


@pytest.mark.parametrize("offset", [-0.1, 1.0, float("nan")])
def test_an_offset_out_of_range_is_refused(offset: float) -> None:
    with pytest.raises(OptionError, match="accepted is 0 to below 1"):
        LoadOptions(offset=offset)
