"""Table 3: surfaces by each method; the five points; what cannot be compared."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from photolin import LoadOptions, Options, analyze, load_stack, load_truth
from photolin.analysis import METHODS, Analysis, Method
from photolin.errors import DegenerateError, InputError
from photolin.paper import TABLE_3, compare_surfaces_with_paper
from photolin.shape.compare_methods import MethodErrors, choose_points, compare_methods
from photolin.shape.sphere import sphere_normals
from photolin.shape.true_surface import TrueSurface, surface_of
from photolin.stack import ImageStack
from photolin.synthetic import render_scene

SHARED = Path(__file__).parents[2] / "shared" / "data"


@cache
def scene(*, lights: bool = False) -> tuple[ImageStack, dict[Method, Analysis], TrueSurface]:
    """The sphere with obstacles; the sphere is the object."""
    rendered = render_scene("sphere_obstacles", size=(60, 80))
    true, stack = surface_of(rendered.truth), rendered.stack
    assert true.depth is not None
    assert true.px_mm is not None
    normals, inside = sphere_normals(true.mask.shape, (29.5, 39.5), 50 / true.px_mm)
    on_it = np.abs(true.depth - normals[..., 2] * 50) < 0.01
    true = replace(true, thing=inside & on_it)
    stack = replace(stack, lights=true.lights if lights else None)
    return stack, {m: analyze(stack, Options(m)) for m in METHODS}, true


@cache
def found(*, lights: bool = False) -> MethodErrors:
    return compare_methods(*scene(lights=lights))


@pytest.mark.parametrize("lights", [False, True])
def test_robust_is_far_better_than_simple_photometric_stereo(lights: bool) -> None:
    errors = found(lights=lights).errors
    assert set(errors) == {"simple", *METHODS}
    simple, robust = errors["simple"], errors["robust"]
    assert robust.mean < 0.1 * simple.mean
    assert simple.depth is not None
    assert robust.depth is not None
    assert robust.depth.rms < 0.5 * simple.depth.rms
    assert robust.depth.largest < 0.4 * simple.depth.largest
    assert robust.undetermined == 0


def test_it_says_where_and_by_what() -> None:
    assert "on the object the truth names, resolved by five points" in found().note
    assert found(lights=True).note.endswith("resolved by the lights given with the stack")
    stack, analyses, true = scene(lights=True)
    whole = compare_methods(stack, analyses, replace(true, thing=None))
    assert "on the whole mask, resolved by" in whole.note
    assert whole.pixels > found(lights=True).pixels


def test_all_methods_are_compared_on_the_same_determined_pixels_of_the_object() -> None:
    _, analyses, true = scene()
    assert true.thing is not None
    pixels = (true.thing & analyses["robust"].determined()).sum()
    assert found().pixels == pixels
    assert {e.pixels + e.undetermined for e in found().errors.values()} == {pixels}


def test_a_truth_without_depth_compares_normals_alone() -> None:
    stack, analyses, true = scene(lights=True)
    bare = compare_methods(stack, analyses, replace(true, depth=None, px_mm=None))
    assert all(e.depth is None for e in bare.errors.values())
    assert bare.errors["robust"].mean == found(lights=True).errors["robust"].mean
    text = compare_surfaces_with_paper(bare)
    assert all(line.split()[4] == "-" for line in text.splitlines()[3:])


# The five points


def test_the_points_face_right_left_up_down_and_the_camera() -> None:
    normals, inside = sphere_normals((101, 101), (50, 50), 48)
    rows, columns = choose_points(normals, inside, np.full((101, 101), 9), 9)
    reach = 48 * np.sin(np.radians(35))
    expected = [(50, 50 + reach), (50, 50 - reach), (50 - reach, 50), (50 + reach, 50), (50, 50)]
    np.testing.assert_allclose(np.column_stack([rows, columns]), expected, atol=1)


def test_points_are_usable_and_lit_in_nearly_all_images() -> None:
    normals, inside = sphere_normals((101, 101), (50, 50), 48)
    lit = np.full((101, 101), 20)
    lit[:, 60:] = 14  # of 20: more than a quarter short
    usable = inside & (np.arange(101) > 35)
    rows, columns = choose_points(normals, usable, lit, 20)
    assert usable[rows, columns].all()
    assert (lit[rows, columns] == 20).all()
    with pytest.raises(DegenerateError, match="no pixel of the truth is determined by every"):
        choose_points(normals, inside & False, lit, 20)


# The table


def test_the_table_sets_the_paper_beside_and_relates_to_simple() -> None:
    lines = compare_surfaces_with_paper(found()).splitlines()
    assert lines[0].startswith(f"Table 3: surfaces on {found().pixels} pixels, on the object")
    assert [line.split()[0] for line in lines[3:]] == [*TABLE_3, "robust"]
    assert lines[3].split()[-5:] == ["1.0000", "1.0000", "|", "5.11", "14.41"]
    assert lines[4].split()[-2:] == ["4.04", "23.49"]
    robust, simple = found().errors["robust"].depth, found().errors["simple"].depth
    assert robust is not None
    assert simple is not None
    assert lines[6].split()[-2] == f"{robust.rms / simple.rms:.4f}"
    assert lines[6].split()[-1] == f"{robust.largest / simple.largest:.4f}"


def test_the_bar_of_the_paper_s_sphere_is_met_with_unknown_lights() -> None:
    folder = SHARED / "pov_sphere_obstacles"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not here")
    stack = load_stack(folder, LoadOptions(lights="none"))
    errors = compare_methods(
        stack, {"robust": analyze(stack)}, surface_of(load_truth(folder), folder)
    ).errors
    robust, simple = errors["robust"].depth, errors["simple"].depth
    assert robust is not None
    assert simple is not None
    assert robust.rms <= 0.50 * simple.rms
    assert robust.largest <= 0.40 * simple.largest


# Hostile


def test_the_truth_of_another_stack_is_refused() -> None:
    stack, analyses, _ = scene()
    other = surface_of(render_scene("cup", size=(32, 32), images=6).truth)
    with pytest.raises(InputError, match="images are of 60 x 80 pixels, the truth of 32 x 32"):
        compare_methods(stack, analyses, other)


def test_nothing_to_compare_is_said() -> None:
    stack, analyses, true = scene()
    with pytest.raises(DegenerateError, match="no pixel of the truth is determined; at least one"):
        compare_methods(stack, analyses, replace(true, thing=true.mask & False))
