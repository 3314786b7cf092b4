"""load_stack as a whole: laws, decisions it states, refusals, real stacks."""

import hashlib
import os
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
import pytest
from PIL import Image

from photolin.errors import InputError, OptionError
from photolin.load import LoadOptions, load_stack
from photolin.load.transfer import decode_srgb
from photolin.stack import ImageStack

H, W = 6, 8
STACK = np.random.default_rng(3).integers(30, 256, (8, H, W, 3), np.uint8)
ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "data"


def png(path: Path, pixels: np.ndarray) -> Path:
    path.write_bytes(imagecodecs.png_encode(pixels))
    return path


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Eight 8-bit RGB images, img0.png to img7.png, equal to STACK."""
    (tmp_path / "vase").mkdir()
    for k, pixels in enumerate(STACK):
        png(tmp_path / f"vase/img{k}.png", pixels)
    return tmp_path / "vase"


def test_a_scaled_input_gives_a_scaled_stack(tmp_path: Path) -> None:
    base = np.random.default_rng(1).random((6, H, W))
    np.save(tmp_path / "a.npy", base)
    np.save(tmp_path / "b.npy", base * 0.25)
    a, b = load_stack(tmp_path / "a.npy"), load_stack(tmp_path / "b.npy")
    np.testing.assert_array_equal(a.images * np.float32(0.25), b.images)


def test_reading_twice_gives_the_same_bytes(folder: Path) -> None:
    first, second = load_stack(folder), load_stack(str(folder))
    assert first.images.tobytes() == second.images.tobytes()
    assert (first.files, first.notes, first.names) == (second.files, second.notes, second.names)


def test_every_file_is_listed_with_its_hash(folder: Path) -> None:
    png(folder / "mask.png", np.full((H, W), 255, np.uint8))
    stack = load_stack(folder)
    paths = [*(folder / f"img{k}.png" for k in range(8)), folder / "mask.png"]
    assert stack.files == tuple(
        (str(path), hashlib.sha256(path.read_bytes()).hexdigest()) for path in paths
    )


def test_progress_ends_at_1(folder: Path) -> None:
    seen: list[tuple[str, float]] = []
    load_stack(folder, progress=lambda stage, fraction: seen.append((stage, fraction)))
    assert seen == [("load", k / 8) for k in range(1, 9)]


def test_progress_may_stop_the_reading(folder: Path) -> None:
    def stop(stage: str, fraction: float) -> None:
        raise InterruptedError(stage)

    with pytest.raises(InterruptedError, match="load"):
        load_stack(folder, progress=stop)


def test_a_white_image_stays_1_by_every_rule(folder: Path) -> None:
    png(folder / "img0.png", np.full((H, W, 3), 255, np.uint8))
    for channel in ("mean", "luminance", "max", "r", "g", "b"):
        stack = load_stack(folder, LoadOptions(channel=channel))
        np.testing.assert_allclose(stack.images[0], 1, atol=1e-6)
        assert stack.images.max() <= 1
        assert not any(note.startswith("scale") for note in stack.notes)


def test_luminance_weighs_linear_values(folder: Path) -> None:
    stack = load_stack(folder, LoadOptions(channel="luminance", transfer="srgb"))
    expected = decode_srgb(STACK / 255) @ [0.2126, 0.7152, 0.0722]
    np.testing.assert_allclose(stack.images, expected, atol=1e-6)
    assert "transfer: srgb (as asked)" in stack.notes
    assert "channel: luminance of red, green and blue" in stack.notes


def test_auto_says_what_it_chose_and_why(folder: Path, tmp_path: Path) -> None:
    stack = load_stack(folder)
    np.testing.assert_allclose(stack.images, STACK.mean(-1) / 255, atol=1e-6)
    assert "transfer: linear (8-bit PNG without an sRGB or gamma tag)" in stack.notes
    (tmp_path / "photos").mkdir()
    for k in range(6):
        flat = np.full((16, 16, 3), 100 + k, np.uint8)
        Image.fromarray(flat).save(tmp_path / f"photos/{k}.jpg", quality=100)
    photos = load_stack(tmp_path / "photos")
    np.testing.assert_allclose(photos.images[0], decode_srgb(np.array(100 / 255)), atol=5e-3)
    assert "transfer: srgb (JPEG)" in photos.notes


def test_files_that_ask_for_different_transfers_are_refused(folder: Path) -> None:
    (folder / "img5.png").unlink()
    for k in range(8, 15):
        png(folder / f"img{k}.png", STACK[0])
    data = (folder / "img9.png").read_bytes()
    tag = b"\0\0\0\1sRGB\0\xae\xce\x1c\xe9"
    (folder / "img9.png").write_bytes(data[:33] + tag + data[33:])
    with pytest.raises(InputError, match=r"img9\.png: is srgb .* but .*img0\.png is linear"):
        load_stack(folder)
    assert load_stack(folder, LoadOptions(transfer="linear")).shape[0] == 14


def test_a_dark_frame_is_subtracted_and_counted(folder: Path, tmp_path: Path) -> None:
    dark = np.full((H, W, 3), 20, np.uint8)
    dark[0, 0] = 255
    png(folder / "ambient.png", dark)
    stack = load_stack(folder)
    expected = (STACK.astype(float) - dark).mean(-1) / 255
    np.testing.assert_allclose(stack.images, np.maximum(expected, 0), atol=1e-6)
    below = int((expected < 0).sum())
    assert below >= 1
    assert "dark frame: ambient.png is subtracted" in stack.notes
    assert f"dark frame: observations below it, taken as 0: {below}" in stack.notes
    other = png(tmp_path / "other.png", np.full((H, W, 3), 10, np.uint8))
    replaced = load_stack(folder, LoadOptions(dark=other))
    np.testing.assert_allclose(replaced.images, (STACK.mean(-1) - 10) / 255, atol=1e-6)


def test_dark_frames_are_subtracted_after_linearizing(folder: Path) -> None:
    png(folder / "dark.png", np.full((H, W, 3), 25, np.uint8))
    stack = load_stack(folder, LoadOptions(transfer="srgb"))
    expected = (decode_srgb(STACK / 255) - decode_srgb(np.array(25 / 255))).mean(-1)
    np.testing.assert_allclose(stack.images, expected, atol=1e-6)


def test_negative_floats_are_counted(tmp_path: Path) -> None:
    images = np.full((6, H, W), 0.5, np.float32)
    images[2, 3, 4] = -0.1
    np.save(tmp_path / "a.npy", images)
    stack = load_stack(tmp_path / "a.npy")
    assert stack.images[2, 3, 4] == 0
    assert "values: observations below 0, taken as 0: 1" in stack.notes


def test_a_region_is_cut_from_images_and_mask(folder: Path) -> None:
    mask = np.zeros((H, W), np.uint8)
    mask[2:, 3:] = 1
    png(folder / "mask.png", mask)
    whole, part = load_stack(folder), load_stack(folder, LoadOptions(roi=(1, 4, 2, 8)))
    np.testing.assert_array_equal(part.images, whole.images[:, 1:4, 2:8])
    np.testing.assert_array_equal(part.mask, mask[1:4, 2:8] > 0)
    assert "region: rows 1 to 3, columns 2 to 7" in part.notes
    with pytest.raises(InputError, match=r"region of interest: the mask is empty"):
        load_stack(folder, LoadOptions(roi=(0, 2, 0, 3)))
    with pytest.raises(OptionError, match="rows up to 6 and columns up to 8"):
        load_stack(folder, LoadOptions(roi=(0, 7, 0, 8)))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"channel": "hue"}, "channel is 'hue'; accepted are mean, luminance, max"),
        ({"transfer": "gamma"}, "transfer is 'gamma'; accepted are auto, linear, srgb"),
        ({"roi": (3, 3, 0, 1)}, r"roi is \(3, 3, 0, 1\); accepted is row0 row1 col0 col1"),
        ({"roi": (-1, 3, 0, 1)}, "with 0 <= row0"),
    ],
)
def test_options_out_of_range_are_refused(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(OptionError, match=words):
        LoadOptions(**wrong)


def test_paths_that_hold_no_stack_are_refused(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "a.txt").write_text("x")
    for path, words in (
        (tmp_path / "nowhere", "nowhere: does not exist; a folder of images"),
        (tmp_path / "empty", r"empty: holds no images; accepted are \.png"),
        (tmp_path / "a.txt", r"a\.txt: is not a stack; a folder of images"),
        (folder / "img0.png", r"img0\.png: is a single image; a folder of images"),
        (tmp_path / ("x" * 300), "x: cannot be read"),
    ):
        with pytest.raises(InputError, match=words):
            load_stack(path)


def test_five_images_are_too_few(folder: Path) -> None:
    for k in range(3):
        (folder / f"img{k}.png").unlink()
    with pytest.raises(InputError, match="vase: holds 5 images; at least 6 are needed"):
        load_stack(folder)


@pytest.mark.parametrize(
    ("pixels", "words"),
    [
        (STACK[0, :-1], r"img4\.png: is 5 x 8 RGB uint8, but .*img0\.png is 6 x 8 RGB uint8"),
        (STACK[0].astype(np.uint16), r"img4\.png: is 6 x 8 RGB uint16, but .*img0\.png"),
        (STACK[0, ..., 0].copy(), r"img4\.png: is 6 x 8 gray uint8, but .*img0\.png"),
        (np.zeros((H, W, 3), np.uint8), r"img4\.png: is all black; take it out or replace it"),
    ],
)
def test_an_image_that_does_not_fit_is_named(folder: Path, pixels: np.ndarray, words: str) -> None:
    png(folder / "img4.png", pixels)
    with pytest.raises(InputError, match=words):
        load_stack(folder)


def test_a_broken_image_among_good_ones_is_named(folder: Path) -> None:
    whole = (folder / "img6.png").read_bytes()
    (folder / "img6.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"img6\.png: is truncated or not a PNG image"):
        load_stack(folder)


def test_an_image_that_is_a_link_to_nothing_or_a_pipe_is_named(folder: Path) -> None:
    (folder / "img3.png").unlink()
    (folder / "img3.png").symlink_to(folder / "gone.png")
    with pytest.raises(InputError, match=r"img3\.png: cannot be read \(No such file"):
        load_stack(folder)
    (folder / "img3.png").unlink()
    os.mkfifo(folder / "img3.png")
    with pytest.raises(InputError, match=r"img3\.png: is a folder or a device"):
        load_stack(folder)


@pytest.mark.parametrize("name", ["a.npy", "a.npz", "a.tif"])
def test_a_pipe_is_no_stack(tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / name)
    with pytest.raises(InputError, match="is not a stack"):
        load_stack(tmp_path / name)


def test_nan_is_refused_with_the_image(tmp_path: Path) -> None:
    images = np.full((6, H, W), 0.5)
    images[3, 1, 1] = np.nan
    np.save(tmp_path / "a.npy", images)
    with pytest.raises(InputError, match=r"a\.npy, image 3: holds NaN or infinity"):
        load_stack(tmp_path / "a.npy")


def test_an_image_darker_than_its_dark_frame_is_named(folder: Path) -> None:
    png(folder / "dark.png", np.full((H, W, 3), 40, np.uint8))
    png(folder / "img2.png", np.full((H, W, 3), 30, np.uint8))
    with pytest.raises(InputError, match=r"img2\.png: is all black once the dark frame is subtr"):
        load_stack(folder)


@pytest.mark.parametrize(
    ("mask", "words"),
    [
        (np.full((H, W - 1), 255, np.uint8), r"mask\.png: the mask is 6 x 7 .* images are 6 x 8"),
        (np.zeros((H, W), np.uint8), r"mask\.png: the mask is empty"),
    ],
)
def test_a_mask_that_does_not_fit_is_named(folder: Path, mask: np.ndarray, words: str) -> None:
    png(folder / "mask.png", mask)
    with pytest.raises(InputError, match=words):
        load_stack(folder)


def test_a_mask_with_smooth_edges_begins_above_half_of_its_maximum(folder: Path) -> None:
    mask = np.tile(np.array([0, 1, 50, 99, 100, 101, 150, 200], np.uint8), (H, 1))
    png(folder / "mask.png", mask)
    np.testing.assert_array_equal(load_stack(folder).mask, mask > 100)


@pytest.mark.parametrize("pixels", [STACK[0, :-1], STACK[0].astype(np.uint16)])
def test_a_dark_frame_that_does_not_fit_is_named(folder: Path, pixels: np.ndarray) -> None:
    png(folder / "dark.png", pixels)
    with pytest.raises(InputError, match=r"dark\.png: is . x 8 RGB uint.*, but .*img0\.png is"):
        load_stack(folder)


def real(name: str, **options: Any) -> ImageStack:
    if not (DATA / name).is_dir():
        pytest.skip(f"{DATA / name} is not there")
    return load_stack(DATA / name, LoadOptions(**options))


@pytest.mark.parametrize(
    ("name", "shape", "pixels", "note"),
    [
        ("diligent_ball", (96, 158, 158), 15791, "powers: each image is divided by its line"),
        ("diligent_cat", (96, 307, 282), 45200, "lights: light_directions.txt"),
        ("harvard_lizard", (20, 720, 660), 191208, "channel: the images are gray"),
        ("mit_apple", (10, 334, 334), 33475, "left out: diffuse.png, original.png, specular.png"),
        ("mit_cup2", (10, 400, 300), 41388, "transfer: linear (16-bit PNG without an sRGB"),
        ("pov_sphere_cone", (20, 120, 160), 19200, "mask: none, every pixel is used"),
        ("pov_sphere_obstacles", (24, 180, 240), 43200, "lights: not given"),
        ("uw_buddha", (12, 340, 512), 30056, "lights: lights.txt"),
    ],
)
def test_real_stacks_are_recognised(
    name: str, shape: tuple[int, int, int], pixels: int, note: str
) -> None:
    stack = real(name)
    assert (stack.shape, len(stack.pixels), stack.title) == (shape, pixels, name)
    assert any(line.startswith(note) for line in stack.notes), stack.notes


def test_the_buddha_comes_in_natural_order() -> None:
    assert real("uw_buddha").names == tuple(f"buddha.{k}.tga" for k in range(12))


@pytest.mark.parametrize("name", ["sphere_cone", "sphere_obstacles", "cup", "pot"])
def test_sample_data_are_recognised(name: str) -> None:
    truth = np.load(ROOT / "sample_data" / name / "gt.npz")
    stack = load_stack(ROOT / "sample_data" / name)
    assert stack.shape == truth["labels"].shape
    np.testing.assert_array_equal(stack.mask, truth["mask"])
