"""Leaving images out: the same from files and from memory, in every layout; refusals."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image

from photolin import analyze, render_scene
from photolin.analysis import Options
from photolin.cli import main
from photolin.errors import DegenerateError, OptionError
from photolin.export import load_result, load_result_source, load_result_stack, result_npz
from photolin.load import LoadOptions, load_channels, load_stack
from photolin.load.exclude import exclude_images
from photolin.stack import ImageStack

K, H, W = 9, 20, 24
GONE = (0, 4, 7)
LEFT = [1, 2, 3, 5, 6, 8]
RNG = np.random.default_rng(2)
PIXELS = RNG.integers(20, 250, (K, H, W, 3), np.uint8)
LIGHTS = np.c_[RNG.uniform(-0.5, 0.5, (K, 2)), np.ones(K)]
LAYOUTS = ("folder", "named lights", "diligent", "pages", "npz", "floats")


def write(layout: str, place: Path) -> Path:
    """A stack of PIXELS with LIGHTS in one of the layouts."""
    match layout:
        case "pages":
            tifffile.imwrite(place / "s.tif", PIXELS, photometric="rgb")
            return place / "s.tif"
        case "npz":
            np.savez(place / "s.npz", images=PIXELS, lights=LIGHTS)
            return place / "s.npz"
        case "floats":
            images = PIXELS[..., 0].astype(np.float32)
            images[4] *= 3  # the brightest is one that is left out
            np.savez(place / "s.npz", images=images, lights=LIGHTS)
            return place / "s.npz"
    for k, pixels in enumerate(PIXELS):
        Image.fromarray(pixels).save(place / f"img{k}.png")
    Image.fromarray(np.full((H, W), 255, np.uint8)).save(place / "mask.png")
    rows = [" ".join(map(str, light)) for light in LIGHTS]
    if layout == "named lights":
        lines = [f"img{k}.png {row}" for k, row in enumerate(rows)][::-1]
        (place / "set.lp").write_text("\n".join([str(K), *lines]))
        return place
    (place / "lights.txt").write_text("\n".join(rows))
    if layout == "diligent":
        (place / "filenames.txt").write_text("\n".join(f"img{k}.png" for k in range(K)[::-1]))
        powers = np.linspace(0.3, 2, 3 * K).reshape(K, 3)
        np.savetxt(place / "light_intensities.txt", powers)
    return place


def same(a: ImageStack, b: ImageStack) -> bool:
    return (
        a.images.tobytes() == b.images.tobytes()
        and (a.names, a.files, a.title) == (b.names, b.files, b.title)
        and np.array_equal(a.mask, b.mask)
        and (a.lights is None) == (b.lights is None)
        and (a.lights is None or np.array_equal(a.lights, b.lights))  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("layout", LAYOUTS)
def test_leaving_out_while_reading_and_in_memory_is_the_same(layout: str, tmp_path: Path) -> None:
    path = write(layout, tmp_path)
    whole = load_stack(path)
    read = load_stack(path, LoadOptions(exclude=GONE))
    assert same(exclude_images(whole, GONE), read)
    np.testing.assert_array_equal(read.images, whole.images[LEFT])
    assert read.names == tuple(whole.names[k] for k in LEFT)
    assert (whole.lights is None) == (layout == "pages")
    if read.lights is not None and whole.lights is not None:
        np.testing.assert_array_equal(read.lights, whole.lights[LEFT])


def test_both_give_the_same_bytes_of_a_result(tmp_path: Path) -> None:
    stack = render_scene("sphere_cone", size=(40, 50), images=10).stack
    np.savez(tmp_path / "s.npz", images=stack.images, mask=stack.mask)
    read = load_stack(tmp_path / "s.npz", LoadOptions(exclude=(2, 5)))
    kept = exclude_images(load_stack(tmp_path / "s.npz"), (5, 2))
    assert result_npz(analyze(read)) == result_npz(analyze(kept))


def test_files_of_images_left_out_are_not_listed_and_all_others_are(tmp_path: Path) -> None:
    read = load_stack(write("folder", tmp_path), LoadOptions(exclude=GONE))
    names = [Path(path).name for path, _ in read.files]
    assert names == [*(f"img{k}.png" for k in LEFT), "mask.png", "lights.txt"]


def test_the_file_of_an_archive_stays_whatever_its_images_are_called(tmp_path: Path) -> None:
    names = np.array(["s.npz", *(f"n{k}" for k in range(1, K))])
    np.savez(tmp_path / "s.npz", images=PIXELS, names=names)
    read = load_stack(tmp_path / "s.npz", LoadOptions(exclude=(0,)))
    assert [Path(path).name for path, _ in read.files] == ["s.npz"]
    assert same(exclude_images(load_stack(tmp_path / "s.npz"), (0,)), read)


def test_the_last_note_says_which_were_left_out_by_name(tmp_path: Path) -> None:
    path = write("folder", tmp_path)
    expected = "excluded: img0.png, img4.png, img7.png (as asked)"
    assert load_stack(path, LoadOptions(exclude=GONE)).notes[-1] == expected
    assert exclude_images(load_stack(path), GONE).notes[-1] == expected


def test_excluding_nothing_changes_nothing(tmp_path: Path) -> None:
    stack = load_stack(write("folder", tmp_path))
    assert exclude_images(stack, ()) is stack
    assert not any("excluded" in note for note in stack.notes)


def test_excluding_in_two_steps_is_excluding_at_once(tmp_path: Path) -> None:
    whole = load_stack(write("diligent", tmp_path))
    assert same(exclude_images(exclude_images(whole, (4,)), (0, 6)), exclude_images(whole, GONE))


def test_an_image_that_cannot_be_read_may_be_left_out(tmp_path: Path) -> None:
    path = write("diligent", tmp_path)
    (path / "img4.png").write_bytes(b"no image")  # 4 is in the middle, forwards and backwards
    assert load_stack(path, LoadOptions(exclude=(4,))).shape == (8, H, W)
    (path / "img8.png").write_bytes(b"no image")  # the first of the list
    assert load_stack(path, LoadOptions(exclude=(0, 4))).shape == (7, H, W)


def test_colour_is_read_without_the_images_that_are_left_out(tmp_path: Path) -> None:
    path = write("diligent", tmp_path)
    whole, part = load_channels(path), load_channels(path, LoadOptions(exclude=GONE))
    for a, b in zip(whole, part, strict=True):
        np.testing.assert_array_equal(a.images[LEFT], b.images)
        np.testing.assert_array_equal(a.white[LEFT], b.white)


def test_options_are_the_same_in_any_order_and_from_a_list() -> None:
    options = LoadOptions(exclude=[17, 3])  # type: ignore[arg-type]
    assert options == LoadOptions(exclude=(3, 17))
    assert options.exclude == (3, 17)


def test_the_command_line_leaves_out_and_its_result_remembers(tmp_path: Path, capsys) -> None:
    stack = render_scene("sphere_cone", size=(40, 50), images=10).stack
    np.savez(tmp_path / "s.npz", images=stack.images, mask=stack.mask)
    run = ["run", str(tmp_path / "s.npz"), str(tmp_path / "out"), "--exclude", "3", "8"]
    assert main(run) == 0
    result = load_result(tmp_path / "out")
    assert "excluded: image 003, image 008 (as asked)" in capsys.readouterr().out
    assert len(result.names) == 8
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["load"]["exclude"] == [3, 8]
    assert load_result_source(tmp_path / "out")[1] == LoadOptions(exclude=(3, 8))
    assert load_result_stack(tmp_path / "out").names == result.names
    assert main(["info", str(tmp_path / "s.npz"), "--exclude", "3", "8"]) == 0
    assert "image 004" in (said := capsys.readouterr().out)
    assert "image 003  " not in said.replace("excluded: image 003", "")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((9,), r"exclude is 9; .*s\.npz has images 0 to 8"),
        ((2**70,), r"exclude is \d+; .*s\.npz has images 0 to 8"),
        ((-1, 2), "exclude is -1; accepted are image numbers from 0"),
        ((3, 5, 3), "exclude names image 3 twice; accepted is each image once"),
        ((0, 1, 2, 3), r"exclude leaves 5 of 9 images of .*s\.npz; at least 6 are needed \(three"),
        (tuple(range(9)), "exclude leaves 0 of 9 images"),
    ],
)
def test_what_cannot_be_left_out_is_refused(
    given: tuple[int, ...], words: str, tmp_path: Path, capsys
) -> None:
    path = write("npz", tmp_path)
    with pytest.raises(OptionError, match=words):
        load_stack(path, LoadOptions(exclude=given))
    with pytest.raises(OptionError, match=words.replace(r".*s\.npz", "s")):
        exclude_images(load_stack(path), given)
    if given[0] >= 0:
        assert main(["info", str(path), "--exclude", *map(str, given)]) == 2
        assert capsys.readouterr().err.startswith("photolin: exclude")


def test_what_is_no_number_is_refused() -> None:
    for given in (["3"], [1.5], [None]):
        with pytest.raises(TypeError, match="integer"):
            LoadOptions(exclude=given)  # type: ignore[arg-type]


def test_lights_that_are_left_in_one_plane_are_refused(tmp_path: Path) -> None:
    whole = load_stack(write("npz", tmp_path))
    flat = LIGHTS.copy()
    flat[2:, 0] = 0
    stack = replace(whole, lights=flat)
    with pytest.raises(DegenerateError, match="lie in one plane"):
        exclude_images(stack, (0, 1))


def test_base_images_count_the_images_that_are_left() -> None:
    stack = render_scene("sphere_cone", size=(40, 50), images=10).stack
    part = exclude_images(stack, (0,))
    found = analyze(part, Options(T=0.02, Ts=0.01, base_images=(1, 4, 8)))
    assert found.base_images == (1, 4, 8)
    with pytest.raises(OptionError, match="has images 0 to 8"):
        analyze(part, Options(T=0.02, Ts=0.01, base_images=(1, 4, 9)))
