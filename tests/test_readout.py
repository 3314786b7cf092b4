"""The sentences of the inspector."""

import html
from types import MappingProxyType

import numpy as np
import pytest

from photolin.analysis import Analysis, Options
from photolin.factors import LETTERS, OUTSIDE, TITLES, Factor, Thresholds, classify
from webapp.readout import (
    describe_pixel,
    escape,
    explain,
    legend,
    preview_status,
    status_line,
    summarize,
    threshold_status,
)

THRESHOLDS = Thresholds(0.05, 0.02)


@pytest.mark.parametrize(
    ("i", "l", "sentence"),
    [
        (
            0.412,
            0.398,
            "Image 07: i 0.412, l 0.398 of full scale. i = 0.4120 ≥ Ts = 0.0200 and "
            "|i - l| = 0.0140 ≤ T·i = 0.0206: diffuse.",
        ),
        (
            0.812,
            0.398,
            "Image 07: i 0.812, l 0.398 of full scale. i = 0.8120 ≥ Ts = 0.0200 and "
            "i - l = 0.4140 > T·i = 0.0406 with l ≥ 0: specular "
            "(light is added to what the surface scatters).",
        ),
        (
            0.004,
            -0.231,
            "Image 07: i 0.004, l -0.231 of full scale. i = 0.0040 < Ts = 0.0200 and l ≤ 0: "
            "attached shadow (the surface faces away from the light).",
        ),
        (
            0.004,
            0.231,
            "Image 07: i 0.004, l 0.231 of full scale. i = 0.0040 < Ts = 0.0200 and l > 0: "
            "cast shadow (the surface faces the light; something blocks it).",
        ),
        (
            0.3,
            0.4,
            "Image 07: i 0.300, l 0.400 of full scale. i = 0.3000 ≥ Ts = 0.0200 and "
            "l - i = 0.1000 > T·i = 0.0150: undefined (lit, but below the fit; light can be "
            "added to a lit pixel, not taken from it, so l or T is wrong here).",
        ),
        (
            0.3,
            -0.1,
            "Image 07: i 0.300, l -0.100 of full scale. i = 0.3000 ≥ Ts = 0.0200 and "
            "l = -0.100 < 0: undefined (lit, although the fit says the surface faces away "
            "from the light, so l or Ts is wrong here).",
        ),
        (
            0.3,
            float("nan"),
            "Image 07: i 0.300 of full scale; l could not be determined: undefined.",
        ),
    ],
)
def test_the_rule_that_decided_is_told_with_its_numbers(i, l, sentence):
    assert explain(i, l, THRESHOLDS, "Image 07") == sentence


def test_the_sentence_names_the_class_that_the_backend_gives_all_over_the_plane():
    for i in np.linspace(0, 1, 41):
        for l in np.linspace(-1, 1.5, 51):
            factor = Factor(int(classify(i, l, THRESHOLDS)))
            assert f": {TITLES[factor]}" in explain(i, l, THRESHOLDS, "a")


def test_numbers_that_decide_are_never_printed_alike():
    assert "i = 0.01999 < Ts = 0.02000" in explain(0.01999, 0.5, THRESHOLDS, "a")
    assert "i - l = 0.02004 > T·i = 0.02000" in explain(0.4, 0.37996, THRESHOLDS, "a")


def test_an_intensity_at_the_shadow_level_is_lit():
    assert "i = 0.0200 ≥ Ts = 0.0200 and |i - l| = 0.0000" in explain(0.02, 0.02, THRESHOLDS, "a")


def test_a_tiny_value_does_not_read_as_zero_and_zero_has_no_sign():
    assert "l 1.0e-06 of full scale" in explain(0.004, 1e-6, THRESHOLDS, "a")
    assert "l 0.000 of full scale" in explain(0.004, -0.0, THRESHOLDS, "a")


@pytest.mark.parametrize(
    ("i", "sentence"),
    [
        ([0.5] * 24, "is lit (i ≥ Ts = 0.0200) in 24 of 24 images."),
        ([0.5] * 3 + [0.0] * 21, "is lit (i ≥ Ts = 0.0200) in 3 of 24 images."),
        (
            [0.5] * 2 + [0.0] * 22,
            "is lit (i ≥ Ts = 0.0200) in 2 of 24 images: "
            "its linearized value cannot be determined.",
        ),
        (
            [0.0] * 24,
            "is lit (i ≥ Ts = 0.0200) in 0 of 24 images: "
            "its linearized value cannot be determined.",
        ),
    ],
)
def test_a_pixel_is_described_by_the_images_it_is_lit_in(i, sentence):
    text = describe_pixel(41, 77, np.array(i, np.float32), THRESHOLDS)
    assert text == f"Pixel (row 41, column 77) {sentence}"


def test_a_value_at_the_shadow_level_counts_as_lit_as_in_the_backend():
    at_level = np.full(6, 0.02, np.float32)
    assert "in 6 of 6 images" in describe_pixel(0, 0, at_level, THRESHOLDS)


def test_a_pixel_outside_the_mask_says_so():
    text = describe_pixel(1, 2, np.ones(6, np.float32), THRESHOLDS, inside=False)
    assert text == "Pixel (row 1, column 2) lies outside the mask: nothing was computed there."


def test_the_status_line_gives_values_and_letter():
    line = status_line(41, 80, 0.412, 0.398, Factor.DIFFUSE)
    assert line == "row 41  column 80  i 0.412  l 0.398  residual +0.014  D"
    assert status_line(0, 0, 0.1, 0.0, OUTSIDE) == "row 0  column 0  i 0.100  outside the mask"


def test_the_legend_counts_within_the_mask_in_its_own_order():
    labels = np.array([[1, 1, 1, 2], [3, 4, 4, OUTSIDE], [0, 1, OUTSIDE, OUTSIDE]], np.uint8)
    rows = legend(labels)
    assert [row.letter for row in rows] == list(LETTERS.values())
    assert [row.count for row in rows] == [4, 1, 1, 2, 1]
    assert sum(row.percent for row in rows) == pytest.approx(100)
    assert rows[0].percent == pytest.approx(100 * 4 / 9)
    assert rows[0].title == "diffuse"


def test_the_legend_of_nothing_is_all_zero():
    rows = legend(np.full((2, 2), OUTSIDE, np.uint8))
    assert [(row.count, row.percent) for row in rows] == [(0, 0.0)] * 5


def test_the_status_says_whether_the_bases_belong_to_the_thresholds_shown():
    assert threshold_status(THRESHOLDS, None) == "Nothing is linearized yet."
    assert threshold_status(THRESHOLDS, Thresholds(0.05, 0.02)) == "T 0.0500, Ts 0.0200: final."
    assert threshold_status(Thresholds(0.06, 0.02), THRESHOLDS) == (
        "Labels: T 0.0600, Ts 0.0200. Linearized bases: T 0.0500, Ts 0.0200; "
        "linearize again to match."
    )


def test_a_small_difference_of_thresholds_is_visible():
    text = threshold_status(Thresholds(0.05, 0.02), Thresholds(0.05004, 0.02))
    assert text.startswith("Labels: T 0.05000, Ts 0.0200. Linearized bases: T 0.05004, Ts 0.0200;")


@pytest.mark.parametrize(("Ts", "said"), [(0.0035, "0.0035"), (0, "0.0000"), (1e-6, "1.0e-06")])
def test_thresholds_read_as_the_sliders_show_them(Ts, said):
    assert f"(i ≥ Ts = {said})" in describe_pixel(0, 0, np.ones(6, np.float32), Thresholds(0.1, Ts))


def test_a_run_is_one_sentence():
    analysis = Analysis(
        options=Options(),
        thresholds=THRESHOLDS,
        base_images=(1, 3, 5),
        coefficients=np.zeros((6, 3)),
        linearized_bases=np.zeros((3, 4, 5), np.float32),
        labels=np.full((6, 4, 5), Factor.DIFFUSE, np.uint8),
        mask=np.ones((4, 5), np.bool_),
        names=tuple("abcdef"),
        seconds=MappingProxyType({"total": 0.534}),
    )
    assert summarize(analysis) == (
        "robust: 6 images of 4 rows × 5 columns, 20 pixels in the mask, base images b, d, f, "
        "T 0.0500, Ts 0.0200, 0.53 s."
    )


@pytest.mark.parametrize(
    "name",
    [
        '<img src=x onerror="alert(1)">',
        "[a](javascript:alert(1))",
        "**bold** _x_ `code` ~~s~~ | # 1. {x}",
        "a & b &lt; é 像",
        "\\<b>",
        "line\n# heading",
    ],
)
def test_escaped_text_reads_the_same_and_holds_no_markup(name):
    text = escape(name)
    assert html.unescape(text) == name
    assert not set(text) & set("<>[]()*_`~|{}!\\\"'\n")


def test_a_file_name_that_is_not_unicode_can_be_sent():
    assert escape("\udcff.png").encode() == b"&#56575;&#46;png"


@pytest.mark.parametrize(
    ("step", "whole", "said"),
    [
        (1, True, "preview, 41 ms."),
        (1, False, "preview (the part on screen), 41 ms."),
        (2, False, "preview (every 2nd pixel), 41 ms."),
        (3, False, "preview (every 3rd pixel), 41 ms."),
        (4, False, "preview (every 4th pixel), 41 ms."),
        (12, False, "preview (every 12th pixel), 41 ms."),
    ],
)
def test_a_preview_says_of_how_much_it_is_and_how_long_it_took(step, whole, said):
    assert preview_status(THRESHOLDS, step, whole, 0.0412) == f"T 0.0500, Ts 0.0200: {said}"


def test_a_preview_tells_thresholds_and_time_as_they_are():
    text = preview_status(Thresholds(0.1234, 1e-6), 1, True, 1.25)
    assert text == "T 0.1234, Ts 1.0e-06: preview, 1250 ms."


def test_the_time_of_a_final_result_is_told_with_its_own_thresholds_only():
    text = "T 0.0500, Ts 0.0200: final"
    assert threshold_status(THRESHOLDS, THRESHOLDS, 0.3519) == f"{text}, linearized in 352 ms."
    assert threshold_status(THRESHOLDS, THRESHOLDS, None) == f"{text}."
    other = Thresholds(0.06, 0.02)
    assert threshold_status(other, THRESHOLDS, 0.35) == threshold_status(other, THRESHOLDS)
    assert threshold_status(THRESHOLDS, None, 0.35) == "Nothing is linearized yet."


def test_thresholds_near_zero_do_not_read_as_zero() -> None:
    near = Thresholds(0.05, 7.6e-6)
    assert threshold_status(near, near) == "T 0.0500, Ts 0.00001: final."
    assert "i = 0.85070 ≥ Ts = 0.00001" in explain(0.8507, 0.85, near, "a")
    zero = Thresholds(0.05, 0)
    assert threshold_status(zero, zero) == "T 0.0500, Ts 0.0000: final."
