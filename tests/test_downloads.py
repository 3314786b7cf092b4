"""What a browser takes home: decoded, it is what the screen showed."""

import io
import zipfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image

from photolin.analysis import Options
from photolin.errors import OptionError
from photolin.export import is_result, load_result, load_result_stack, result_files
from photolin.factors import LETTERS, OUTSIDE, Thresholds
from photolin.label import label_images
from photolin.load import LoadOptions, load_stack
from photolin.pipeline import analyze
from photolin.synthetic import render_scene, write_scene
from webapp.downloads import make_download, relabel

FULL = render_scene("sphere_cone", size=(20, 30), images=7).stack
MASK = np.ones(FULL.mask.shape, bool)
MASK[:, :4] = False
STACK = replace(FULL, mask=MASK)
RESULT = analyze(STACK, Options(T=0.05, Ts=0.02, samples=50))
SCREEN = Thresholds(0.011, 0.15)
SHOWN = relabel(STACK, RESULT, SCREEN)


def unzip(data: bytes) -> dict[str, np.ndarray]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {
            name: np.asarray(Image.open(io.BytesIO(archive.read(name))))
            for name in archive.namelist()
        }


def test_labels_are_by_the_thresholds_on_screen_and_the_note_says_so() -> None:
    expected = label_images(
        STACK.images, RESULT.linearized_bases, RESULT.coefficients, STACK.mask, SCREEN
    )
    assert np.array_equal(SHOWN.labels, expected)
    assert not np.array_equal(SHOWN.labels, RESULT.labels)
    assert SHOWN.thresholds == SCREEN
    assert SHOWN.notes[-1] == "labels by T 0.011, Ts 0.15; bases by T 0.05, Ts 0.02"
    assert relabel(STACK, RESULT, RESULT.thresholds) is RESULT


@pytest.mark.parametrize("image", [None, 4])
def test_label_maps_decode_to_the_labels(image: int | None) -> None:
    name, data = make_download(SHOWN, "labels", image)
    maps = unzip(data)
    chosen = range(7) if image is None else [image]
    assert name == f"sphere_cone_{'all' if image is None else '004'}_labels.zip"
    assert len(maps) == len(chosen)
    for k, pixels in zip(chosen, maps.values(), strict=True):
        assert np.array_equal(pixels, SHOWN.labels[k])


@pytest.mark.parametrize("image", [None, 0])
def test_masks_decode_to_the_labels(image: int | None) -> None:
    name, data = make_download(SHOWN, "masks", image)
    masks = unzip(data)
    chosen = range(7) if image is None else [image]
    assert name == f"sphere_cone_{'all' if image is None else '000'}_masks.zip"
    assert len(masks) == len(chosen) * len(LETTERS)
    planes = np.stack(list(masks.values())).reshape(len(chosen), len(LETTERS), 20, 30)
    for k, plane in zip(chosen, planes, strict=True):
        for factor, mask in zip(LETTERS, plane, strict=True):
            assert np.array_equal(mask, 255 * (SHOWN.labels[k] == factor).astype(np.uint8))


@pytest.mark.parametrize("image", [None, 6])
def test_linearized_images_keep_their_sign_and_bits(image: int | None) -> None:
    name, data = make_download(SHOWN, "linearized", image)
    pages = tifffile.imread(io.BytesIO(data)).reshape(-1, 20, 30)
    chosen = list(range(7)) if image is None else [image]
    expected = np.stack([RESULT.linearized(k) for k in chosen])
    assert name.endswith("_linearized.tif")
    assert pages.dtype == np.float32
    assert np.array_equal(pages, expected, equal_nan=True)
    assert np.nanmin(pages) < -0.01


def test_a_downloaded_result_opens_again_as_shown(tmp_path: Path) -> None:
    name, data = make_download(SHOWN, "result", 3)
    assert name == "sphere_cone_result.zip"
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        archive.extractall(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["report.json", "result.npz"]
    opened = load_result(tmp_path)
    assert is_result(tmp_path)
    for field in ("labels", "linearized_bases", "coefficients", "mask"):
        assert np.array_equal(getattr(opened, field), getattr(SHOWN, field), equal_nan=True), field
    assert (opened.thresholds, opened.options) == (SCREEN, RESULT.options)
    assert opened.notes == SHOWN.notes


def test_a_downloaded_result_finds_its_images_as_they_were_read(tmp_path: Path) -> None:
    write_scene(render_scene("sphere_cone", size=(20, 30), images=7), tmp_path / "scene")
    reading = LoadOptions(roi=(2, 18, 3, 29))
    stack = load_stack(tmp_path / "scene", reading)
    result = analyze(stack, Options(T=0.05, Ts=0.02, samples=50))
    pack = partial(result_files, stack_path=tmp_path / "scene", load_options=reading)
    _, data = make_download(result, "result", None, pack)
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        archive.extractall(tmp_path / "out")
    found = load_result_stack(tmp_path / "out")
    assert np.array_equal(found.images, stack.images)


@pytest.mark.parametrize(("title", "stem"), [("../a:b*c é", "_a_b_c é"), ("..", "stack")])
def test_names_are_safe_on_any_file_system(title: str, stem: str) -> None:
    assert make_download(replace(SHOWN, title=title), "labels", 2)[0] == f"{stem}_002_labels.zip"


def test_outside_the_mask_is_in_no_mask() -> None:
    masks = np.stack(list(unzip(make_download(SHOWN, "masks", 2)[1]).values()))
    assert (SHOWN.labels[2, :, :4] == OUTSIDE).all()
    assert not masks[:, :, :4].any()


def test_an_unknown_kind_is_refused_with_the_known_ones() -> None:
    with pytest.raises(OptionError, match="accepted are masks, labels, linearized and result"):
        make_download(SHOWN, "exe", None)
