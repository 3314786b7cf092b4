"""Depth from normals: exact surfaces, jumps, gaps, symmetries and what is refused."""

from collections.abc import Callable

import numpy as np
import pytest

from photolin.errors import Cancelled, DegenerateError, InputError
from photolin.shape import depth as depth_module
from photolin.shape import multigrid
from photolin.shape.compare_depth import DepthError, compare_depth
from photolin.shape.depth import integrate_normals
from photolin.synthetic import render_scene

Array = np.ndarray


def grid(H: int, W: int) -> tuple[Array, Array]:
    """x and y of each pixel, in pixels."""
    row, column = np.mgrid[:H, :W]
    return column + 0.5 - W / 2, H / 2 - row - 0.5


def facing(p: Array | float, q: Array | float, like: Array) -> Array:
    """Unit normals where depth rises by p to the right and by q upwards."""
    n = np.stack([-p + 0 * like, -q + 0 * like, 1 + 0 * like], axis=2)
    return n / np.linalg.norm(n, axis=2, keepdims=True)


def ball(radius: float, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Normals, depth and mask of a hemisphere."""
    mask = x**2 + y**2 < radius**2
    z = np.sqrt(np.maximum(radius**2 - x**2 - y**2, 0))
    return np.stack([x, y, z], axis=2) / radius, z, mask


def bumps(H: int = 60, W: int = 71) -> tuple[Array, Array, Array]:
    """A smooth surface with a hole in its mask."""
    x, y = grid(H, W)
    z = 6 * np.sin(x / 9) * np.cos(y / 11) + x / 5
    normals = facing(
        6 / 9 * np.cos(x / 9) * np.cos(y / 11) + 1 / 5, -6 / 11 * np.sin(x / 9) * np.sin(y / 11), x
    )
    return normals, z, (np.hypot(x, y) < 28) & (np.hypot(x - 6, y + 3) > 7)


def check(normals: Array, z: Array, mask: Array) -> DepthError:
    depth = integrate_normals(normals, mask)
    assert depth.dtype == np.float32
    np.testing.assert_array_equal(np.isnan(depth), ~mask)
    assert abs(depth[mask].mean(dtype=float)) < 1e-5 * (1 + np.ptp(z[mask]))
    return compare_depth(depth, z, mask)


# Truth


@pytest.mark.parametrize(("p", "q"), [(0, 0), (0.7, -0.4), (-6, 0), (0, 25)])
def test_a_plane_is_exact(p: float, q: float) -> None:
    x, y = grid(90, 130)
    assert check(facing(p, q, x), p * x + q * y, x < 1e9).largest < 1e-4 * (1 + abs(p) + abs(q))


def test_a_hemisphere_is_exact_up_to_its_outline() -> None:
    error = check(*ball(60, *grid(128, 140)))
    assert error.rms < 1e-4
    assert error.largest < 1e-3


def test_quadrics_cones_and_waves_are_exact_to_small_fractions_of_a_pixel() -> None:
    x, y = grid(128, 128)
    z = x * x / 100 - y * y / 150 + x * y / 250
    normals = facing(x / 50 + y / 250, -y / 75 + x / 250, x)
    assert check(normals, z, x < 1e9).rms < 1e-3
    r = np.hypot(x, y)
    error = check(facing(-x / r, -y / r, x), -r, r < 60)
    assert error.rms < 5e-3
    assert error.largest < 0.1  # at the tip
    assert check(*bumps()).rms < 4e-3


def test_a_rendered_sphere_is_right_in_mm() -> None:
    """Where it is not behind obstacles; those stand at depths that no normal shows."""
    truth = render_scene("sphere_obstacles", images=6).truth
    x, y = (v * truth.px_mm for v in grid(*truth.mask.shape))
    sphere = truth.mask & (np.abs(truth.depth**2 + x**2 + y**2 - 2500) < 1)
    depth = integrate_normals(truth.normals, sphere)
    error = compare_depth(depth * truth.px_mm, truth.depth, sphere)
    assert error.rms < 1e-3
    everything = compare_depth(
        integrate_normals(truth.normals, truth.mask) * truth.px_mm, truth.depth, sphere
    )
    assert everything.rms < 0.1


def test_a_sphere_before_a_steep_plane_bends_neither(monkeypatch: pytest.MonkeyPatch) -> None:
    """Least squares that do not let go at the outline do."""
    x, y = grid(100, 110)
    normals, z, front = ball(30, x, y)
    normals = np.where(front[:, :, None], normals, facing(0.3, 1.5, x))
    z = np.where(front, z + 20, 0.3 * x + 1.5 * y)
    bent = []
    for sharpness in (depth_module.SHARPNESS, 0):
        monkeypatch.setattr(depth_module, "SHARPNESS", sharpness)
        depth = integrate_normals(normals, np.ones(z.shape, bool))
        for part in (front & (np.hypot(x, y) < 28), np.hypot(x, y) > 32):
            bent.append(compare_depth(depth, z, part).rms)
    assert max(bent[:2]) < 0.3
    assert min(bent[2:]) > 1.5


# Gaps and parts


def test_separate_parts_have_the_mean_0_each_and_one_pixel_is_a_part() -> None:
    x, y = grid(30, 40)
    mask = (np.abs(x) > 4) & (np.abs(y) < 12)
    mask[0, 0] = mask[1, 1] = True
    z = 0.3 * x - 0.2 * y
    depth = integrate_normals(facing(0.3, -0.2, x), mask)
    assert depth[0, 0] == depth[1, 1] == 0
    body = mask & (np.abs(y) < 12)
    assert abs(depth[body & (x < 0)].mean()) < 1e-5
    assert abs(depth[body & (x > 0)].mean()) < 1e-5
    assert compare_depth(depth, z, mask).largest < 1e-4
    assert compare_depth(depth, z, mask).parts == 4


@pytest.mark.parametrize("hole", [np.nan, 0.0])
def test_undetermined_pixels_stay_so_and_small_gaps_do_not_part_a_surface(hole: float) -> None:
    x, y = grid(50, 70)
    z, normals = 0.3 * x - 0.2 * y, facing(0.3, -0.2, x)
    normals[:, 30:36] = hole
    normals[::7, ::5] = hole
    depth = integrate_normals(normals, np.ones(z.shape, bool))
    lost = ~(np.abs(normals) > 0).all(axis=2)
    np.testing.assert_array_equal(np.isnan(depth), lost)
    found = ~lost
    assert np.abs((depth - z)[found] - (depth - z)[found].mean()).max() < 1e-3


def test_what_is_guessed_in_a_gap_hardly_bends_its_surroundings() -> None:
    x, y = grid(60, 60)
    z, gap = 20 * np.sin(x / 6), (np.abs(x) < 4) & (np.abs(y) < 15)
    normals = facing(20 / 6 * np.cos(x / 6), 0, x)
    normals[gap] = np.nan
    error = compare_depth(integrate_normals(normals, z < 99), z, ~gap)
    assert error.rms < 0.2  # 1.2 with the weight of others


def test_wide_gaps_part_a_surface_and_what_lies_outside_does_not_join_it() -> None:
    x, _ = grid(40, 60)
    normals, mask = facing(0.5, 0, x), np.ones(x.shape, bool)
    normals[:, 25:36] = np.nan
    depth = integrate_normals(normals, mask)
    assert abs(depth[:, :25].mean()) < 1e-4
    assert abs(depth[:, 36:].mean()) < 1e-4
    mask[:, 30] = False
    normals = facing(0.5, 0, x)
    normals[0, 0] = np.nan
    depth = integrate_normals(normals, mask)
    assert abs(np.nanmean(depth[:, :30])) < 1e-4
    assert abs(depth[:, 31:].mean()) < 1e-4


def test_normals_that_graze_face_away_or_are_infinite_give_finite_depth() -> None:
    normals, z, mask = ball(20, *grid(50, 50))
    normals[24, 10:40, 2] = 0
    normals[20, 10:40] *= -1
    normals[10, 20] = np.inf
    normals[30, 20] = 1e300
    depth = integrate_normals(normals, mask)
    assert np.isnan(depth[10, 20])
    rest = mask.copy()
    rest[10, 20] = False
    assert (np.abs(depth[rest]) < 250).all()
    plane = facing(0.3, 0, z)
    plane[25] *= -1
    assert (np.abs(integrate_normals(plane, z > -1)) < 100).all()
    below = mask & (grid(50, 50)[1] < -8)
    assert compare_depth(depth, z, below).rms < 1


def test_slopes_below_single_precision_give_finite_depth() -> None:
    normals = np.zeros((9, 9, 3))
    normals[..., 2] = 1
    normals[4, 4, 0] = 1e-60
    np.testing.assert_allclose(integrate_normals(normals, np.ones((9, 9), bool)), 0, atol=1e-12)


def test_weights_favour_good_normals_whatever_their_scale_and_0_is_undetermined() -> None:
    normals, z, mask = bumps()
    spoiled, weights = normals.copy(), np.ones(mask.shape)
    bad = np.random.default_rng(0).random(mask.shape) < 0.15
    spoiled[bad] = facing(1.5, -1, z)[bad]
    weights[bad] = 1e-4
    plain, weighted = (integrate_normals(spoiled, mask, w) for w in (None, weights))
    assert compare_depth(weighted, z, mask).rms < 0.2 * compare_depth(plain, z, mask).rms
    for power in (9, -400, 400):
        scaled = integrate_normals(spoiled, mask, np.ldexp(weights, power))
        np.testing.assert_array_equal(scaled, weighted)
    weights[bad] = 0
    np.testing.assert_array_equal(np.isnan(integrate_normals(spoiled, mask, weights)), ~mask | bad)


# Laws


@pytest.mark.parametrize(
    ("turn", "axes"),
    [
        (lambda a: a[::-1], (1, -1, 1)),
        (lambda a: a[:, ::-1], (-1, 1, 1)),
        (lambda a: a.swapaxes(0, 1)[::-1, ::-1], (1, 1, 1)),
    ],
    ids=["upside down", "mirrored", "x and y exchanged"],
)
def test_a_turned_surface_has_the_turned_depth(
    turn: Callable[[Array], Array], axes: tuple[int, ...]
) -> None:
    normals, _, mask = bumps()
    turned = turn(normals) * axes
    if turned.shape != normals.shape:
        turned = turned[:, :, [1, 0, 2]]
    depth = integrate_normals(turned, turn(mask))
    np.testing.assert_allclose(depth, turn(integrate_normals(normals, mask)), atol=1e-3)


def test_twice_the_pixels_are_twice_the_depth() -> None:
    """Depth is in pixels."""
    coarse = integrate_normals(*ball(20, *grid(50, 50))[::2])
    fine = integrate_normals(*ball(40, *grid(100, 100))[::2])
    assert np.nanmax(fine) - np.nanmin(fine[20:80, 20:80]) == pytest.approx(
        2 * (np.nanmax(coarse) - np.nanmin(coarse[10:40, 10:40])), rel=0.02
    )


def test_neither_the_length_of_normals_nor_what_lies_outside_changes_anything() -> None:
    normals, _, mask = bumps()
    depth = integrate_normals(normals, mask)
    other = np.where(mask[:, :, None], 4 * normals, np.nan)
    np.testing.assert_array_equal(integrate_normals(other, mask), depth)
    tiny = np.where(mask[:, :, None], np.ldexp(normals, -1000), 7)
    np.testing.assert_array_equal(integrate_normals(tiny, mask), depth)
    wide = np.pad(normals, ((9, 3), (2, 8), (0, 0)))
    apart = integrate_normals(wide, np.pad(mask, ((9, 3), (2, 8))))
    np.testing.assert_array_equal(apart[9:-3, 2:-8], depth)


def test_pieces_of_work_do_not_change_a_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    normals, _, mask = bumps()
    depth = integrate_normals(normals, mask)
    monkeypatch.setattr(multigrid, "BLOCK", 200)
    np.testing.assert_array_equal(integrate_normals(normals, mask), depth)


# What is refused


def test_progress_rises_to_one_and_it_can_be_cancelled() -> None:
    normals, _, mask = bumps()
    told: list[tuple[str, float]] = []
    integrate_normals(normals, mask, progress=lambda *told_now: told.append(told_now))
    assert {stage for stage, _ in told} == {"depth"}
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert shares[-1] == 1
    with pytest.raises(Cancelled, match="depth was cancelled"):
        integrate_normals(normals, mask, cancel=lambda: True)


def test_what_does_not_fit_is_refused() -> None:
    normals, _, mask = bumps()
    for wrong in (normals[:-1], normals[:, :, :2], normals[:, :, 0]):
        with pytest.raises(InputError, match="and a bool mask"):
            integrate_normals(wrong, mask)
    with pytest.raises(InputError, match="the mask is int64"):
        integrate_normals(normals, mask.astype(np.int64))  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="that of the mask"):
        integrate_normals(normals, mask, np.ones(3))
    for bad in (-1, np.nan, np.inf):
        with pytest.raises(InputError, match="numbers from 0 are accepted"):
            integrate_normals(normals, mask, np.full(mask.shape, bad))


def test_nothing_to_integrate_is_said() -> None:
    normals, _, mask = bumps()
    for empty in (normals * np.nan, normals * 0):
        with pytest.raises(DegenerateError, match="no pixel of the mask has a normal"):
            integrate_normals(empty, mask)
    with pytest.raises(DegenerateError, match="no pixel of the mask has a normal"):
        integrate_normals(normals, mask & False)
