"""Arrays to pictures and bytes."""

import io

import imagecodecs
import numpy as np
import pytest
from PIL import Image
from skimage.color import deltaE_ciede2000, rgb2lab

from photolin.factors import OUTSIDE, PALETTE, Factor
from webapp.patterns import MARKS, add_marks
from webapp.render import (
    choose_gain,
    choose_scale,
    encode_jpeg,
    encode_labels,
    encode_png,
    render_input,
    render_linearized,
    render_residual,
)

LABELS = np.array([[0, 1, 2, 3], [4, OUTSIDE, 1, 1], [4, 4, OUTSIDE, 0]], np.uint8)


def rgba(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGBA"))


def f32(*values: float) -> np.ndarray:
    return np.array([values], np.float32)


def test_input_is_linear_in_the_gain_and_saturates_at_white():
    assert render_input(f32(0, 0.25, 0.5, 1), 1.0).tolist() == [[0, 64, 128, 255]]
    assert render_input(f32(0, 0.25, 0.5, 1), 2.0).tolist() == [[0, 128, 255, 255]]


def test_rendering_leaves_the_stored_values_alone():
    stored = f32(-3, -0.1, 0, 0.1, 3)
    before = stored.copy()
    render_linearized(stored, 0.2)
    render_residual(stored, 0.2)
    render_input(stored, 5.0)
    np.testing.assert_array_equal(stored, before)


def test_zero_is_mid_grey_positive_lighter_negative_darker_and_symmetric():
    picture = render_linearized(f32(-9, -0.4, -0.2, -1e-4, 0, 1e-4, 0.2, 0.4, 9), 0.4)
    assert picture.dtype == np.uint8
    assert picture.tolist()[0][4] == 128
    assert picture.tolist() == [[1, 1, 65, 128, 128, 128, 192, 255, 255]]


def test_a_value_and_its_negative_are_equally_far_from_mid_grey():
    values = np.linspace(0, 1.2, 301, dtype=np.float32)[None]
    up = render_linearized(values, 1.0).astype(int) - 128
    down = 128 - render_linearized(-values, 1.0).astype(int)
    assert np.abs(up - down).max() <= 1
    assert (np.diff(up) >= 0).all()


def test_an_unknown_value_is_shown_as_zero_without_a_warning():
    assert render_linearized(f32(np.nan, np.inf, -np.inf), 1.0).tolist() == [[128, 255, 1]]


def test_residual_zero_is_white_light_added_red_light_missing_blue():
    picture = render_residual(f32(0, 0.1, -0.1), 0.1)
    assert picture.tolist() == [[[255, 255, 255], [178, 24, 43], [33, 102, 172]]]


def test_gain_brings_the_bright_part_of_the_mask_to_white_and_never_darkens():
    mask = np.ones((20, 20), np.bool_)
    mask[0] = False
    images = np.full((6, 20, 20), 0.2, np.float32)
    images[:, 0] = 1.0
    assert choose_gain(images, mask) == pytest.approx(5.0)
    assert choose_gain(np.ones((6, 20, 20), np.float32), mask) == 1.0
    assert choose_gain(np.zeros((6, 20, 20), np.float32), mask) == 1.0


def test_scale_is_symmetric_above_zero_and_ignores_what_is_outside_or_unknown():
    mask = np.array([[True, True, True, False]])
    assert choose_scale(f32(-0.3, -0.3, -0.3, 9.0), mask) == pytest.approx(0.3)
    assert choose_scale(f32(np.nan, 0.3, 0.3, 9.0), mask) == pytest.approx(0.3)
    assert choose_scale(np.zeros((1, 4), np.float32), mask) > 0


def test_png_is_exact_and_jpeg_is_near():
    ramp = np.add.outer(np.arange(40), np.arange(60)).astype(np.uint8)
    colour = np.stack([ramp, ramp // 2, 255 - ramp], axis=2)
    for picture in (ramp, colour):
        np.testing.assert_array_equal(
            np.asarray(Image.open(io.BytesIO(encode_png(picture)))), picture
        )
        near = imagecodecs.jpeg8_decode(encode_jpeg(picture)).astype(int)
        assert near.shape == picture.shape
        assert np.abs(near - picture).mean() < 4


def test_indices_of_the_overlay_are_the_labels():
    picture = Image.open(io.BytesIO(encode_labels(LABELS)))
    assert (picture.format, picture.mode, picture.size) == ("PNG", "P", (4, 3))
    np.testing.assert_array_equal(np.asarray(picture), LABELS)


def test_colours_are_the_palette_at_55_percent_but_diffuse_at_15_and_specular_at_75():
    overlay = rgba(encode_labels(LABELS))
    own = {Factor.DIFFUSE: 0.15, Factor.SPECULAR: 0.75}
    for factor in Factor:
        alpha = round(255 * own.get(factor, 0.55))
        found = overlay[factor == LABELS]
        assert (found == (*PALETTE[factor], alpha)).all()
    assert (overlay[LABELS == OUTSIDE, 3] == 0).all()


@pytest.mark.parametrize("opacity", [0.0, 1.0])
def test_at_the_ends_of_the_opacity_all_classes_are_alike(opacity):
    alpha = rgba(encode_labels(LABELS, opacity=opacity))[..., 3]
    assert (alpha[LABELS != OUTSIDE] == round(255 * opacity)).all()
    assert (alpha[LABELS == OUTSIDE] == 0).all()


@pytest.mark.parametrize("hidden", Factor)
def test_a_hidden_class_is_transparent_and_the_others_are_not(hidden):
    alpha = rgba(encode_labels(LABELS, set(Factor) - {hidden}))[..., 3]
    np.testing.assert_array_equal(alpha > 0, (LABELS != OUTSIDE) & (hidden != LABELS))


def test_solid_labels_are_opaque():
    overlay = rgba(encode_labels(LABELS, opacity=0.2, solid=True))
    assert (overlay[LABELS == Factor.DIFFUSE] == (*PALETTE[Factor.DIFFUSE], 255)).all()
    assert (overlay[LABELS == OUTSIDE, 3] == 0).all()


def test_another_palette_changes_the_colours_alone():
    palette = dict.fromkeys(Factor, (1, 2, 3))
    overlay = rgba(encode_labels(LABELS, palette=palette))
    assert (overlay[LABELS != OUTSIDE, :3] == (1, 2, 3)).all()
    np.testing.assert_array_equal(overlay[..., 3], rgba(encode_labels(LABELS))[..., 3])


def test_patterns_change_marked_pixels_alone_to_black_or_white_and_stronger():
    labels = np.arange(5, dtype=np.uint8).repeat(16)[:, None].repeat(40, axis=1)
    plain, marked = (rgba(encode_labels(labels, patterns=p)) for p in (False, True))
    marks = add_marks(labels) != labels
    np.testing.assert_array_equal(marked[~marks], plain[~marks])
    for factor, colour in MARKS.items():
        here = marked[marks & (labels == factor)]
        assert (here[:, :3] == colour).all()
        assert (here[:, 3] > plain[labels == factor, 3].max()).all()


def test_marks_follow_opacity_and_switches_of_their_class():
    labels = np.full((16, 16), Factor.CAST, np.uint8)
    assert not rgba(encode_labels(labels, opacity=0.0, patterns=True))[..., 3].any()
    assert not rgba(encode_labels(labels, [Factor.ATTACHED], patterns=True))[..., 3].any()
    assert (rgba(encode_labels(labels, opacity=1.0, patterns=True))[..., 3] == 255).all()


def test_outlines_have_no_patterns():
    labels = np.full((16, 16), Factor.ATTACHED, np.uint8)
    labels[4:12, 4:12] = Factor.CAST
    both = (encode_labels(labels, outlines=True, patterns=p) for p in (False, True))
    assert len(set(both)) == 1


def test_specular_and_undefined_differ_to_all_eyes_on_dark_and_on_bright_pixels():
    # what a deuteranope and a protanope see, linear sRGB (Machado et al. 2009, severity 1)
    deutan = [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]]
    protan = [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]]
    overlay = rgba(encode_labels(np.array([[2, 0]], np.uint8)))[0] / 255
    for ground in (0.0, 0.1, 0.3, 0.6):
        mixed = overlay[:, :3] * overlay[:, 3:] + ground * (1 - overlay[:, 3:])
        for eyes in (np.eye(3), deutan, protan):
            linear = np.clip(mixed**2.2 @ np.transpose(eyes), 0, 1)
            one, other = rgb2lab(linear ** (1 / 2.2))
            assert deltaE_ciede2000(one, other) > 10


def test_outlines_are_the_one_pixel_rim_of_each_class_but_diffuse():
    labels = np.full((9, 9), Factor.DIFFUSE, np.uint8)
    labels[2:7, 2:7] = Factor.CAST
    overlay = rgba(encode_labels(labels, outlines=True, opacity=0.1))
    rim = np.zeros((9, 9), np.bool_)
    rim[2:7, 2:7] = True
    rim[3:6, 3:6] = False
    np.testing.assert_array_equal(overlay[..., 3], np.where(rim, 255, 0))
    assert (overlay[rim, :3] == PALETTE[Factor.CAST]).all()


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (3, 1001)])
def test_any_shape_survives(shape):
    labels = np.random.default_rng(0).integers(0, 5, shape).astype(np.uint8)
    for view in (labels, np.asfortranarray(labels), labels[::-1, ::-1]):
        np.testing.assert_array_equal(imagecodecs.png_decode(encode_labels(view))[..., 3] > 0, True)
        np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(encode_labels(view)))), view)


def test_the_same_labels_give_the_same_bytes():
    assert encode_labels(LABELS) == encode_labels(LABELS.copy())
