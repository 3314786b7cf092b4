"""Pictures of a shape: each pixel's colour from its numbers."""

import io
from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
from PIL import Image

from photolin.shape.recover import Shape
from photolin.shape.relight import relight
from photolin.shape.resolved import Resolved
from webapp.render import encode_png
from webapp.state import SURFACE, Layer
from webapp.surface import UNKNOWN, range_of, render_grey, render_normals, render_surface

H, W = 12, 16
MASK = np.ones((H, W), bool)
MASK[:2] = False


def decode(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)))


def make_shape(**changes: Any) -> Shape:
    """Random normals that face the camera, one pixel (5, 5) unknown."""
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(H, W, 3))
    normals[..., 2] = np.abs(normals[..., 2]) + 0.2
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    albedo = rng.uniform(0.2, 0.9, (H, W))
    normals[~MASK], albedo[~MASK] = 0, 0
    normals[5, 5], albedo[5, 5] = np.nan, np.nan
    depth = np.where(MASK & np.isfinite(albedo), rng.normal(size=(H, W)), np.nan)
    given = {
        "normals": normals.astype(np.float32),
        "albedo": albedo.astype(np.float32),
        "depth": depth.astype(np.float32),
        "lights": np.eye(3),
        "resolved": Resolved(np.eye(3), "lights", 0.0, True, "by lights"),
    }
    return Shape(**(given | changes))


SHAPE = make_shape()


def test_axes_of_normals_are_red_right_green_up_blue_to_the_camera() -> None:
    normals = np.array([[[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0]]], np.float32)
    colours = render_normals(normals, np.ones((1, 5), bool))[0].tolist()
    assert colours == [[255, 128, 128], [128, 255, 128], [128, 128, 255], [0, 128, 128],
                       [128, 0, 128]]  # fmt: skip


def test_normals_are_read_back_from_their_colours() -> None:
    colours, text = render_surface(SHAPE, "normals", (0, 0), MASK)
    known = MASK & np.isfinite(SHAPE.albedo)
    back = (colours[known] - 128.0) / 127.5
    assert np.abs(back - SHAPE.normals[known]).max() <= 1 / 127.5
    assert "green y up" in text


@pytest.mark.parametrize("layer", SURFACE)
def test_outside_the_mask_is_black_unknown_is_grey_and_nothing_is_changed(layer: Layer) -> None:
    before = [np.copy(a) for a in (SHAPE.normals, SHAPE.albedo)]
    picture, text = render_surface(SHAPE, layer, (0.3, 0.2), MASK)
    assert picture.dtype == np.uint8
    assert not picture[~MASK].any()
    assert (picture[5, 5] == UNKNOWN).all()
    assert layer in text
    for stored, then in zip((SHAPE.normals, SHAPE.albedo), before, strict=True):
        np.testing.assert_array_equal(stored, then)


def test_relit_is_the_backends_image_at_the_brightness_of_the_albedo() -> None:
    x, y = -0.6, 0.48
    picture, text = render_surface(SHAPE, "relit", (x, y), MASK)
    lit = relight(SHAPE, (x, y, 0.64))
    white = np.percentile(SHAPE.albedo[MASK & np.isfinite(SHAPE.albedo)], 99.5)
    expected = np.clip(255 * np.maximum(lit, 0) / white, 0, 255)
    known = MASK & np.isfinite(lit)
    assert np.abs(picture[known] - expected[known]).max() <= 0.51
    assert "x -0.60 right, y 0.48 up, z 0.64" in text
    assert (picture[known][lit[known] < 0] == 0).all()


def test_light_from_the_rim_or_beyond_lies_in_the_picture_plane() -> None:
    inside = render_surface(SHAPE, "relit", (1.0, 0.0), MASK)
    assert "z 0.00" in inside[1]


def test_depth_runs_from_black_to_white_in_its_unit() -> None:
    ramp = np.broadcast_to(np.arange(W, dtype=np.float32), (H, W)).copy()
    picture, text = render_surface(make_shape(depth=ramp), "depth", (0, 0), np.ones((H, W), bool))
    assert (np.diff(picture.astype(int), axis=1) > 0).all()
    assert (picture[0, 0], picture[0, -1]) == (0, 255)
    assert "px" in text
    in_mm = render_surface(make_shape(depth=ramp, px_mm=0.1), "depth", (0, 0), MASK)[1]
    assert "white 1.5 mm" in in_mm


def test_without_depth_the_picture_says_so() -> None:
    picture, text = render_surface(make_shape(depth=None), "depth", (0, 0), MASK)
    assert not picture.any()
    assert text == "depth was not computed"


@pytest.mark.parametrize("layer", SURFACE)
def test_a_shape_of_nothing_known_is_still_a_picture(layer: Layer) -> None:
    nothing = make_shape(
        normals=np.full((H, W, 3), np.nan, np.float32),
        albedo=np.full((H, W), np.nan, np.float32),
        depth=np.full((H, W), np.nan, np.float32),
    )
    picture, _ = render_surface(nothing, layer, (0, 0), MASK)
    assert (picture[MASK] == UNKNOWN).all()


def test_greys_are_clipped_at_black_and_white_only_on_screen() -> None:
    values = np.array([[-1, 0, 0.5, 1, 7, np.nan]], np.float32)
    assert render_grey(values, np.ones((1, 6), bool))[0].tolist() == [0, 0, 128, 255, 255, UNKNOWN]


def test_a_range_leaves_out_extremes_and_what_is_not_finite() -> None:
    values = np.concatenate([np.linspace(0, 1, 1001), [np.nan, np.inf]])
    assert range_of(values, 1.0) == pytest.approx((0.005, 0.995))
    assert range_of(np.array([np.nan]), 0.0) == (0.0, 1.0)
    assert range_of(np.zeros(4), 2.0) == (0.0, 2.0)


def test_every_layer_of_a_shape_is_a_layer_of_the_tool() -> None:
    assert set(SURFACE) < set(get_args(Layer))
    brighter = replace(SHAPE, albedo=SHAPE.albedo * 5)
    one, other = (render_surface(s, "albedo", (0, 0), MASK)[0] for s in (SHAPE, brighter))
    assert np.abs(one.astype(int) - other).max() <= 1


@pytest.mark.parametrize("layer", SURFACE)
def test_pictures_can_be_encoded_whatever_the_order_of_the_arrays(layer: Layer) -> None:
    turned = make_shape(
        normals=np.moveaxis(np.moveaxis(SHAPE.normals, 2, 0).copy(), 0, 2),
        albedo=np.asfortranarray(SHAPE.albedo),
        depth=np.asfortranarray(SHAPE.depth),
    )
    picture, _ = render_surface(turned, layer, (0.3, 0.2), MASK)
    assert np.array_equal(
        decode(encode_png(picture)), render_surface(SHAPE, layer, (0.3, 0.2), MASK)[0]
    )
