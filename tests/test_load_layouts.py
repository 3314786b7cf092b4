"""Folders, DiLiGenT, pages and arrays are recognised."""

from pathlib import Path

import imagecodecs
import numpy as np
import pytest
import tifffile

from photolin.errors import InputError
from photolin.load import LoadOptions, load_stack

H, W = 4, 5
STACK = np.random.default_rng(3).integers(100, 65536, (12, H, W), np.uint16)
MASK = np.zeros((H, W), np.uint8)
MASK[1:3, 1:4] = 255
LIGHTS = np.random.default_rng(4).normal(size=(12, 3)) + np.array([0, 0, 3])


def png(path: Path, pixels: np.ndarray) -> None:
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(imagecodecs.png_encode(pixels))


def numbered(folder: Path, name: str = "img{}.png", count: int = 12) -> Path:
    for k in range(count):
        png(folder / name.format(k + 1), STACK[k])
    return folder


def fractions(stack: np.ndarray = STACK) -> np.ndarray:
    return (stack / np.iinfo(stack.dtype).max).astype(np.float32)


def test_a_folder_is_read_in_natural_order(tmp_path: Path) -> None:
    stack = load_stack(numbered(tmp_path / "vase"))
    assert stack.names == tuple(f"img{k}.png" for k in range(1, 13))
    np.testing.assert_array_equal(stack.images, fractions())
    assert stack.title == "vase"
    assert stack.mask.all()
    assert stack.lights is None


def test_masks_truth_and_hidden_files_are_no_images(tmp_path: Path) -> None:
    numbered(tmp_path, "{}.png", 6)
    for name in ("normals", "vase_normal", "gt_depth", ".7", "._1"):
        png(tmp_path / f"{name}.png", STACK[0])
    png(tmp_path / "vase.mask.png", MASK)
    (tmp_path / "7.txt").write_text("notes")
    stack = load_stack(tmp_path)
    assert stack.names == tuple(f"{k}.png" for k in range(1, 7))
    np.testing.assert_array_equal(stack.mask, MASK > 0)
    assert "mask: vase.mask.png (6 of 20 pixels)" in stack.notes
    assert not any(note.startswith("left out") for note in stack.notes)


def test_a_word_that_all_names_share_gives_no_role(tmp_path: Path) -> None:
    stack = load_stack(numbered(tmp_path, "dark_mask_{}.png", 8))
    assert stack.shape == (8, H, W)
    assert stack.mask.all()


def test_files_beside_the_numbered_ones_are_left_out_aloud(tmp_path: Path) -> None:
    numbered(tmp_path, "light{:02d}.png", 10)
    png(tmp_path / "original.png", STACK[0])
    png(tmp_path / "diffuse.png", STACK[0])
    stack = load_stack(tmp_path)
    assert len(stack.names) == 10
    assert "left out: diffuse.png, original.png (named unlike light01.png)" in stack.notes


def test_names_without_a_common_number_are_all_taken(tmp_path: Path) -> None:
    for k, name in enumerate(("ash", "birch", "cedar", "elm", "fir", "oak", "pine")):
        png(tmp_path / f"{name}.PNG", STACK[k])
    np.testing.assert_array_equal(load_stack(tmp_path).images, fractions(STACK[:7]))


def test_two_stacks_in_a_folder_are_refused(tmp_path: Path) -> None:
    numbered(numbered(tmp_path, "left{}.png", 6), "right{}.png", 6)
    with pytest.raises(
        InputError, match=r"stacks of 6 images each, from left1\.png and right1\.png"
    ):
        load_stack(tmp_path)


def test_an_images_folder_is_read_with_what_lies_beside_it(tmp_path: Path) -> None:
    vase = tmp_path / "vase"
    vase.mkdir()
    numbered(vase / "images", "{:03d}.png")
    png(vase / "mask.png", MASK)
    np.savetxt(vase / "lights.txt", LIGHTS)
    np.savez(vase / "gt.npz", labels=np.zeros(3))
    stack = load_stack(vase)
    assert (stack.title, stack.shape) == ("vase", (12, H, W))
    np.testing.assert_array_equal(stack.mask, MASK > 0)
    assert stack.lights is not None
    np.testing.assert_allclose(stack.lights, LIGHTS)
    assert "lights: lights.txt" in stack.notes


def test_lights_can_be_ignored_or_replaced(tmp_path: Path) -> None:
    numbered(tmp_path / "a")
    (tmp_path / "a/lights.txt").write_text("nonsense")
    np.save(tmp_path / "mine.npy", LIGHTS)
    ignored = load_stack(tmp_path / "a", LoadOptions(lights="none"))
    assert ignored.lights is None
    assert "lights: ignored, as asked" in ignored.notes
    replaced = load_stack(tmp_path / "a", LoadOptions(lights=tmp_path / "mine.npy"))
    assert replaced.lights is not None
    np.testing.assert_array_equal(replaced.lights, LIGHTS)
    with pytest.raises(InputError, match=r"lights\.txt, line 1: 'nonsense'"):
        load_stack(tmp_path / "a")


def test_several_masks_need_the_option(tmp_path: Path) -> None:
    numbered(tmp_path)
    png(tmp_path / "mask_a.png", MASK)
    png(tmp_path / "mask_b.png", 255 - MASK)
    with pytest.raises(InputError, match=r"mask_a\.png and mask_b\.png could each be the mask"):
        load_stack(tmp_path)
    stack = load_stack(tmp_path, LoadOptions(mask=tmp_path / "mask_b.png"))
    np.testing.assert_array_equal(stack.mask, MASK == 0)
    png(tmp_path / "mask.png", MASK)
    np.testing.assert_array_equal(load_stack(tmp_path).mask, MASK > 0)


def diligent(folder: Path, powers: np.ndarray) -> Path:
    rgb = np.stack([STACK, STACK // 2, STACK // 4], axis=-1)
    order = [f"{name}.png" for name in "lkjihgfedcba"]
    for name, pixels in zip(order, rgb, strict=True):
        png(folder / name, pixels)
    png(folder / "mask.png", MASK)
    (folder / "filenames.txt").write_text("\r\n".join(order) + "\r\n")
    np.savetxt(folder / "light_directions.txt", LIGHTS, fmt="%.6f")
    np.savetxt(folder / "light_intensities.txt", powers)
    return folder


def test_diligent_images_are_divided_by_the_power_of_each_channel(tmp_path: Path) -> None:
    powers = np.random.default_rng(5).uniform(1, 3, (12, 3))
    stack = load_stack(diligent(tmp_path / "cat", powers))
    rgb = np.stack([STACK, STACK // 2, STACK // 4], axis=-1) / 65535
    expected = (rgb / powers[:, None, None]).mean(axis=-1)
    np.testing.assert_allclose(stack.images, expected, atol=1e-6)
    assert stack.lights is not None
    np.testing.assert_allclose(stack.lights, LIGHTS, atol=1e-6)
    np.testing.assert_array_equal(stack.mask, MASK > 0)
    assert stack.names[0] == "l.png"
    assert "powers: each image is divided by its line of light_intensities.txt" in stack.notes
    read = {Path(path).name for path, _ in stack.files}
    assert {"filenames.txt", "light_intensities.txt", "light_directions.txt", "mask.png"} < read


def test_weak_powers_lead_to_one_common_scale(tmp_path: Path) -> None:
    stack = load_stack(diligent(tmp_path, np.full((12, 3), 0.1)))
    expected = STACK / STACK.max()
    np.testing.assert_allclose(stack.images, expected, atol=1e-4)
    assert stack.images.max() == 1
    assert any(note.startswith("scale: values go up to 5.") for note in stack.notes)


def test_diligent_files_that_disagree_are_named(tmp_path: Path) -> None:
    folder = diligent(tmp_path, np.ones((12, 3)))
    np.savetxt(folder / "light_intensities.txt", np.ones((11, 3)))
    with pytest.raises(InputError, match=r"light_intensities\.txt: holds 11 powers for 12 images"):
        load_stack(folder)
    np.savetxt(folder / "light_intensities.txt", np.full((12, 3), 1e-45))
    with pytest.raises(InputError, match=r"l\.png: holds NaN or infinity"):
        load_stack(folder)
    np.savetxt(folder / "light_intensities.txt", np.zeros((12, 3)))
    with pytest.raises(InputError, match=r"light_intensities\.txt: .* from 0; .* positive"):
        load_stack(folder)
    (folder / "c.png").unlink()
    with pytest.raises(InputError, match=r"filenames\.txt: lists c\.png, which is not there"):
        load_stack(folder)


@pytest.mark.parametrize("bigtiff", [False, True])
def test_pages_of_a_tiff_are_images(tmp_path: Path, bigtiff: bool) -> None:
    tifffile.imwrite(tmp_path / "vase.tif", STACK, bigtiff=bigtiff)
    stack = load_stack(tmp_path / "vase.tif")
    np.testing.assert_array_equal(stack.images, fractions())
    assert (stack.names[0], stack.names[-1], stack.title) == ("page 001", "page 012", "vase")
    assert "transfer: linear (16-bit TIFF)" in stack.notes
    assert [Path(path).name for path, _ in stack.files] == ["vase.tif"]


def test_compressed_rgb_float_pages_above_1_get_one_scale(tmp_path: Path) -> None:
    rgb = np.random.default_rng(6).uniform(0, 7, (6, H, W, 3)).astype(np.float32)
    with tifffile.TiffWriter(tmp_path / "a.tiff") as tif:
        for page in rgb:
            tif.write(page, photometric="rgb", compression="zlib")
    stack = load_stack(tmp_path / "a.tiff", LoadOptions(channel="g"))
    np.testing.assert_allclose(stack.images, rgb[..., 1] / rgb[..., 1].max(), atol=1e-6)
    assert any(note.startswith("scale: values go up to 6.") for note in stack.notes)


def test_previews_in_a_tiff_are_passed_over(tmp_path: Path) -> None:
    with tifffile.TiffWriter(tmp_path / "a.tif") as tif:
        for page in STACK[:6]:
            tif.write(page)
            tif.write(page[::2, ::2], subfiletype=1)
    np.testing.assert_array_equal(load_stack(tmp_path / "a.tif").images, fractions(STACK[:6]))


def test_a_broken_tiff_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, np.tile(STACK, (1, 20, 20)))
    whole = path.read_bytes()
    for share in (0, 0.3, 0.9):
        path.write_bytes(whole[: int(len(whole) * share)])
        with pytest.raises(InputError, match=r"a\.tif.* is truncated"):
            load_stack(path)
    path.write_text("no TIFF")
    with pytest.raises(InputError, match=r"a\.tif: is truncated or not a TIFF file"):
        load_stack(path)
    tifffile.imwrite(path, STACK[:5])
    with pytest.raises(InputError, match=r"a\.tif: holds 5 images; at least 6"):
        load_stack(path)
    with tifffile.TiffWriter(path) as tif:
        for k in range(7):
            tif.write(STACK[k, : 3 if k == 4 else 4])
    with pytest.raises(
        InputError, match=r"page 005: is 3 x 5 gray uint16, but .*page 001 is 4 x 5"
    ):
        load_stack(path)


def test_arrays_are_read_with_their_mask_lights_and_names(tmp_path: Path) -> None:
    names = np.array([f"lamp {k}" for k in range(12)])
    np.savez_compressed(tmp_path / "a.npz", images=STACK, mask=MASK, lights=LIGHTS, names=names)
    stack = load_stack(tmp_path / "a.npz")
    np.testing.assert_array_equal(stack.images, fractions())
    np.testing.assert_array_equal(stack.mask, MASK > 0)
    assert stack.lights is not None
    np.testing.assert_array_equal(stack.lights, LIGHTS)
    assert stack.names == tuple(names)
    np.save(tmp_path / "b.npy", np.asfortranarray(STACK))
    np.testing.assert_array_equal(load_stack(tmp_path / "b.npy").images, fractions())


def test_a_colour_array_of_floats_is_joined(tmp_path: Path) -> None:
    rgb = np.random.default_rng(6).random((6, H, W, 3))
    np.save(tmp_path / "a.npy", rgb)
    stack = load_stack(tmp_path / "a.npy")
    np.testing.assert_allclose(stack.images, rgb.mean(-1), atol=1e-6)
    assert "transfer: linear (float array)" in stack.notes


def test_arrays_that_cannot_be_used_are_refused_in_words(tmp_path: Path) -> None:
    def refuse(name: str, words: str) -> None:
        with pytest.raises(InputError, match=words):
            load_stack(tmp_path / name)

    np.save(tmp_path / "a.npy", np.array([{}] * 6, object), allow_pickle=True)
    refuse("a.npy", r"a\.npy: the array is pickled Python objects, which could run code")
    np.savez(tmp_path / "a.npz", images=STACK, names=np.array([{}], object), allow_pickle=True)
    refuse("a.npz", r"a\.npz: names is pickled")
    np.savez(tmp_path / "b.npz", labels=STACK, ideal=STACK)
    refuse("b.npz", r"b\.npz: holds labels, ideal; an array called images")
    np.save(tmp_path / "b.npy", STACK[0])
    refuse("b.npy", r"b\.npy: the array is of shape \(4, 5\); \(images, rows, columns\)")
    np.save(tmp_path / "c.npy", STACK[:, :, :, None, None])
    refuse("c.npy", "is of shape")
    np.save(tmp_path / "d.npy", np.full((6, H, W), "x"))
    refuse("d.npy", r"the array is of type <U1; integers and floats")
    np.savez(tmp_path / "d.npz", images=STACK, names=np.array(["x"]))
    refuse("d.npz", r"d\.npz: holds 1 names for 12 images")
    np.savez(tmp_path / "e.npz", images=STACK, lights=LIGHTS[:5])
    refuse("e.npz", r"e\.npz: 5 lights for 12 images")
    np.savez(tmp_path / "f.npz", images=STACK, mask=MASK[:2])
    refuse("f.npz", r"f\.npz: the mask is 2 x 5 \(rows x columns\), the images are 4 x 5")
    whole = (tmp_path / "f.npz").read_bytes()
    (tmp_path / "g.npz").write_bytes(whole[:300])
    refuse("g.npz", r"g\.npz: is truncated or not a numpy file")
    (tmp_path / "g.npy").write_bytes((tmp_path / "b.npy").read_bytes()[:60])
    refuse("g.npy", r"g\.npy: is truncated or not a numpy file")


@pytest.mark.parametrize("huge", [1e39, 1e300, np.inf])
def test_values_beyond_single_precision_are_refused_without_a_warning(
    tmp_path: Path, huge: float
) -> None:
    images = STACK / 65535
    images[3, 1, 2] = huge
    np.save(tmp_path / "a.npy", images)
    with pytest.raises(InputError, match=r"image 3: holds NaN or infinity"):
        load_stack(tmp_path / "a.npy")


def test_nan_in_a_mask_is_outside(tmp_path: Path) -> None:
    mask = np.where(MASK > 0, 1.0, np.nan)
    np.savez(tmp_path / "a.npz", images=STACK, mask=mask)
    np.testing.assert_array_equal(load_stack(tmp_path / "a.npz").mask, MASK > 0)


def test_a_huge_array_is_refused_from_its_header(tmp_path: Path) -> None:
    for name, shape, words in (
        ("a.npy", (6, 50000, 60000), "claims 50000 x 60000 pixels; 1 to 200 million"),
        ("d.npy", (6, 0, 5), "claims 0 x 5 pixels"),
        ("b.npy", (3000, 1000, 1000), "3000 images of 1000 x 1000 pixels are too many"),
        ("c.npy", (6, 4, 5, 10**12), "is of shape"),
    ):
        with (tmp_path / name).open("wb") as file:
            header = {"descr": "<f8", "fortran_order": False, "shape": shape}
            np.lib.format.write_array_header_1_0(file, header)
        with pytest.raises(InputError, match=words):
            load_stack(tmp_path / name)
