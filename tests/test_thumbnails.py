"""Thumbnails: means of blocks, each image where the sheet says it is."""

import base64
import io
from dataclasses import replace

import numpy as np
import pytest
from lambert import wrap
from PIL import Image

from photolin.errors import Cancelled
from photolin.synthetic import render_scene
from webapp.render import choose_gain, render_input
from webapp.thumbnails import COLUMNS, SIDE, Sheet, make_sheet, shrink

STACK = render_scene("sphere_cone", size=(70, 110), images=20).stack


def picture(sheet: Sheet) -> np.ndarray:
    data = base64.b64decode(sheet.url.removeprefix("data:image/jpeg;base64,"))
    return np.asarray(Image.open(io.BytesIO(data)))


def test_a_thumbnail_is_made_of_the_means_of_blocks() -> None:
    image = np.random.default_rng(0).random((12, 20), np.float32)
    np.testing.assert_allclose(
        shrink(image, 4), image.reshape(3, 4, 5, 4).mean(axis=(1, 3)), rtol=1e-5
    )
    assert np.array_equal(shrink(image, 1), image)
    border = shrink(image, 7)
    assert border.shape == (2, 3)
    assert border[1, 2] == pytest.approx(image[7:, 14:].mean(), rel=1e-5)
    np.testing.assert_allclose(shrink(np.full((11, 13), 0.3, np.float32), 5), 0.3, rtol=1e-6)


def test_each_image_is_at_its_place_on_the_sheet() -> None:
    sheet = make_sheet(STACK)
    (h, w), (down, across), pixels = sheet.size, sheet.grid, picture(make_sheet(STACK))
    assert (h, w, down, across) == (35, 55, 2, COLUMNS)
    assert pixels.shape == (down * h, across * w)
    gain = choose_gain(STACK.images, STACK.mask)
    assert sheet.gain == gain
    for k, image in enumerate(STACK.images):
        # as CSS places backgrounds: a share of what the sheet is larger than the element
        x, y = (float(part.rstrip("%")) / 100 for part in sheet.place(k).split())
        column, row = round(x * (across - 1) * w), round(y * (down - 1) * h)
        shown = pixels[row : row + h, column : column + w].astype(int)
        assert np.abs(shown - render_input(shrink(image, 2), gain)).mean() < 4
    assert f"background-size:{100 * across}% {100 * down}%" in sheet.css
    assert f"aspect-ratio:{w}/{h}" in sheet.css


@pytest.mark.parametrize(("count", "size"), [(6, (1, 4000)), (6, (4000, 1)), (6, (3, 2))])
def test_any_shape_of_picture_gets_thumbnails(count: int, size: tuple[int, int]) -> None:
    sheet = make_sheet(wrap(np.full((count, *size), 0.5, np.float32)))
    assert min(sheet.size) >= 1
    assert max(sheet.size) <= SIDE
    assert sheet.grid == (1, count)
    assert [sheet.place(k) for k in (0, count - 1)] == ["0% 0%", "100% 0%"]


@pytest.mark.parametrize("count", [96, 1000])
def test_large_stacks_stay_light(count: int) -> None:
    noise = np.random.default_rng(0).random((count, 96, 96), np.float32)
    assert len(make_sheet(wrap(noise)).url) < (1_100_000 if count > 96 else 1_000_000)
    smooth = np.tile(STACK.images[:1].repeat(16, axis=0), (count // 16 + 1, 1, 1))[:count]
    lit = replace(wrap(smooth), mask=STACK.mask)
    assert len(make_sheet(lit).url) < 500_000


def test_it_can_be_cancelled() -> None:
    with pytest.raises(Cancelled, match="the thumbnails were cancelled"):
        make_sheet(STACK, lambda: True)
