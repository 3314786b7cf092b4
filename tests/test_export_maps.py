"""Normals, albedo and depth in files, as other readers read them."""

import io
from typing import Any

import imagecodecs
import numpy as np
import pytest
import tifffile
from PIL import Image

from photolin.errors import InputError, OptionError
from photolin.export.maps import (
    albedo_png,
    albedo_tiff,
    depth_tiff,
    normals_npz,
    normals_png,
    normals_tiff,
)

H, W = 6, 9
f32 = np.float32
rng = np.random.default_rng(0)
NORMALS = rng.normal(size=(H, W, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=2, keepdims=True)
NORMALS[0] = 0
NORMALS[1, 2] = np.nan
THERE = np.ones((H, W), bool)
THERE[0] = THERE[1, 2] = False
ALBEDO = rng.uniform(0, 0.8, (H, W))
ALBEDO[0] = 0
ALBEDO[1, 2] = np.nan


def page(data: bytes) -> tuple[np.ndarray, str]:
    with tifffile.TiffFile(io.BytesIO(data)) as tiff:
        assert len(tiff.pages) == 1
        return tiff.asarray(), str(tiff.pages[0].aspage().description)


def test_float_tiffs_hold_every_value_and_name_axes_and_unit() -> None:
    colour = np.stack([ALBEDO, 2 * ALBEDO, 0 * ALBEDO], axis=2)
    for data, expected, words in (
        (normals_tiff(NORMALS), NORMALS, "x right, y up, z to the camera"),
        (albedo_tiff(ALBEDO), ALBEDO, "albedo, linear"),
        (albedo_tiff(colour), colour, "albedo, linear"),
        (depth_tiff(-7 * ALBEDO, "mm"), -7 * ALBEDO, "unit: mm; z of x right, y up, z to the c"),
        (depth_tiff(ALBEDO, "pixels"), ALBEDO, "unit: pixels"),
    ):
        values, text = page(data)
        assert values.dtype == f32
        np.testing.assert_array_equal(values, expected.astype(f32))
        assert words in text


def test_npz_holds_normals_mask_and_axes_and_equal_ones_are_equal_bytes() -> None:
    data = normals_npz(NORMALS, THERE)
    with np.load(io.BytesIO(data), allow_pickle=False) as stored:
        np.testing.assert_array_equal(stored["normals"], NORMALS.astype(f32))
        np.testing.assert_array_equal(stored["mask"], THERE)
        assert str(stored["axes"]) == "x right, y up, z to the camera"
    assert normals_npz(NORMALS.copy(), THERE) == data


def test_png_normals_come_back_to_a_65535th_and_directx_flips_green_alone() -> None:
    values = imagecodecs.png_decode(normals_png(NORMALS))
    assert (values.shape, values.dtype) == ((H, W, 3), np.uint16)
    back = values / 65535 * 2 - 1
    np.testing.assert_allclose(back[THERE], NORMALS[THERE], atol=1 / 65535)
    assert (values[~THERE] == 0).all()
    flipped = imagecodecs.png_decode(normals_png(NORMALS, "directx"))
    assert (flipped[~THERE] == 0).all()
    np.testing.assert_array_equal(flipped[..., [0, 2]], values[..., [0, 2]])
    np.testing.assert_allclose(
        flipped[THERE][:, 1], 65535.0 - values[THERE][:, 1].astype(float), atol=1
    )


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (normals_png(NORMALS), "red x right, green y up (OpenGL), blue z to the camera"),
        (normals_png(NORMALS, "directx"), "red x right, green y down (DirectX), blue z"),
        (albedo_png(ALBEDO, 0.9), "albedo = 0.9 * value / 65535"),
    ],
)
def test_png_texts_are_read_by_pillow(data: bytes, words: str) -> None:
    image = Image.open(io.BytesIO(data))
    image.load()  # checks the sums of all chunks
    assert words in image.info["Description"]
    assert ("gamma" in image.info) == ("albedo" in words)


def test_png_albedo_is_linear_with_a_scale_that_the_file_tells() -> None:
    for albedo in (ALBEDO, np.stack([ALBEDO, 0.3 * ALBEDO, 2 * ALBEDO], axis=2)):
        data = albedo_png(albedo)
        values = imagecodecs.png_decode(data)
        text = Image.open(io.BytesIO(data)).info["Description"]
        white = float(text.split("= ")[1].split(" *")[0])
        assert white == np.nanmax(albedo)
        assert values.max() == 65535
        expected = np.nan_to_num(albedo)
        np.testing.assert_allclose(white * values / 65535, expected, atol=white / 65535)
    clipped = imagecodecs.png_decode(albedo_png(ALBEDO, 0.4))
    np.testing.assert_array_equal(clipped == 65535, ALBEDO > 0.4 - 1e-6)
    for dark in (np.zeros((H, W)), np.full((H, W), np.nan)):
        assert not imagecodecs.png_decode(albedo_png(dark)).any()


def test_the_order_of_arrays_in_memory_does_not_matter() -> None:
    columns_first, reversed_rows = np.asfortranarray(NORMALS), NORMALS[::-1].copy()[::-1]
    for encode in (normals_tiff, normals_png, albedo_tiff, albedo_png):
        assert encode(columns_first) == encode(reversed_rows) == encode(NORMALS)
    assert depth_tiff(np.asfortranarray(ALBEDO), "mm") == depth_tiff(ALBEDO, "mm")


def test_what_cannot_be_encoded_is_refused() -> None:
    flat: Any = NORMALS[:, :, 0]
    for call in (
        lambda: normals_tiff(flat),
        lambda: normals_png(NORMALS[:, :, :2]),
        lambda: normals_npz(flat, THERE),
        lambda: normals_npz(NORMALS, THERE[1:]),
        lambda: albedo_tiff(NORMALS[None]),
        lambda: albedo_png(NORMALS[:, :, :2]),
        lambda: depth_tiff(NORMALS, "mm"),
    ):
        with pytest.raises(InputError, match=r"shape.* accepted"):
            call()
    wrong: Any = "inches"
    with pytest.raises(OptionError, match="accepted are opengl, directx"):
        normals_png(NORMALS, wrong)
    with pytest.raises(OptionError, match="accepted are mm, pixels"):
        depth_tiff(flat, wrong)
    for white in (0, -1, np.inf, np.nan):
        with pytest.raises(OptionError, match="accepted is an albedo above 0"):
            albedo_png(ALBEDO, white)
