"""One view of a result: what is shown agrees with the backend, pixel by pixel."""

from dataclasses import replace

import numpy as np
import pytest

from photolin.analysis import Options
from photolin.factors import OUTSIDE, Factor, Thresholds
from photolin.follow import follow_thresholds, prepare_ground
from photolin.label import label_images
from photolin.overview import count_classes
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp.frame import Frame, compose, pixel_values
from webapp.live import Part, Preview, cut
from webapp.often import count_often
from webapp.runs import Runs
from webapp.state import ViewState

FULL = render_scene("sphere_cone", size=(24, 32), images=8).stack
MASK = np.ones(FULL.mask.shape, bool)
MASK[:3] = False
STACK = replace(FULL, mask=MASK)
ROBUST = analyze(STACK, Options(T=0.05, Ts=0.02, samples=50))
OTHER = analyze(STACK, Options(method="statistical", T=0.05, Ts=0.02, samples=50))
RESULTS = {"robust": ROBUST, "statistical": OTHER}
RUNS = Runs(STACK, Options())


@pytest.mark.parametrize("thresholds", [Thresholds(0.05, 0.02), Thresholds(0.002, 0.3)])
@pytest.mark.parametrize("image", [0, 7])
def test_labels_are_the_backends_at_the_thresholds_of_the_view(
    thresholds: Thresholds, image: int
) -> None:
    state = ViewState(image=image, T=thresholds.T, Ts=thresholds.Ts)
    frame = compose(RUNS, RESULTS, state)
    expected = label_images(
        STACK.images, ROBUST.linearized_bases, ROBUST.coefficients, STACK.mask, thresholds
    )[image]
    assert frame.analysis is ROBUST
    assert frame.labels is not None
    assert np.array_equal(frame.labels, expected)
    assert (frame.labels[:3] == OUTSIDE).all()


def test_a_method_to_compare_with_brings_its_own_labels() -> None:
    frame = compose(RUNS, RESULTS, ViewState(image=3, T=0.05, Ts=0.02, beside="statistical"))
    assert frame.beside is OTHER
    assert np.array_equal(frame.beside_labels, OTHER.labels[3])
    assert np.array_equal(frame.labels, ROBUST.labels[3])
    assert compose(RUNS, RESULTS, ViewState()).beside_labels is None
    missing = compose(RUNS, RESULTS, ViewState(beside="classification"))
    assert missing.beside_labels is None


def test_the_thresholds_of_the_run_give_the_labels_of_the_run() -> None:
    frame = compose(RUNS, RESULTS, ViewState(image=3, T=0.05, Ts=0.02))
    assert frame.labels is not None
    assert np.array_equal(frame.labels, ROBUST.labels[3])


@pytest.mark.parametrize("T", [0.001, 0.05, 0.15])
def test_a_pixel_has_the_label_that_the_picture_shows(T: float) -> None:
    state = ViewState(T=T, Ts=0.02)
    shown = [compose(RUNS, RESULTS, replace(state, image=k)).labels for k in range(8)]
    maps = np.stack([labels for labels in shown if labels is not None])
    rows, columns = np.nonzero(STACK.mask)
    for row, column in zip(rows, columns, strict=True):
        values = pixel_values(STACK, ROBUST, (row, column), state.thresholds)
        assert np.array_equal(values.labels, maps[:, row, column])
        assert np.array_equal(values.i, STACK.images[:, row, column])


def test_linearized_values_of_a_pixel_are_those_of_the_images() -> None:
    images = np.stack([ROBUST.linearized(k) for k in range(8)])
    values = pixel_values(STACK, ROBUST, (20, 5), Thresholds(0.05, 0.02))
    assert np.array_equal(values.l, images[:, 20, 5])


def test_methods_are_shown_side_by_side_once_both_are_there() -> None:
    state = ViewState(method="statistical", beside="robust")
    frame = compose(RUNS, RESULTS, state)
    assert (frame.analysis, frame.beside) == (OTHER, ROBUST)
    assert compose(RUNS, {"statistical": OTHER}, state).beside is None
    assert compose(RUNS, RESULTS, replace(state, beside=None)).beside is None


def test_without_a_result_there_are_no_labels() -> None:
    frame = compose(RUNS, {}, ViewState())
    assert (frame.analysis, frame.beside, frame.labels) == (None, None, None)


def test_an_undetermined_pixel_is_undefined_in_all_images() -> None:
    bases = ROBUST.linearized_bases.copy()
    bases[:, 9, 9] = np.nan
    unknown = replace(ROBUST, linearized_bases=bases)
    frame = compose(RUNS, {"robust": unknown}, ViewState(image=2))
    assert frame.labels is not None
    assert frame.labels[9, 9] == Factor.UNDEFINED
    values = pixel_values(STACK, unknown, (9, 9), Thresholds(0.05, 0.02))
    assert np.isnan(values.l).all()
    assert (values.labels == Factor.UNDEFINED).all()


def preview_of(part: Part, thresholds: Thresholds) -> Preview:
    known = (*cut(STACK, part), prepare_ground(STACK), ROBUST, thresholds)
    return Preview(follow_thresholds(*known), part, ROBUST)


def test_a_preview_of_all_pixels_takes_the_place_of_the_result() -> None:
    state = ViewState(image=3, T=0.2, Ts=0.05, beside="statistical")
    preview = preview_of(Part(0, 24, 0, 32, 1), state.thresholds)
    frame = compose(RUNS, RESULTS, state, preview)
    assert frame.preview is preview
    assert frame.analysis is not None
    assert frame.analysis.thresholds == state.thresholds
    assert frame.analysis.linearized_bases is preview.analysis.linearized_bases
    assert np.array_equal(frame.labels, preview.analysis.labels[3])
    without = compose(RUNS, RESULTS, state)
    assert not np.array_equal(frame.labels, without.labels)
    assert frame.beside is OTHER
    assert np.array_equal(frame.beside_labels, without.beside_labels)
    assert without.preview is None


def test_a_preview_of_a_part_is_laid_over_the_labels_of_the_result() -> None:
    state = ViewState(image=3, T=0.2, Ts=0.05)
    preview = preview_of(Part(6, 20, 4, 30, 2), state.thresholds)
    frame, without = (compose(RUNS, RESULTS, state, shown) for shown in (preview, None))
    assert (frame.analysis, frame.preview) == (ROBUST, preview)
    assert frame.labels is not None
    assert without.labels is not None
    assert np.array_equal(frame.labels, preview.paint(without.labels, 3))
    assert np.array_equal(frame.labels[6:20:2, 4:30:2], preview.analysis.labels[3])
    beyond = np.ones(STACK.mask.shape, bool)
    beyond[6:20, 4:30] = False
    assert np.array_equal(frame.labels[beyond], without.labels[beyond])
    assert not np.array_equal(frame.labels, without.labels)


def test_a_preview_of_a_part_is_not_laid_over_another_result() -> None:
    state = ViewState(image=3, T=0.2, Ts=0.05)
    preview = preview_of(Part(6, 20, 4, 30, 2), state.thresholds)
    newer = replace(ROBUST)
    frame = compose(RUNS, {"robust": newer}, state, preview)
    assert frame.analysis is newer
    assert np.array_equal(frame.labels, compose(RUNS, RESULTS, state).labels)


# How often


def test_counts_are_there_while_their_layer_is_and_are_the_backends() -> None:
    for T, Ts in [(0.05, 0.02), (0.004, 0.2)]:
        state = ViewState(T=T, Ts=Ts, layer="how often", often="lit")
        frame = compose(RUNS, RESULTS, state)
        labels = label_images(
            STACK.images,
            ROBUST.linearized_bases,
            ROBUST.coefficients,
            STACK.mask,
            Thresholds(T, Ts),
        )
        expected = count_classes(labels, Factor.DIFFUSE, Factor.SPECULAR)
        assert frame.often is not None
        assert np.array_equal(frame.often, expected)
        assert frame.beside_often is None
        assert compose(RUNS, RESULTS, replace(state, layer="input")).often is None
        assert compose(RUNS, {}, state).often is None
        beside = replace(state, layer="input", against="how often", beside="statistical")
        frame = compose(RUNS, RESULTS, beside)
        assert np.array_equal(frame.often, expected)
        assert frame.beside_often is not None
        assert not np.array_equal(frame.beside_often, expected)


def test_counts_of_an_earlier_frame_are_taken_only_where_they_are_right() -> None:
    state = ViewState(T=0.05, Ts=0.02, layer="how often", often="specular")
    before = compose(RUNS, RESULTS, state)
    again = compose(RUNS, RESULTS, replace(state, image=4, opacity=0.1), before=before)
    assert again.often is before.often
    newer = {"robust": replace(ROBUST, labels=ROBUST.labels[::-1].copy())}
    for results, change in [
        (RESULTS, {"T": 0.004}),
        (RESULTS, {"Ts": 0.3}),
        (RESULTS, {"often": "any shadow"}),
        (RESULTS, {"method": "statistical"}),
        (newer, {}),
    ]:
        changed = replace(state, **change)  # pyright: ignore
        found = compose(RUNS, results, changed, before=before)  # pyright: ignore
        assert found.often is not before.often
        assert np.array_equal(found.often, compose(RUNS, results, changed).often)  # pyright: ignore


def test_how_often_follows_the_sliders_where_the_preview_looks() -> None:
    """The part that is followed counts by its own labels; pixels that it lacks by the last bases
    and the thresholds of the view; what is off screen as in the last result."""
    state = ViewState(T=0.2, Ts=0.05, layer="how often", often="lit")
    preview = preview_of(Part(6, 20, 4, 30, 2), state.thresholds)
    frame = compose(RUNS, RESULTS, state, preview)
    assert frame.often is not None
    lit = (Factor.DIFFUSE, Factor.SPECULAR)
    last = count_classes(ROBUST.labels, *lit)
    lacking = count_often(STACK, ROBUST, state.thresholds, "lit")
    own = count_classes(preview.analysis.labels, *lit)
    for row, column in np.ndindex(24, 32):
        expected = last[row, column]
        at = (row - 6) // 2, (column - 4) // 2
        if 6 <= row < 20 and 4 <= column < 30:
            followed = STACK.mask[row, column] and preview.analysis.mask[at]
            expected = own[at] if followed else lacking[row, column]
        assert frame.often[row, column] == expected
    assert (frame.often != last).any()
    again = compose(RUNS, RESULTS, replace(state, image=1), preview, None, frame)
    assert again.often is frame.often
    still = compose(RUNS, RESULTS, state, None, None, frame)
    assert np.array_equal(still.often, compose(RUNS, RESULTS, state).often)  # pyright: ignore


@pytest.mark.parametrize(
    "part",
    [Part(0, 24, 0, 32, 2), Part(0, 24, 0, 31, 2), Part(2, 8, 4, 10, 1), Part(0, 24, 0, 1, 1)],
)
def test_counts_beside_a_part_are_right_however_much_it_covers(part: Part) -> None:
    state = ViewState(T=0.2, Ts=0.3, layer="how often", often="any shadow")
    preview = preview_of(part, state.thresholds)
    shadows = (Factor.ATTACHED, Factor.CAST)
    whole = count_classes(ROBUST.labels, *shadows)
    whole[preview.place] = count_often(STACK, ROBUST, state.thresholds, "any shadow")[preview.place]
    expected = preview.lay(whole, count_classes(preview.analysis.labels, *shadows))
    frame = compose(RUNS, RESULTS, state, preview)
    assert frame.often is not None
    assert np.array_equal(frame.often, expected)
    assert (STACK.mask & ~preview.covered).any()


@pytest.mark.parametrize(
    ("image", "excluded", "number"),
    [(0, (), 0), (5, (), 5), (0, (0,), 1), (2, (0, 4), 3), (3, (4, 0), 5), (1, (0, 1, 3), 4)],
)
def test_an_image_keeps_its_number_when_others_are_left_out(
    image: int, excluded: tuple[int, ...], number: int
) -> None:
    frame = Frame(STACK, ViewState(image=image), None, None, None, None, excluded=excluded)
    left = [k for k in range(8) if k not in excluded]
    assert frame.number == number == left[image]


def test_counts_beside_a_preview_are_not_made_again() -> None:
    state = ViewState(T=0.2, Ts=0.05, layer="how often", often="lit")
    state = replace(state, against="how often", beside="statistical")
    preview = preview_of(Part(6, 20, 4, 30, 2), state.thresholds)
    before = compose(RUNS, RESULTS, state, preview)
    again = compose(RUNS, RESULTS, replace(state, image=1), preview, None, before)
    assert again.often is before.often
    assert again.beside_often is before.beside_often
    assert before.beside_often is not None
    turned = replace(state, method="statistical", beside="robust")
    found = compose(RUNS, RESULTS, turned, None, None, before)
    assert found.often is before.beside_often
    assert not np.array_equal(found.beside_often, before.often)  # pyright: ignore
