"""Ts from pointed-out pixels, and a constant that lies on all images."""

from pathlib import Path

import numpy as np
import pytest

from photolin.errors import OptionError
from photolin.load import LoadOptions, load_stack
from photolin.shadow_level import sample_shadow_level


def test_separate_samples_are_parted_without_error() -> None:
    level = sample_shadow_level(np.array([0.0, 0.01, 0.02]), np.array([0.1, 0.3]))
    assert 0.02 < level.Ts <= 0.1
    assert level.error == 0


def test_overlapping_samples_give_the_smallest_share_of_wrong_ones() -> None:
    level = sample_shadow_level(np.array([0.0, 0.01, 0.02, 0.2]), np.array([0.1, 0.3]))
    assert 0.02 < level.Ts <= 0.1
    assert level.error == pytest.approx(1 / 8)


def test_shadows_alone_stay_below_their_level() -> None:
    shadows = np.random.default_rng(0).normal(0.02, 0.002, 200)
    level = sample_shadow_level(shadows)
    assert (shadows < level.Ts).all()
    assert level.Ts == pytest.approx(0.026, abs=0.003)


def test_no_shadow_is_refused() -> None:
    with pytest.raises(OptionError, match="no shadow pixel is sampled"):
        sample_shadow_level(np.array([]), np.array([0.5]))


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
