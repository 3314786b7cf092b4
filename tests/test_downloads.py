"""What a browser takes home: decoded, it is what the screen showed."""

import io
import zipfile
from dataclasses import replace

import numpy as np
import pytest
import tifffile
from PIL import Image

from photolin.analysis import Options
from photolin.errors import OptionError
from photolin.factors import LETTERS, OUTSIDE, Thresholds
from photolin.label import label_images
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
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


def test_the_archive_holds_the_result_as_shown() -> None:
    name, data = make_download(SHOWN, "result", 3)
    assert name == "sphere_cone_result.npz"
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        for field in ("labels", "linearized_bases", "coefficients", "mask"):
            assert np.array_equal(arrays[field], getattr(SHOWN, field), equal_nan=True), field
        assert (arrays["T"], arrays["Ts"]) == (SCREEN.T, SCREEN.Ts)


def test_names_are_safe_on_any_file_system() -> None:
    hostile = replace(SHOWN, title="../a:b*c é")
    name, _ = make_download(hostile, "result", None)
    assert name == "___a_b_c_é_result.npz"


def test_outside_the_mask_is_in_no_mask() -> None:
    masks = np.stack(list(unzip(make_download(SHOWN, "masks", 2)[1]).values()))
    assert (SHOWN.labels[2, :, :4] == OUTSIDE).all()
    assert not masks[:, :, :4].any()


def test_an_unknown_kind_is_refused_with_the_known_ones() -> None:
    with pytest.raises(OptionError, match="accepted are masks, labels, linearized and result"):
        make_download(SHOWN, "exe", None)
