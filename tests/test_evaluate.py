"""Evaluation: laws, hand-made tables, agreement with the reference scorer, refusals."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from photolin.errors import InputError
from photolin.evaluate import evaluate, format_evaluation, light_error, tabulate
from photolin.factors import OUTSIDE, Factor
from photolin.synthetic import Truth, load_truth, render_scene

ROOT = Path(__file__).parents[1]
SHARED = ROOT.parent / "shared"

Result = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Labels, coefficients and linearized bases."""


@pytest.fixture(scope="module")
def truth() -> Truth:
    return render_scene("cup", size=(48, 48)).truth


def perfect(truth: Truth) -> Result:
    """What a method without any error would give, with the first three images as bases."""
    lights = (truth.lights * truth.power[:, None]).astype(float)
    return truth.labels, lights @ np.linalg.inv(lights[:3]), truth.ideal[:3]


# Laws


def test_the_truth_itself_is_without_error(truth: Truth) -> None:
    e = evaluate(*perfect(truth), truth)
    np.testing.assert_array_equal(e.confusion, np.eye(4, 5) * 100)
    assert e.macro == 100
    assert e.rms < 1e-6
    assert e.p99 < 1e-6
    assert e.light_error < 1e-4
    assert e.images == 24
    assert e.counts.sum() == 24 * truth.mask.sum()


def test_the_choice_of_bases_and_their_scale_does_not_matter(truth: Truth) -> None:
    labels, coefficients, bases = perfect(truth)
    rng = np.random.default_rng(0)
    coefficients = coefficients + rng.normal(0, 0.01, coefficients.shape)
    gauge = rng.normal(size=(3, 3))
    one = evaluate(labels, coefficients, bases, truth)
    moved = np.tensordot(np.linalg.inv(gauge), bases, 1).astype(np.float32)
    two = evaluate(labels, coefficients @ gauge, moved, truth)
    assert one.rms > 1e-3
    assert two.rms == pytest.approx(one.rms, rel=1e-4)
    assert two.p99 == pytest.approx(one.p99, rel=1e-4)
    assert two.worst_image == one.worst_image
    # the map is fitted to noisy rows, and its unit norm is not that of the other scale
    assert two.light_error == pytest.approx(one.light_error, rel=0.01)


def test_pixels_outside_the_mask_count_for_nothing(truth: Truth) -> None:
    labels, coefficients, bases = perfect(truth)
    labels = np.where(truth.mask, labels, Factor.UNDEFINED).astype(np.uint8)
    bases = np.where(truth.mask, bases, 9)
    e = evaluate(labels, coefficients, bases, truth)
    assert e.macro == 100
    assert e.rms < 1e-6


def test_an_error_is_found_as_large_as_it_is_where_three_images_are_lit(truth: Truth) -> None:
    labels = truth.labels.copy()
    dim = np.zeros(truth.mask.shape, bool)
    dim[20:24] = truth.mask[20:24]
    labels[:, dim] = Factor.CAST
    labels[:2, dim] = Factor.DIFFUSE  # lit twice: what light there is does not fix three values
    ramp = np.zeros(truth.mask.shape, np.float32)
    ramp[truth.mask & ~dim] = np.linspace(0, 0.1, (truth.mask & ~dim).sum())
    off = replace(truth, labels=labels, ideal=truth.ideal + np.where(dim, 5, ramp))
    e = evaluate(*perfect(truth), off)
    assert e.rms == pytest.approx(0.1 / np.sqrt(3), rel=0.01)
    assert e.p99 == pytest.approx(0.099, rel=1e-3)


def test_the_worst_image_is_the_one_with_a_wrong_row(truth: Truth) -> None:
    labels, coefficients, bases = perfect(truth)
    coefficients[17] += 0.1
    assert evaluate(labels, coefficients, bases, truth).worst_image == 17


def test_light_powers_and_a_common_map_are_free() -> None:
    rng = np.random.default_rng(1)
    lights = rng.normal(size=(12, 3))
    powers = rng.uniform(0.2, 3, (12, 1))
    assert light_error(lights * powers @ rng.normal(size=(3, 3)), lights) < 1e-4


def test_a_light_off_by_nine_degrees_among_many_shows_as_its_share() -> None:
    lights = np.random.default_rng(2).normal(size=(200, 3))
    tilted = lights.copy()
    across = np.cross(lights[0], (0, 0, 1))
    across *= np.linalg.norm(lights[0]) / np.linalg.norm(across)
    tilted[0] = np.cos(np.radians(9)) * lights[0] + np.sin(np.radians(9)) * across
    assert light_error(tilted, lights) == pytest.approx(9 / 200, rel=0.5)


# Truth


def test_the_table_counts_true_classes_down_and_given_labels_across() -> None:
    C, A, D, S, U = (
        Factor.CAST,
        Factor.ATTACHED,
        Factor.DIFFUSE,
        Factor.SPECULAR,
        Factor.UNDEFINED,
    )
    true = np.array([[C, C, C, C, A, D, D, S]], np.uint8)
    given = np.array([[C, C, A, U, A, D, OUTSIDE, D]], np.uint8)
    counts, confusion = tabulate(given, true)
    np.testing.assert_array_equal(counts, [4, 1, 2, 1])
    expected = [[50, 25, 0, 0, 25], [0, 100, 0, 0, 0], [0, 0, 50, 0, 0], [0, 0, 100, 0, 0]]
    np.testing.assert_array_equal(confusion, expected)


@pytest.mark.parametrize("folder", ["sample_data/cup", "../shared/data/pov_sphere_cone"])
def test_a_noisy_result_scores_as_the_reference_scorer_says(folder: str, tmp_path: Path) -> None:
    path, scorer = ROOT / folder, SHARED / "score" / "score.py"
    if not (path.exists() and scorer.exists()):
        pytest.skip(f"{path} or {scorer} is not here")
    truth = load_truth(path)
    labels, coefficients, bases = perfect(truth)
    rng = np.random.default_rng(0)
    wrong = rng.integers(0, 5, labels.shape).astype(np.uint8)
    labels = np.where(rng.random(labels.shape) < 0.2, wrong, labels)
    coefficients = coefficients + rng.normal(0, 0.02, coefficients.shape)
    np.savez(
        tmp_path / "result.npz",
        labels=labels,
        coefficients=coefficients,
        linearized_bases=bases,
        mask=truth.mask,
    )
    command = [sys.executable, str(scorer), str(tmp_path), str(path / "gt.npz")]
    score = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    e = evaluate(labels, coefficients, bases, truth)
    np.testing.assert_allclose(e.confusion, [score["confusion"][c] for c in "CADS"], atol=6e-4)
    assert e.macro == pytest.approx(score["macro"], abs=6e-4)
    assert e.rms == pytest.approx(score["rms"])
    assert e.p99 == pytest.approx(score["p99"])
    assert e.light_error == pytest.approx(score["light_error"], abs=6e-4)


# Degenerate and hostile


def test_a_class_the_truth_does_not_have_is_left_out_of_the_mean(truth: Truth) -> None:
    labels, coefficients, bases = perfect(truth)
    matte = np.where(truth.labels == Factor.SPECULAR, Factor.DIFFUSE, truth.labels)
    e = evaluate(labels, coefficients, bases, replace(truth, labels=matte.astype(np.uint8)))
    assert np.isnan(e.confusion[3]).all()
    assert e.macro == pytest.approx(e.confusion.diagonal()[:3].mean())
    last = format_evaluation(e).splitlines()[5]
    assert last.split() == ["S", "0", "0.00", "%", "-", "-", "-", "-", "-"]


def test_a_scene_without_light_has_no_error_to_speak_of(truth: Truth) -> None:
    labels, coefficients, bases = perfect(truth)
    dark = np.where(truth.mask, Factor.CAST, OUTSIDE).astype(np.uint8)
    dark = np.broadcast_to(dark, truth.labels.shape).copy()
    e = evaluate(labels, coefficients, bases, replace(truth, labels=dark))
    assert np.isnan(e.rms)
    assert np.isnan(e.p99)
    assert e.worst_image == -1


def test_pixels_a_result_leaves_open_are_counted_and_spoil_no_mean(truth: Truth) -> None:
    labels, coefficients, bases = perfect(truth)
    bases = bases.copy()
    bases[1, 24, 20:23] = np.nan
    assert truth.mask[24, 20:23].all()
    e = evaluate(labels, coefficients, bases, truth)
    assert e.undetermined == 3
    assert e.rms < 1e-6
    assert "3 pixels undetermined" in format_evaluation(e)


@pytest.mark.parametrize("part", [0, 1, 2])
def test_a_result_of_another_shape_is_refused_with_both_shapes(truth: Truth, part: int) -> None:
    result = list(perfect(truth))
    result[part] = result[part][..., :-1]
    words = r"have shapes .*, the truth has 24 images of 48 x 48 pixels; .* is accepted"
    with pytest.raises(InputError, match=words):
        evaluate(result[0], result[1], result[2], truth)


def test_the_report_is_aligned_and_names_every_figure(truth: Truth) -> None:
    text = format_evaluation(evaluate(*perfect(truth), truth), "cup, robust")
    lines = text.splitlines()
    assert lines[0].startswith("cup, robust: 24 images; percent of a true class")
    assert lines[1].split() == ["true", "count", "share", "C", "A", "D", "S", "U"]
    assert len({len(line) for line in lines[1:6]}) == 1
    assert [line[0] for line in lines[2:6]] == list("CADS")
    assert "macro accuracy      100.00 %" in text
    assert "light error         0.000 degrees" in text
