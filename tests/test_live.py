"""What of a picture follows the sliders, what it looks like in the whole, and when it is new."""

from dataclasses import replace

import numpy as np
import pytest

from photolin.analysis import Analysis, Method, Options
from photolin.errors import Cancelled
from photolin.factors import OUTSIDE, Thresholds
from photolin.follow import follow_thresholds, prepare_ground
from photolin.pipeline import analyze
from photolin.synthetic import render_scene
from webapp import live as module
from webapp.canvas import Window
from webapp.live import (
    MOST_OBSERVATIONS,
    MOST_PIXELS,
    Live,
    Part,
    Preview,
    choose_part,
    cut,
    is_behind,
)
from webapp.state import ViewState

K, H, W = 8, 48, 64
FULL = render_scene("sphere_cone", size=(H, W), images=K).stack
MASK = np.ones((H, W), bool)
MASK[:5] = MASK[20:23, 10:31] = False
STACK = replace(FULL, mask=MASK)
NEAR = analyze(STACK, Options(T=0.05, Ts=0.02))
MOVED = ViewState(T=0.1, Ts=0.02)


def never() -> bool:
    return False


def preview_of(part: Part) -> Preview:
    """Of the stack's part, followed to the thresholds of `MOVED`."""
    known = (*cut(STACK, part), prepare_ground(STACK), NEAR, MOVED.thresholds)
    return Preview(follow_thresholds(*known), part, NEAR)


# Which part


@pytest.mark.parametrize("shape", [(1, 1), (500, 600), (1, 300_000)])
@pytest.mark.parametrize("window", [None, Window(0, 1, 0, 1, 0.01), Window(0, 1, 0, 1, 40.0)])
def test_a_small_picture_is_followed_as_a_whole_whatever_is_seen_of_it(
    shape: tuple[int, int], window: Window | None
) -> None:
    assert choose_part((9, *shape), window) == Part(0, shape[0], 0, shape[1], 1)


@pytest.mark.parametrize(
    ("window", "part"),
    [
        (Window(100, 400, 200, 700, 1.0), Part(100, 400, 200, 700, 1)),
        (Window(101, 400, 203, 700, 8.0), Part(101, 400, 203, 700, 1)),
        (Window(101, 400, 203, 700, 0.6), Part(101, 400, 203, 700, 1)),
        (Window(101, 900, 203, 1000, 0.5), Part(100, 900, 202, 1000, 2)),
        (Window(101, 900, 203, 1000, 0.25), Part(100, 900, 200, 1000, 4)),
    ],
)
def test_a_large_picture_is_followed_where_it_is_seen_as_finely_as_the_screen_shows(
    window: Window, part: Part
) -> None:
    assert choose_part((9, 2000, 3000), window) == part


def test_a_large_picture_of_which_no_window_is_known_is_thinned_out() -> None:
    assert choose_part((9, 2000, 3000), None) == Part(0, 2000, 0, 3000, 5)


def random_windows(count: int) -> list[tuple[tuple[int, int], Window]]:
    """Shapes of large pictures, and windows in them."""
    rng = np.random.default_rng(0)
    found = []
    for _ in range(count):
        rows, columns = (int(n) for n in rng.integers(600, 6000, 2))
        row0, column0 = int(rng.integers(rows)), int(rng.integers(columns))
        row1, column1 = int(rng.integers(row0, rows)) + 1, int(rng.integers(column0, columns)) + 1
        scale = float(10 ** rng.uniform(-1.5, 1.5))
        found.append(((rows, columns), Window(row0, row1, column0, column1, scale)))
    return found


def test_the_part_covers_the_window_with_no_more_pixels_than_can_be_followed() -> None:
    thinned = 0
    for shape, window in random_windows(2000):
        part = choose_part((9, *shape), window)
        assert 0 <= window.row0 - part.row0 < part.step
        assert 0 <= window.column0 - part.column0 < part.step
        assert (part.row1, part.column1) == (window.row1, window.column1)
        rows, columns = (len(range(s.start, s.stop, s.step)) for s in part.place)
        assert rows * columns <= MOST_PIXELS
        screen = int(max(1, 1 / window.scale))
        finer = max(part.step - 1, 1)
        height, width = window.row1 - window.row0, window.column1 - window.column0
        too_many = (height // finer + 2) * (width // finer + 2) > MOST_PIXELS
        assert part.step == screen or (part.step > screen and too_many)
        thinned += part.step > screen
    assert thinned > 500


def test_a_window_moved_by_less_than_a_step_looks_at_the_same_pixels() -> None:
    for shape, window in random_windows(2000):
        part = choose_part((9, *shape), window)
        assert (part.row0 % part.step, part.column0 % part.step) == (0, 0)
        by = min(part.step - 1, shape[0] - window.row1)
        moved = choose_part(
            (9, *shape), window._replace(row0=window.row0 + by, row1=window.row1 + by)
        )
        assert (moved.step, moved.column0) == (part.step, part.column0)
        assert moved.row0 - part.row0 in (0, part.step)


def test_all_of_a_stack_is_its_own_arrays() -> None:
    images, mask = cut(STACK, Part(0, H, 0, W, 1))
    assert images is STACK.images
    assert mask is STACK.mask


@pytest.mark.parametrize(
    "part", [Part(0, H, 0, W, 2), Part(4, 40, 9, 50, 1), Part(6, H, 9, W, 3), Part(0, 1, 0, W, 1)]
)
def test_a_part_is_cut_out_in_one_piece(part: Part) -> None:
    rows = slice(part.row0, part.row1, part.step)
    columns = slice(part.column0, part.column1, part.step)
    images, mask = cut(STACK, part)
    np.testing.assert_array_equal(images, STACK.images[:, rows, columns])
    np.testing.assert_array_equal(mask, STACK.mask[rows, columns])
    assert images.flags.c_contiguous
    assert mask.flags.c_contiguous


# What it looks like


def test_a_preview_of_all_pixels_stands_for_the_whole_result() -> None:
    preview = preview_of(Part(0, H, 0, W, 1))
    whole, own = preview.whole, preview.analysis
    assert whole is not None
    assert (whole.options, whole.thresholds) == (own.options, MOVED.thresholds)
    for name in ("coefficients", "linearized_bases", "labels", "seconds"):
        assert getattr(whole, name) is getattr(own, name)
    assert preview.whole is whole  # what is counted and drawn of it is known by it
    for name in ("confidence", "names", "notes", "warnings", "base_images", "mask"):
        assert getattr(whole, name) is getattr(NEAR, name)
    np.testing.assert_array_equal(preview.paint(NEAR.labels[3], 3), own.labels[3])


@pytest.mark.parametrize(
    "part", [Part(0, H, 0, W, 2), Part(0, H, 0, W - 1, 1), Part(1, H, 0, W, 1)]
)
def test_a_preview_of_a_part_stands_for_no_whole(part: Part) -> None:
    assert preview_of(part).whole is None


@pytest.mark.parametrize("image", [0, K - 1])
@pytest.mark.parametrize(
    "part",
    [Part(0, H, 0, W, 1), Part(0, H, 0, W, 3), Part(8, 45, 4, 63, 4), Part(10, 11, 0, 7, 2)],
)
def test_a_part_is_painted_over_labels_each_pixel_like_the_one_that_stands_for_it(
    part: Part, image: int
) -> None:
    preview = preview_of(part)
    given = np.where(MASK, np.uint8(0), np.uint8(OUTSIDE))
    kept = given.copy()
    painted = preview.paint(given, image)
    own = preview.analysis.labels[image]
    for row, column in np.ndindex(H, W):
        expected = given[row, column]
        if part.row0 <= row < part.row1 and part.column0 <= column < part.column1:
            at = (row - part.row0) // part.step, (column - part.column0) // part.step
            if MASK[row, column] and own[at] != OUTSIDE:
                expected = own[at]
        assert painted[row, column] == expected
    assert painted.any()
    assert (painted[~MASK] == OUTSIDE).all()
    np.testing.assert_array_equal(given, kept)


# When it is new


def test_a_result_is_behind_when_its_thresholds_are_not_those_shown() -> None:
    assert is_behind(MOVED, NEAR)
    assert is_behind(replace(MOVED, T=0.05, Ts=0.03), NEAR)
    assert not is_behind(ViewState(T=0.05, Ts=0.02), NEAR)
    assert not is_behind(replace(MOVED, live=False), NEAR)


@pytest.mark.parametrize("method", ["classification", "statistical"])
def test_nothing_is_followed_where_nothing_is_to_be(method: Method) -> None:
    live = Live(STACK)
    assert live.follow(ViewState(T=0.05, Ts=0.02), NEAR, None, never) is None
    assert live.follow(replace(MOVED, live=False), NEAR, None, never) is None
    published = replace(NEAR, options=replace(NEAR.options, method=method))
    assert live.follow(replace(MOVED, method=method), published, None, never) is None


def test_thresholds_are_followed_from_the_result_nearby() -> None:
    found = Live(STACK).follow(MOVED, NEAR, None, never)
    assert found is not None
    assert (found.near, found.part) == (NEAR, Part(0, H, 0, W, 1))
    expected = preview_of(found.part).analysis
    assert found.analysis.thresholds == Thresholds(0.1, 0.02)
    np.testing.assert_array_equal(found.analysis.labels, expected.labels)


def test_what_is_asked_again_is_the_same_preview(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_PIXELS", 1000)
    live, window = Live(STACK), Window(8, 40, 4, 30, 2.0)
    first = live.follow(MOVED, NEAR, window, never)
    assert first is not None
    seen = replace(MOVED, image=3, layer="residual", pixel=(3, 4))
    assert live.follow(seen, NEAR, window._replace(scale=3.0), never) is first

    found = [first]
    changes: list[tuple[ViewState, Analysis, Window | None]] = [
        (MOVED, replace(NEAR), window),
        (replace(MOVED, T=0.11), NEAR, window),
        (replace(MOVED, T=0.11), NEAR, window._replace(row0=9)),
        (replace(MOVED, T=0.11), NEAR, None),
        (MOVED, NEAR, window),
    ]
    for state, near, seen_part in changes:
        preview = live.follow(state, near, seen_part, never)
        assert preview is not None
        assert all(preview is not earlier for earlier in found)
        assert preview.near is near
        assert preview.analysis.thresholds == state.thresholds
        assert preview.part == choose_part((9, H, W), seen_part)
        rows, columns = preview.part.place
        np.testing.assert_array_equal(preview.analysis.mask, MASK[rows, columns])
        found.append(preview)
    np.testing.assert_array_equal(found[-1].analysis.labels, first.analysis.labels)


def test_a_preview_that_a_run_has_caught_up_with_is_let_go() -> None:
    live = Live(STACK)
    first = live.follow(MOVED, NEAR, None, never)
    assert live.follow(ViewState(T=0.05, Ts=0.02), NEAR, None, never) is None
    again = live.follow(MOVED, NEAR, None, never)
    assert again is not None
    assert again is not first


def test_thresholds_that_determine_nothing_give_no_preview_and_spoil_none() -> None:
    live = Live(STACK)
    assert live.follow(replace(MOVED, Ts=0.95), NEAR, None, never) is None
    assert live.follow(MOVED, NEAR, None, never) is not None
    assert live.follow(replace(MOVED, Ts=0.95), NEAR, None, never) is None


def test_a_preview_can_be_cancelled_and_asked_for_again() -> None:
    live = Live(STACK)
    with pytest.raises(Cancelled):
        live.follow(MOVED, NEAR, None, lambda: True)
    found = live.follow(MOVED, NEAR, None, never)
    assert found is not None
    assert found.analysis.thresholds == MOVED.thresholds


def test_a_window_of_hardly_any_scale_asks_for_no_more_than_the_picture_has() -> None:
    part = choose_part((9, 800, 700), Window(5, 800, 3, 700, 1e-7))
    assert part == Part(0, 800, 0, 700, 800)


def test_a_stack_of_many_images_is_thinned_out_more() -> None:
    few, many = (choose_part((K, 500, 500), None) for K in (12, 96))
    assert few.step == 1
    assert many.step == 3
    rows, columns = (len(range(*s.indices(10**6))) for s in many.place)
    assert 96 * rows * columns <= MOST_OBSERVATIONS


@pytest.mark.parametrize("K", [3, 26, 96, 200, 391, 1000, 10**7])
def test_no_number_of_images_makes_a_preview_dearer(K: int) -> None:
    part = choose_part((K, 2000, 3000), None)
    rows, columns = (len(range(*s.indices(10**6))) for s in part.place)
    assert rows * columns <= max(1, min(MOST_PIXELS, MOST_OBSERVATIONS // K))
