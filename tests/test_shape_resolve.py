"""The ambiguity from whatever is known: each kind of knowledge, which one wins, every misuse."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from photolin import analyze
from photolin.analysis import Analysis
from photolin.errors import DegenerateError, InputError
from photolin.shape.directions import angles_between
from photolin.shape.known import Known
from photolin.shape.resolve import check_lights_found, resolve_ambiguity
from photolin.shape.resolved import Resolved
from photolin.synthetic import Scene, render_scene

PIXELS = ((20, 80), (60, 45), (100, 90), (55, 115), (80, 60), (40, 60))
"""On the sphere of the scene, none behind an obstacle."""
SPHERE_CENTRE = (59.5, 79.5)
NUMBERS = (0, 5, 9, 14, 20)
SERVED = "; the lights given with the stack served the linearization alone"


@cache
def scene() -> Scene:
    return render_scene("sphere_obstacles")


@cache
def analysis(*, lights: bool = False) -> Analysis:
    stack = scene().stack
    return analyze(replace(stack, lights=true_lights()) if lights else stack)


def true_lights() -> np.ndarray:
    truth = scene().truth
    return truth.lights.astype(float) * truth.power[:, None]


def sphere() -> tuple[float, float, float]:
    return (*SPHERE_CENTRE, 50 / scene().truth.px_mm)


def knowledge() -> dict[str, Known]:
    """Every kind of it, with the kind of resolution it leads to."""
    normals = tuple(tuple(scene().truth.normals[p].astype(float).tolist()) for p in PIXELS)
    some, every = true_lights()[list(NUMBERS)], true_lights()
    return {
        "points": Known(points=PIXELS, normals=normals),
        "points on a sphere": Known(sphere(), PIXELS),
        "sphere": Known(sphere()),
        "some lights": Known(images=NUMBERS, lights=tuple(map(tuple, some.tolist())), powers=True),
        "some directions": Known(images=NUMBERS, lights=tuple(map(tuple, some.tolist()))),
        "lights": Known(
            images=tuple(range(24)), lights=tuple(map(tuple, every.tolist())), powers=True
        ),
    }


KINDS = {
    "points": "points",
    "points on a sphere": "points",
    "sphere": "sphere",
    "some lights": "some lights",
    "some directions": "some lights",
    "lights": "lights",
}


def light_errors(resolved: Resolved, of: Analysis) -> np.ndarray:
    return angles_between(resolved.lights(of.coefficients), true_lights())


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_knowledge_finds_all_lights(kind: str) -> None:
    resolved = resolve_ambiguity(analysis(), knowledge()[kind])
    assert resolved.kind == KINDS[kind]
    assert light_errors(resolved, analysis()).max() < 1
    assert SERVED not in resolved.note


def test_powers_are_known_only_where_they_were_given() -> None:
    scaled = {kind: resolve_ambiguity(analysis(), k).scaled for kind, k in knowledge().items()}
    assert [kind for kind, absolute in scaled.items() if absolute] == ["some lights", "lights"]


def test_of_points_with_a_sphere_the_normals_are_the_sphere_s() -> None:
    """The two are the same truth; the sphere's formula has no rounding of single precision."""
    given = resolve_ambiguity(analysis(), knowledge()["points"])
    formula = resolve_ambiguity(analysis(), knowledge()["points on a sphere"])
    np.testing.assert_allclose(formula.matrix, given.matrix, rtol=1e-3, atol=1e-3)


def test_without_any_knowledge_integrability_decides() -> None:
    resolved = resolve_ambiguity(analysis())
    assert resolved.kind == "integrability"
    assert not resolved.scaled


def test_lights_given_with_the_stack_are_taken_as_they_are() -> None:
    """Their coefficients were made from them: a residual or a worst image would say nothing."""
    given = analysis(lights=True)
    resolved = resolve_ambiguity(given)
    assert (resolved.kind, resolved.scaled) == ("lights", True)
    assert resolved.note == "resolved by the lights given with the stack"
    assert resolved.residual == 0
    assert resolved.residuals is None
    bases = list(given.base_images)
    np.testing.assert_allclose(resolved.matrix @ true_lights()[bases], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(resolved.lights(given.coefficients), true_lights(), atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_what_the_user_knows_wins_over_the_lights_of_the_stack_and_says_so(kind: str) -> None:
    known, given = knowledge()[kind], analysis(lights=True)
    resolved = resolve_ambiguity(given, known)
    assert resolved.kind == KINDS[kind]
    assert resolved.note.endswith(SERVED)
    assert resolved.note.startswith("resolved by ")
    plain = resolve_ambiguity(replace(given, lights=None), known)
    np.testing.assert_array_equal(resolved.matrix, plain.matrix)
    assert resolved.note == plain.note + SERVED


def test_points_win_even_over_lights_they_contradict() -> None:
    """Lights turned by 30 degrees about the camera: the points turn them back."""
    c, s = np.cos(np.radians(30)), np.sin(np.radians(30))
    turned = true_lights() @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    given = replace(analysis(lights=True), lights=turned)
    assert light_errors(resolve_ambiguity(given), given).max() > 10
    assert light_errors(resolve_ambiguity(given, knowledge()["points"]), given).max() < 1


# Degenerate and hostile


@pytest.mark.parametrize("pixel", [(0, 0), (59, 200), (-1, 80), (59, 160), (500, 500)])
def test_a_point_outside_its_sphere_is_refused(pixel: tuple[int, int]) -> None:
    known = Known(sphere(), (*PIXELS, pixel))
    words = rf"the point at row {pixel[0]}, column {pixel[1]} is outside the sphere of centre row "
    with pytest.raises(InputError, match=words + r"59\.5, column 79\.5 .*; points inside are acc"):
        resolve_ambiguity(analysis(), known)


def test_a_point_outside_the_image_is_refused() -> None:
    known = Known(points=(*PIXELS, (59, 160)), normals=((0, 0, 1),) * 7)
    with pytest.raises(InputError, match="row 59, column 160 is outside the image of 120 rows"):
        resolve_ambiguity(analysis(), known)


def test_an_undetermined_point_is_refused() -> None:
    bases = analysis().linearized_bases.copy()
    bases[:, 60, 45] = np.nan
    open_there = replace(analysis(), linearized_bases=bases)
    for kind in ("points", "points on a sphere"):
        with pytest.raises(InputError, match="row 60, column 45 has no linearized bases"):
            resolve_ambiguity(open_there, knowledge()[kind])


def test_points_alike_do_not_determine_it() -> None:
    normal = tuple(scene().truth.normals[60, 60].astype(float).tolist())
    known = Known(points=((60, 60),) * 5, normals=(normal,) * 5)
    with pytest.raises(DegenerateError, match="5 points do not determine the ambiguity"):
        resolve_ambiguity(analysis(), known)


@pytest.mark.parametrize("radius", [0, -3, np.nan, np.inf])
def test_a_sphere_of_no_size_is_refused(radius: float) -> None:
    for points in ((), PIXELS):
        with pytest.raises(InputError, match="a radius above 0 pixels"):
            resolve_ambiguity(analysis(), Known((59.5, 79.5, radius), points))


def test_points_that_are_not_true_of_the_scene_are_said_not_to_fit() -> None:
    """Their normals put all lights into one plane: not the lights are wrong, the points are."""
    with pytest.raises(DegenerateError, match="what is known of the scene does not fit the images"):
        check_lights_found(np.random.default_rng(0).normal(size=(9, 3)) * (1, 1e-4, 1))
    check_lights_found(true_lights())
