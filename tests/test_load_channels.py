"""The three channels of a stack one after another: the same numbers as together, and one scale."""

from dataclasses import replace
from pathlib import Path

import imagecodecs
import numpy as np
import pytest

from photolin.errors import InputError
from photolin.load import ChannelImages, LoadOptions, load_channels, load_stack

K, H, W = 7, 5, 6
RGB = np.random.default_rng(3).integers(2000, 60000, (K, H, W, 3), np.uint16)
FRACTIONS = (RGB / 65535).astype(np.float32)


def png(path: Path, pixels: np.ndarray) -> None:
    path.write_bytes(imagecodecs.png_encode(pixels))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for k, pixels in enumerate(RGB):
        png(tmp_path / f"{k}.png", pixels)
    return tmp_path


def read(path: Path, options: LoadOptions | None = None) -> list[ChannelImages]:
    return list(load_channels(path, options or LoadOptions()))


def test_channels_come_in_order_as_they_are_stored(folder: Path) -> None:
    found = read(folder)
    assert [c.channel for c in found] == ["r", "g", "b"]
    np.testing.assert_array_equal(np.stack([c.images for c in found], axis=3), FRACTIONS)
    assert all(c.images.dtype == np.float32 for c in found)


def test_their_mean_is_the_gray_stack(folder: Path) -> None:
    options = LoadOptions(transfer="srgb", roi=(1, 4, 0, 5), channel="g")
    mean = np.mean([c.images for c in read(folder, options)], axis=0)
    gray = load_stack(folder, replace(options, channel="mean"))
    np.testing.assert_allclose(mean, gray.images, atol=1e-6)


def test_powers_and_dark_frames_count_by_channel_without_a_scale_of_their_own(folder: Path) -> None:
    powers = np.random.default_rng(0).uniform(0.2, 3, (K, 3))
    np.savetxt(folder / "light_intensities.txt", powers)
    dark = np.full((H, W, 3), (100, 200, 300), np.uint16)
    png(folder / "dark.png", dark)
    found = read(folder)
    right = (FRACTIONS - dark / 65535) / powers[:, None, None, :]
    assert right.max() > 1
    for c, channel in enumerate(found):
        np.testing.assert_allclose(channel.images, right[..., c], rtol=1e-4)
        white = (1 - dark[0, 0, c] / 65535) / powers[:, c]
        np.testing.assert_allclose(channel.white, white, rtol=1e-5)


def test_full_scale_is_saturated_and_the_next_value_is_not(folder: Path) -> None:
    pixels = RGB[2].copy()
    pixels[0, 0], pixels[0, 1] = 65535, 65534
    png(folder / "2.png", pixels)
    np.savetxt(folder / "light_intensities.txt", np.full((K, 3), 0.7))
    for c in read(folder):
        saturated = c.images >= c.white[:, None, None]
        assert saturated[2, 0, 0]
        assert saturated.sum() == 1


def test_an_offset_is_subtracted_and_nothing_is_negative(folder: Path) -> None:
    for c, channel in enumerate(read(folder, LoadOptions(offset=0.3))):
        right = np.maximum(FRACTIONS[..., c] - np.float32(0.3), 0)
        np.testing.assert_allclose(channel.images, right, atol=1e-6)
        np.testing.assert_allclose(channel.white, 0.7, rtol=1e-5)


def test_a_channel_may_be_black_and_floats_do_not_saturate(tmp_path: Path) -> None:
    path = tmp_path / "stack.npy"
    np.save(path, FRACTIONS * np.float32(4) * (1, 1, 0))
    found = read(path)
    assert found[0].images.max() > 1
    assert (found[2].images == 0).all()
    assert np.isinf([c.white for c in found]).all()


def test_one_channel_is_held_at_a_time(folder: Path) -> None:
    """The others are not read before they are asked for."""
    channels = load_channels(folder)
    next(channels)
    png(folder / "4.png", RGB[4, :2])
    with pytest.raises(InputError, match=r"4\.png: is 2 x 6 RGB"):
        next(channels)


def test_progress_is_told_for_each_channel(folder: Path) -> None:
    told: list[float] = []
    list(load_channels(folder, progress=lambda stage, f: told.append(f)))
    assert told.count(1.0) == 3


def test_gray_images_have_no_channels(tmp_path: Path) -> None:
    for k in range(6):
        png(tmp_path / f"{k}.png", RGB[k, :, :, 0].copy())
    with pytest.raises(InputError, match=r"0\.png: is gray; images of red, green and blue"):
        read(tmp_path)
