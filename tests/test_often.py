"""How often: counts of the labels on screen, their colours and words."""

from dataclasses import replace

import numpy as np
import pytest

from photolin.analysis import Options
from photolin.errors import Cancelled
from photolin.factors import OUTSIDE, Factor, Thresholds
from photolin.label import label_images
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp.often import (
    CLASSES,
    FEW,
    caption_often,
    count_often,
    label_all,
    render_often,
    share_classes,
)
from webapp.state import OFTEN

STACK = render_scene("sphere_cone", size=(24, 32), images=8).stack
RESULT = analyze(STACK, Options(T=0.05, Ts=0.02, samples=50))
HERE, THERE = RESULT.thresholds, Thresholds(0.004, 0.2)


@pytest.mark.parametrize("thresholds", [HERE, THERE])
def test_labels_of_all_images_are_the_backends(thresholds: Thresholds) -> None:
    expected = label_images(
        STACK.images, RESULT.linearized_bases, RESULT.coefficients, STACK.mask, thresholds
    )
    assert np.array_equal(label_all(STACK, RESULT, thresholds), expected)


@pytest.mark.parametrize("thresholds", [HERE, THERE])
def test_every_image_is_lit_or_in_shadow_or_undefined(thresholds: Thresholds) -> None:
    counts = {often: count_often(STACK, RESULT, thresholds, often) for often in OFTEN}
    whole = counts["lit"] + counts["any shadow"] + counts["undefined"]
    assert (whole[STACK.mask] == 8).all()
    shadows = counts["attached shadow"] + counts["cast shadow"]
    assert np.array_equal(shadows, counts["any shadow"])
    assert (counts["specular"] <= counts["lit"]).all()
    labels = label_all(STACK, RESULT, thresholds)
    for often, count in counts.items():
        assert np.array_equal(count, np.isin(labels, CLASSES[often]).sum(axis=0))
        assert count.any() or thresholds == HERE, often


@pytest.mark.parametrize("thresholds", [HERE, THERE])
@pytest.mark.parametrize("share", [0, 0.05, 0.6])
def test_counts_of_some_pixels_alone_are_those_of_all(share: float, thresholds: Thresholds) -> None:
    where = np.random.default_rng(0).random(STACK.mask.shape) < share
    for often in OFTEN:
        some = count_often(STACK, RESULT, thresholds, often, where)
        whole = count_often(STACK, RESULT, thresholds, often)
        assert np.array_equal(some[where], whole[where])
        assert share > FEW or not some[~where].any()


def test_outside_the_mask_nothing_is_counted_of_some_pixels_either() -> None:
    mask, where = STACK.mask.copy(), np.zeros(STACK.mask.shape, bool)
    mask[:, :2], where[:, :3] = False, True
    counts = count_often(replace(STACK, mask=mask), RESULT, THERE, "any shadow", where)
    assert not counts[:, :2].any()
    assert np.array_equal(counts[:, 2], count_often(STACK, RESULT, THERE, "any shadow")[:, 2])


def test_choices_and_classes_are_the_same_ones() -> None:
    assert tuple(CLASSES) == OFTEN
    assert CLASSES["lit"] == (Factor.DIFFUSE, Factor.SPECULAR)


def test_more_often_is_lighter_and_outside_the_mask_is_black() -> None:
    counts = np.arange(12, dtype=np.uint16).reshape(3, 4)
    count = 11
    mask = np.ones((3, 4), bool)
    mask[0, 1] = False
    picture = render_often(counts, count, mask)
    assert picture.shape == (3, 4, 3)
    assert picture[0, 1].tolist() == [0, 0, 0]
    assert picture[0, 0].tolist() == [0x44, 0x01, 0x54]
    assert picture[2, 3].tolist() == [0xFD, 0xE7, 0x25]
    light = (picture @ [0.2126, 0.7152, 0.0722])[mask]
    assert (np.diff(light) > 0).all()
    none = render_often(np.zeros((3, 4), np.uint16), count, np.ones((3, 4), bool))
    assert (none == [0x44, 0x01, 0x54]).all()


def test_a_count_has_one_colour_whatever_other_pixels_count() -> None:
    counts, mask = np.array([[0, 3, 6]], np.uint16), np.ones((1, 3), bool)
    picture = render_often(counts, 24, mask)
    assert picture[0, 2].tolist() == [0x22, 0x90, 0x8C]  # a quarter: the middle of the colours
    assert np.array_equal(render_often(counts[:, :2], 24, mask[:, :2]), picture[:, :2])


def test_the_caption_says_the_range_of_the_colours() -> None:
    counts = np.array([[0, 7], [3, 0]], np.uint16)
    colours = "in none (dark purple), a quarter (teal), all (yellow) of"
    assert caption_often(counts, 24, "specular") == f"specular {colours} 24 images, at most 7 here"
    words = f"cast shadow {colours} 8 images, at most 0 here"
    assert caption_often(0 * counts, 8, "cast shadow") == words


def test_outside_the_mask_nothing_is_counted() -> None:
    mask = STACK.mask.copy()
    mask[:, :5] = False
    labels = np.where(mask, RESULT.labels, np.uint8(OUTSIDE))
    assert all(not np.isin(labels, CLASSES[often])[:, :, :5].any() for often in OFTEN)


def test_shares_are_of_the_mask_and_add_up() -> None:
    mask = STACK.mask.copy()
    mask[:9] = False
    labels = np.where(mask, RESULT.labels, np.uint8(255))
    shares = share_classes(labels, mask, range(100, 108))
    assert list(shares) == list(range(100, 108))
    for k, share in shares.items():
        inside = labels[k - 100][mask]
        assert share.tolist() == [(inside == f).mean() for f in sorted(Factor)]
        assert share.sum() == pytest.approx(1)


def test_labelling_of_all_images_can_be_cancelled() -> None:
    with pytest.raises(Cancelled, match="labels was cancelled"):
        label_all(STACK, RESULT, Thresholds(0.1, 0.05), lambda: True)
