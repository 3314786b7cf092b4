"""Figures of the paper: every panel shows what its caption says."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from photolin import Options, analyze, render_scene
from photolin.analysis import METHODS
from photolin.errors import OptionError
from photolin.evaluate import tabulate
from photolin.factors import OUTSIDE, PALETTE, Factor
from photolin.figures import FIGURES, SMALLEST, Figure, draw_figure
from photolin.panels import GAP

SCENE = render_scene("sphere_cone", size=(20, 28), images=8)
MASK = SCENE.stack.mask.copy()
MASK[:, :3] = False
STACK = replace(SCENE.stack, mask=MASK)
TRUTH = np.where(MASK, SCENE.truth.labels, np.uint8(OUTSIDE))
RESULTS = {m: analyze(STACK, Options(method=m, T=0.05, Ts=0.02, samples=50)) for m in METHODS}
ROBUST, K, IMAGE = RESULTS["robust"], len(STACK.images), 3
TIMES = -(-SMALLEST // 28)


def draw(figure: Figure, **changes: object) -> tuple[np.ndarray, str]:
    given = {"results": RESULTS, "image": IMAGE, "truth": TRUTH, **changes}
    image = Image.open(io.BytesIO(draw_figure(figure, STACK, **given)))  # type: ignore[arg-type]
    return np.asarray(image), image.info["Description"]


def panels(sheet: np.ndarray, row: int, count: int) -> list[np.ndarray]:
    """(20,28,3) each, of a row of panels, found by the frames around them."""
    h, w = 20 * TIMES, 28 * TIMES
    frame = (sheet[:, GAP : GAP + w] == 160).all(axis=(1, 2))
    top = int(np.flatnonzero(frame)[2 * row]) + 1
    half = TIMES // 2
    return [
        sheet[top : top + h, left : left + w][half::TIMES, half::TIMES]
        for left in (GAP + n * (w + GAP) for n in range(count))
    ]


def colours(labels: np.ndarray) -> np.ndarray:
    table = np.zeros((256, 3), np.uint8)
    for factor in Factor:
        table[factor] = PALETTE[factor]
    return table[labels]


@pytest.mark.parametrize("figure", FIGURES)
def test_equal_arguments_give_equal_bytes(figure: Figure) -> None:
    one, two = (draw_figure(figure, STACK, RESULTS, IMAGE, TRUTH) for _ in range(2))
    assert one == two


@pytest.mark.parametrize("figure", FIGURES)
def test_captions_say_which_figure_T_and_Ts(figure: Figure) -> None:
    _, text = draw(figure)
    assert text.startswith(f"As Fig. {figure}: {STACK.title}, ")
    assert "T 0.0500, Ts 0.0200." in text
    assert ("Method robust." in text) == (figure in ("10", "11"))
    assert (f"image {IMAGE}." in text) == (figure in ("6", "10"))


def test_figure_6_shows_labels_by_each_method_and_the_truth_with_its_accuracy() -> None:
    sheet, text = draw("6")
    order = ("statistical", "classification", "robust")
    maps = [*(RESULTS[m].labels[IMAGE] for m in order), TRUTH[IMAGE]]
    for shown, labels in zip(panels(sheet, 0, 4), maps, strict=True):
        np.testing.assert_array_equal(shown, colours(labels))
    _, confusion = tabulate(ROBUST.labels[IMAGE][MASK], TRUTH[IMAGE][MASK])
    macro = np.nanmean(confusion.diagonal())
    assert f"(c) photolin (robust), macro accuracy {macro:.2f} %" in text
    assert "(d) ground truth" in text


def test_figure_6_without_a_truth_claims_no_accuracy() -> None:
    _, text = draw("6", truth=None)
    assert "accuracy" not in text
    assert "truth" not in text


@pytest.mark.parametrize(("figure", "first"), [("8", 1), ("15", 0)])
def test_figures_8_and_15_show_base_images_signed_to_one_scale(figure: Figure, first: int) -> None:
    sheet, text = draw(figure)
    bases = ROBUST.base_images
    for n, method in enumerate(("statistical", "classification", "robust")):
        for k, shown in zip(bases, panels(sheet, first + n, 3), strict=True):
            l = RESULTS[method].linearized(k)
            grey = shown[..., 0].astype(int)
            assert (shown == shown[..., :1]).all()
            assert (grey[(l == 0) | np.isnan(l)] == 128).all()
            assert (grey[l > 0.02] > 128).all()
            assert (grey[l < -0.02] < 128).all()
            rank = np.argsort(l[np.isfinite(l)])
            assert (np.diff(grey[np.isfinite(l)][rank]) >= 0).all()
    assert f"image {bases[0]}, previous method (statistical), ±" in text


def test_figure_8_begins_with_the_photographs_of_the_bases() -> None:
    sheet, text = draw("8")
    bases = list(ROBUST.base_images)
    white = STACK.images[bases][:, MASK].max()
    for k, shown in zip(bases, panels(sheet, 0, 3), strict=True):
        expected = np.round(255 * np.clip(STACK.images[k] / white, 0, 1))
        assert np.abs(shown[..., 0] - expected).max() <= 1
    assert f"(a) image {bases[0]} (b) image {bases[1]}" in text


def test_figure_10_is_black_exactly_where_each_class_is() -> None:
    sheet, text = draw("10")
    shown = [*panels(sheet, 1, 2), *panels(sheet, 2, 2)]
    labels = ROBUST.labels[IMAGE]
    for picture, factor in zip(shown, (1, 2, 3, 4), strict=True):
        expected = np.where(labels == factor, 0, 255)
        np.testing.assert_array_equal(picture, np.repeat(expected[..., None], 3, axis=2))
    share = 100 * (labels == Factor.CAST).sum() / MASK.sum()
    assert f"(f) cast shadow, {share:.2f} %" in text
    bright, signed = panels(sheet, 0, 2)
    assert bright[..., 0].argmax() == np.where(MASK, STACK.images[IMAGE], 0).argmax()
    assert (signed[~MASK] == 128).all()


def test_figure_11_has_all_images_on_each_sheet() -> None:
    sheet, text = draw("11")
    masks = [(one != Factor.SPECULAR) * np.uint8(255) for one in ROBUST.labels]
    times = -(-SMALLEST // max(3 * 28 + 4, 3 * 20 + 4))
    for mask in masks:
        wide = mask.repeat(times, 0).repeat(times, 1)
        assert contains(sheet[..., 0], wide), "an image is missing"
    assert f"all {K} images" in text


def contains(sheet: np.ndarray, part: np.ndarray) -> bool:
    h, w = part.shape
    windows = np.lib.stride_tricks.sliding_window_view(sheet, (h, w))
    corners = np.argwhere(
        (windows[..., 0, 0] == part[0, 0]) & (windows[..., -1, -1] == part[-1, -1])
    )
    return any(np.array_equal(windows[y, x], part) for y, x in corners)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"results": {}}, "there is no result to draw"),
        ({"image": K}, rf"image is {K}; accepted is 0 to {K - 1}"),
        ({"image": -1}, "image is -1; accepted is 0 to"),
        (
            {"truth": TRUTH[1:]},
            r"shape \(7, 20, 28\); accepted is that of the stack, \(8, 20, 28\)",
        ),
        (
            {"results": {"robust": ROBUST, "statistical": analyze(STACK, Options(T=0.1, Ts=0.02))}},
            "results are of different T and Ts",
        ),
    ],
)
def test_what_cannot_be_drawn_is_refused(change: dict[str, object], words: str) -> None:
    with pytest.raises(OptionError, match=words):
        draw("6", **change)


def test_a_figure_that_is_none_is_refused() -> None:
    with pytest.raises(OptionError, match="figure is '7'; accepted are 6, 8, 10, 11, 15"):
        draw("7")  # type: ignore[arg-type]
