"""Pointed-out pixels: all of the mask in the box, each kind for itself, bounded in number."""

from dataclasses import replace
from html import unescape

import numpy as np
import pytest

from photolin.shadow_level import ShadowLevel
from photolin.stack import ImageStack
from photolin.synthetic import render_scene
from webapp import sampling
from webapp.box import Box
from webapp.sampling import (
    COLOURS,
    Sample,
    pool_samples,
    take_sample,
    tell_level,
    tell_sampling,
)

STACK = render_scene("sphere_cone", size=(24, 32), images=6).stack


def masked() -> ImageStack:
    mask = np.zeros((24, 32), bool)
    mask[5:9, 10:20:3] = True
    return replace(STACK, mask=mask)


def taken(*arguments: object, stack: ImageStack = STACK) -> Sample:
    found = take_sample(stack, *arguments)  # type: ignore[arg-type]
    assert found is not None
    return found


@pytest.mark.parametrize("box", [Box(3, 9, 7, 18), Box(0, 24, 0, 32), Box(23, 24, 31, 32)])
def test_a_sample_holds_every_pixel_of_its_box_in_its_image(box: Box) -> None:
    found = taken("lit", 4, box)
    part = STACK.images[4, box.row0 : box.row1, box.column0 : box.column1]
    np.testing.assert_array_equal(found.values, part.ravel())
    assert found.count == part.size
    assert not found.values.flags.writeable


def test_pixels_outside_the_mask_are_left_out_and_a_box_without_any_is_none() -> None:
    stack = masked()
    found = taken("shadow", 2, Box(6, 24, 0, 15), stack=stack)
    np.testing.assert_array_equal(found.values, stack.images[2, 6:9, [10, 13]].T.ravel())
    assert take_sample(stack, "shadow", 2, Box(0, 5, 0, 32)) is None
    assert take_sample(stack, "shadow", 2, Box(5, 9, 11, 13)) is None


def test_kinds_are_pooled_each_for_itself() -> None:
    boxes = [
        ("shadow", 0, Box(0, 2, 0, 3)),
        ("lit", 1, Box(4, 6, 5, 6)),
        ("shadow", 5, Box(7, 8, 0, 2)),
    ]
    samples = [taken(*box) for box in boxes]
    expected = np.concatenate([STACK.images[0, 0:2, 0:3].ravel(), STACK.images[5, 7, 0:2]])
    np.testing.assert_array_equal(pool_samples(samples, "shadow"), expected)
    np.testing.assert_array_equal(pool_samples(samples, "lit"), STACK.images[1, 4:6, 5])
    assert pool_samples([], "lit").size == 0
    assert pool_samples(samples[:1], "lit").size == 0


def test_large_boxes_are_counted_whole_and_thinned_evenly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sampling, "MOST", 300)
    found = taken("lit", 3, Box(0, 24, 0, 32))
    assert found.count == 24 * 32
    assert found.values.size == 300
    everything = STACK.images[3].ravel()
    assert np.isin(found.values, everything).all()
    assert found.values[0] == everything[0]
    assert found.values[-1] == everything[-1]
    spread = np.quantile(everything, [0.2, 0.5, 0.8])
    np.testing.assert_allclose(np.quantile(found.values, [0.2, 0.5, 0.8]), spread, atol=0.05)
    assert pool_samples([found] * 9, "lit").size == 1200


def test_the_counts_of_each_kind_are_told_and_what_a_drag_does() -> None:
    boxes = (
        ("shadow", 0, Box(0, 2, 0, 3)),
        ("lit", 1, Box(4, 6, 5, 6)),
        ("lit", 1, Box(7, 8, 0, 2)),
    )
    samples = tuple(taken(*box) for box in boxes)
    html = "".join(tell_sampling("lit", samples, "a < b"))
    told = unescape(html)
    assert "Shadows: 6 pixels in 1 sample<" in told
    assert "Lit pixels: 4 pixels in 2 samples<" in told
    assert f"border-left:4px solid {COLOURS['lit']}" in told
    assert "a < b" in told
    assert "a < b" not in html
    nothing = unescape("".join(tell_sampling(None, (), "")))
    assert "Not sampling" in nothing
    assert "Shadows: none" in nothing


def test_the_level_found_is_told_beside_the_one_that_is_set() -> None:
    told = unescape(tell_level(ShadowLevel(0.0312, 0.025), 0.02))
    assert "Ts 0.0312 (line): 2.5% of the samples" in told
    told = unescape(tell_level(ShadowLevel(7.6e-6, 0.0), 0.02))
    assert "Ts 7.6e-06 (line): no sample on the wrong side. Now 0.0200 (dashed)." in told
