"""Where a ray meets a relief: laws, planes against the exact intersection, holes, garbage."""

import numpy as np
import pytest

from webapp.ray import clip_ray, heights, meet_relief, ray_in_text

H, W = 30, 40
ROWS, COLUMNS = np.mgrid[:H, :W]
HILLS = (6 * np.sin(ROWS / 5) * np.cos(COLUMNS / 4)).astype(np.float32)
DOWN = np.array([0.0, 0.0, -1.0])


def through(point: np.ndarray, along: np.ndarray, back: float = 300) -> tuple:
    """A ray along a direction that begins before a point."""
    unit = along / np.linalg.norm(along)
    return point - back * unit, unit


def test_a_vertical_ray_hits_its_own_pixel_everywhere() -> None:
    for row in range(H):
        for column in range(W):
            for off in (0.02, 0.5, 0.98):
                eye = np.array([column + off, row + 1 - off, 100])
                assert meet_relief(HILLS, (eye, DOWN)) == (row, column)


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.7, -0.3), (-2.0, 1.0)])
@pytest.mark.parametrize("along", [(0.3, 0.2, -1), (-2, 1, -1.5), (0, 3, -1), (4, 0.5, -0.2)])
def test_a_ray_meets_a_tilted_plane_where_they_intersect_exactly(
    slope: tuple[float, float], along: tuple[float, float, float]
) -> None:
    p, q = slope
    plane = (5 + p * (COLUMNS + 0.5) + q * (ROWS + 0.5)).astype(np.float32)
    normal = np.array([-p, -q, 1])
    way = np.array(along)
    seen = normal @ way < 0
    for row, column in ((0.7, 0.7), (12.25, 30.75), (20.001, 11.999), (29.3, 39.3)):
        point = np.array([column, row, 5 + p * column + q * row])
        assert meet_relief(plane, through(point, way)) == (
            (int(row), int(column)) if seen else None
        )


def test_the_length_of_the_direction_and_the_way_to_the_eye_do_not_matter() -> None:
    eye, along = through(np.array([20.3, 14.6, 0.0]), np.array([0.6, 0.5, -1]))
    first = meet_relief(HILLS, (eye, along))
    assert first is not None
    assert meet_relief(HILLS, (eye, 17 * along)) == first
    assert meet_relief(HILLS, (eye - 1e4 * along, along)) == first


def test_the_first_of_two_surfaces_on_a_ray_is_met() -> None:
    step = np.zeros((H, W), np.float32)
    step[:, 20:25] = 10
    # towards smaller columns, over the wall's top and onto it
    assert meet_relief(step, through(np.array([22.5, 10.5, 10.0]), np.array([-1, 0, -0.5]))) == (
        10,
        22,
    )
    # the wall lies between the eye and the ground behind it
    met = meet_relief(step, through(np.array([15.5, 10.5, 0.0]), np.array([-1, 0, -0.5])))
    assert met is not None
    assert met[1] in (24, 25)


def test_a_hole_is_seen_through_and_its_rim_is_not() -> None:
    hole = HILLS.copy()
    hole[10:20, 10:20] = np.nan
    for row in range(H):
        for column in range(W):
            met = meet_relief(hole, (np.array([column + 0.5, row + 0.5, 50]), DOWN))
            inside = 10 <= row < 20 and 10 <= column < 20
            assert met == (None if inside else (row, column))


def test_a_ray_that_passes_through_a_hole_and_below_the_surface_meets_nothing() -> None:
    flat = np.zeros((H, W), np.float32)
    flat[:, 10:20] = np.nan
    entering = np.array([15.0, 10.5, 0.0])
    assert meet_relief(flat, through(entering, np.array([1, 0, -0.4]))) is None


def test_from_behind_and_beside_nothing_is_met() -> None:
    middle = np.array([20.5, 15.5, 0.0])
    assert meet_relief(HILLS, through(middle, np.array([0.1, 0.1, 1.0]))) is None
    assert meet_relief(HILLS, (np.array([-5.0, 3, 50]), DOWN)) is None
    assert meet_relief(HILLS, (np.array([W + 0.1, 3, 50]), DOWN)) is None
    assert meet_relief(HILLS, (np.array([20.5, 15.5, 50]), -DOWN)) is None
    assert meet_relief(HILLS, (np.array([20.5, 15.5, 50]), np.zeros(3))) is None
    assert meet_relief(np.full((H, W), np.nan, np.float32), (middle, DOWN)) is None


def test_a_ray_upwards_meets_a_steep_slope_that_faces_it() -> None:
    steep = (-4 * COLUMNS).astype(np.float32)  # faces right
    point = np.array([20.5, 15.5, -80.0])
    assert meet_relief(steep, through(point, np.array([-1, 0, 0.05]), 15)) == (15, 20)


@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (5, 1)])
def test_reliefs_of_one_row_or_column_are_met(shape: tuple[int, int]) -> None:
    flat = np.ones(shape, np.float32)
    row, column = shape[0] - 1, shape[1] - 1
    eye = np.array([column + 0.3, row + 0.7, 9])
    assert meet_relief(flat, (eye, DOWN)) == (row, column)


def test_heights_are_linear_between_pixels_and_end_half_a_pixel_beyond_them() -> None:
    plane = (2 * COLUMNS - 3 * ROWS).astype(np.float32)
    rows, columns = np.random.default_rng(0).uniform(0, [[H - 1], [W - 1]], (2, 200))
    assert heights(plane, rows, columns) == pytest.approx(2 * columns - 3 * rows, abs=1e-4)
    edge = heights(plane, np.array([0.0, 0, -0.6]), np.array([-0.4, -0.6, 0]))
    assert np.isfinite(edge).tolist() == [True, False, False]


def test_heights_reach_half_a_pixel_into_a_hole() -> None:
    hole = np.full((H, W), 3, np.float32)
    hole[5, 5] = np.nan
    found = heights(hole, np.full(4, 5.0), np.array([4.4, 4.6, 5.4, 5.6]))
    assert found[[0, 3]].tolist() == [3, 3]
    assert np.isnan(found[1:3]).all()


def test_a_box_is_entered_and_left_where_the_ray_crosses_its_faces() -> None:
    low, high = np.zeros(3), np.array([4.0, 5.0, 6.0])
    assert clip_ray((np.array([1.0, 1, 10]), DOWN), low, high) == (4, 10)
    assert clip_ray((np.array([1.0, 1, 3]), DOWN), low, high) == (0, 3)
    assert clip_ray((np.array([1.0, 9, 3]), DOWN), low, high) is None
    assert clip_ray((np.array([1.0, 1, -3]), DOWN), low, high) is None


def test_a_ray_is_read_as_the_page_writes_it() -> None:
    ray = ray_in_text("ray 1.500000,-2.000000,300.250000,-0.000000,0.600000,-0.800000")
    assert ray is not None
    assert np.concatenate(ray).tolist() == [1.5, -2, 300.25, 0, 0.6, -0.8]


@pytest.mark.parametrize(
    "text",
    ["", "ray", "1,2", "ray 1,2,3,4,5", "ray 1,2,3,4,5,6,7", "ray 1,2,3,4,5,nan",
 "ray 1,2,3,4,5,1e9",
     "ray 1,2,3,4,5,inf", "ray 1,2,3,4,5,6\n", " ray 1,2,3,4,5,6", "ray 1,2,3,4,5,٣",
     "ray 1,2,3,4,5," + "9" * 4000, "ray 1,2,3,4,5,.", "ray 1,2,3,4,5,-"],
)  # fmt: skip
def test_garbage_is_no_ray(text: str) -> None:
    assert ray_in_text(text) is None


def test_any_ray_the_page_can_write_is_answered() -> None:
    extreme = "999999999.999999999"
    numbers = ["0", "-0", "0.000000001", extreme, f"-{extreme}"]
    rng = np.random.default_rng(3)
    for _ in range(300):
        ray = ray_in_text("ray " + ",".join(rng.choice(numbers, 6)))
        assert ray is not None
        met = meet_relief(HILLS, ray)
        assert met is None or (0 <= met[0] < H and 0 <= met[1] < W)
