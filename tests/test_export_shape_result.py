"""A shape within a result: what is read back is what was saved; nothing else is taken for one."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import fields, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from photolin import analyze
from photolin.analysis import Analysis
from photolin.errors import InputError
from photolin.export import load_result, load_shape, result_files, save_result
from photolin.shape.known import Known
from photolin.shape.recover import Shape, recover_shape
from photolin.shape.resolve import resolve_ambiguity
from photolin.shape.resolved import Resolved
from photolin.stack import ImageStack
from photolin.synthetic import render_scene

PIXELS = ((10, 40), (30, 22), (50, 45), (27, 57), (40, 30))


@cache
def scene(*, lights: bool = False) -> tuple[ImageStack, Analysis, Known]:
    """A small scene, some pixels of it undetermined; five points of known normal."""
    rendered = render_scene("sphere_obstacles", size=(60, 80), noise=0.002)
    truth, stack = rendered.truth, rendered.stack
    if lights:
        stack = replace(stack, lights=truth.lights.astype(float) * truth.power[:, None])
    normals = tuple(tuple(truth.normals[p].astype(float).tolist()) for p in PIXELS)
    analysis = analyze(stack)
    assert not analysis.determined()[analysis.mask].all()
    return stack, analysis, Known(points=PIXELS, normals=normals)


def recover(
    px_mm: float | None = None, *, lights: bool = False, points: bool = True, depth: bool = True
) -> tuple[Analysis, Shape]:
    stack, analysis, known = scene(lights=lights)
    resolved = resolve_ambiguity(analysis, known if points else Known())
    return analysis, recover_shape(stack, analysis, resolved, depth=depth, px_mm=px_mm)


def equal(a: object, b: object) -> bool:
    """Two shapes or analyses, or what they hold, to the last bit and NaN."""
    if isinstance(a, Shape | Resolved | Analysis):
        return type(a) is type(b) and all(
            equal(getattr(a, f.name), getattr(b, f.name)) for f in fields(a)
        )
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=True)
    return vars(a) == vars(b) if hasattr(a, "support") else a == b


@pytest.mark.parametrize("px_mm", [None, 1.0, 0.65, 1 / 3, 1e-6, 1e6, 0.1234567890123])
def test_save_then_load_is_identity(px_mm: float | None, tmp_path: Path) -> None:
    """Depth in mm too: single precision would lose its last bit on the way back to pixels."""
    analysis, shape = recover(px_mm)
    save_result(analysis, tmp_path, shape=shape)
    assert equal(load_shape(tmp_path), shape)
    assert equal(load_shape(tmp_path / "result.npz"), shape)


@pytest.mark.parametrize("points", [False, True])
@pytest.mark.parametrize("lights", [False, True])
def test_an_analysis_keeps_the_lights_it_was_given_beside_those_of_its_shape(
    lights: bool, points: bool, tmp_path: Path
) -> None:
    analysis, shape = recover(lights=lights, points=points, depth=False)
    save_result(analysis, tmp_path, shape=shape)
    found = load_result(tmp_path)
    assert equal(replace(found, confidence=None), replace(analysis, confidence=None))
    assert (found.lights is None) != lights
    assert equal(load_shape(tmp_path), shape)
    with np.load(tmp_path / "result.npz") as arrays:
        np.testing.assert_array_equal(arrays["lights"], shape.lights)


def test_lights_of_all_images_told_by_the_user_are_not_taken_for_the_stack_s(
    tmp_path: Path,
) -> None:
    stack, analysis, _ = scene()
    given = scene(lights=True)[0].lights
    assert given is not None
    every = tuple(tuple(s) for s in given.tolist())
    known = Known(images=tuple(range(len(every))), lights=every, powers=True)
    resolved = resolve_ambiguity(analysis, known)
    assert resolved.kind == "lights"
    save_result(analysis, tmp_path, shape=recover_shape(stack, analysis, resolved, depth=False))
    assert load_result(tmp_path).lights is None


def test_saving_what_was_loaded_gives_the_same_bytes(tmp_path: Path) -> None:
    for lights in (False, True):
        analysis, shape = recover(0.65, lights=lights)
        files = result_files(analysis, shape=shape)
        save_result(analysis, tmp_path, shape=shape)
        again = result_files(load_result(tmp_path), shape=load_shape(tmp_path))
        assert again == files


def test_a_shape_without_depth_comes_back_without(tmp_path: Path) -> None:
    analysis, shape = recover(depth=False)
    save_result(analysis, tmp_path, shape=shape)
    found = load_shape(tmp_path)
    assert found is not None
    assert found.depth is None
    assert equal(found, shape)


@pytest.mark.parametrize("lights", [False, True])
def test_a_result_without_shape_has_none(lights: bool, tmp_path: Path) -> None:
    analysis = scene(lights=lights)[1]
    save_result(analysis, tmp_path)
    assert load_shape(tmp_path) is None
    assert equal(load_result(tmp_path).lights, analysis.lights)
    report = json.loads((tmp_path / "report.json").read_text())
    del report["shape"]  # as version 0.1 wrote it
    (tmp_path / "report.json").write_text(json.dumps(report))
    assert load_shape(tmp_path) is None


def test_saving_without_a_shape_takes_an_earlier_one_away(tmp_path: Path) -> None:
    analysis, shape = recover()
    save_result(analysis, tmp_path, shape=shape)
    save_result(analysis, tmp_path)
    assert load_shape(tmp_path) is None


def test_other_readers_find_no_nan_but_in_depth_and_the_unit_in_the_report(tmp_path: Path) -> None:
    analysis, shape = recover(0.65)
    assert shape.depth is not None
    save_result(analysis, tmp_path, shape=shape)
    with np.load(tmp_path / "result.npz") as arrays:
        found = {name: (str(arrays[name].dtype), arrays[name].shape) for name in arrays}
        finite = {name for name in arrays if np.isfinite(arrays[name]).all()}
        np.testing.assert_allclose(arrays["depth"], shape.depth * 0.65, rtol=1e-6)
        assert (arrays["normals"][~arrays["determined"]] == 0).all()
    assert found["normals"] == ("float32", (60, 80, 3))
    assert found["albedo"] == ("float32", (60, 80))
    assert found["depth"] == ("float64", (60, 80))
    assert found["lights"] == ("float64", (24, 3))
    assert "given_lights" not in found
    assert set(found) - finite == {"depth"}
    told = json.loads((tmp_path / "report.json").read_text())["shape"]
    assert (told["depth_unit"], told["px_mm"]) == ("mm", 0.65)
    assert told["axes"] == "x right, y up, z to the camera"
    assert told["kind"] == "points"
    assert told["residual_means"].endswith("degrees")
    assert np.array_equal(told["matrix"], shape.resolved.matrix)


def test_a_loaded_shape_is_read_only(tmp_path: Path) -> None:
    analysis, shape = recover()
    save_result(analysis, tmp_path, shape=shape)
    found = load_shape(tmp_path)
    assert found is not None
    for array in (found.normals, found.albedo, found.depth, found.lights, found.resolved.matrix):
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


# Hostile


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    analysis, shape = recover(0.65, lights=True)
    save_result(analysis, tmp_path, shape=shape)
    return tmp_path


def spoil(folder: Path, change: Callable[[dict[str, np.ndarray]], object]) -> None:
    """Change the arrays of a result and make its report agree that they are the right ones."""
    with np.load(folder / "result.npz") as archive:
        arrays = dict(archive)
    change(arrays)
    np.savez(folder / "result.npz", **arrays)
    digest = hashlib.sha256((folder / "result.npz").read_bytes()).hexdigest()
    report = json.loads((folder / "report.json").read_text()) | {"result_sha256": digest}
    (folder / "report.json").write_text(json.dumps(report))


FOREIGN = "is not a result of photolin or was cut short; a folder written by photolin run is acc"
EVERY = ("normals", "albedo", "depth", "lights", "given_lights")


@pytest.mark.parametrize("name", ["normals", "albedo", "lights", "determined"])
def test_a_shape_with_an_array_missing_is_refused(saved: Path, name: str) -> None:
    spoil(saved, lambda arrays: arrays.pop(name))
    with pytest.raises(InputError, match=FOREIGN):
        load_shape(saved)


def test_a_report_that_tells_of_a_shape_that_is_not_there_is_refused(saved: Path) -> None:
    spoil(saved, lambda arrays: [arrays.pop(name) for name in EVERY])
    with pytest.raises(InputError, match=rf"report\.json: {FOREIGN}"):
        load_shape(saved)


@pytest.mark.parametrize("name", EVERY)
def test_a_shape_with_an_array_of_another_type_or_shape_is_refused(saved: Path, name: str) -> None:
    with np.load(saved / "result.npz") as archive:
        good = archive[name]
    for bad in (good[:-1], good[..., :-1], good.astype(np.float16), good[None], good.astype(str)):
        spoil(saved, lambda arrays, bad=bad: arrays.update({name: bad}))
        for load in (load_shape, load_result):
            with pytest.raises(InputError, match=rf"result\.npz: {FOREIGN}"):
                load(saved)


@pytest.mark.parametrize(
    "entry",
    [
        {"matrix": [[float("nan")] * 3] * 3},
        {"matrix": [[1, 0, 0], [0, 1, 0], [0, 0, float("inf")]]},
        {"matrix": [[1, 0, 0], [0, 1, 0], [1, 1, 0]]},
        {"matrix": [[0, 0, 0]] * 3},
        {"matrix": [1, 2, 3]},
        {"matrix": [[1, 2], [3]]},
        {"matrix": None},
        {"matrix": "eye"},
        {"kind": "magic"},
        {"kind": ["points"]},
        {"kind": None},
        {"residual": float("nan")},
        {"residual": None},
        {"residual": "small"},
        {"residuals": [1, None]},
        {"residuals": [[1, 2], [3]]},
        {"residuals": 3},
        {"residuals": [float("nan")]},
        {"px_mm": 0},
        {"px_mm": -1},
        {"px_mm": float("nan")},
        {"px_mm": 1e300},
        {"px_mm": "0.65"},
        {"px_mm": [0.65]},
    ],
    ids=str,
)
def test_a_report_that_no_shape_has_is_refused(saved: Path, entry: dict[str, object]) -> None:
    report = json.loads((saved / "report.json").read_text())
    report["shape"] |= entry
    (saved / "report.json").write_text(json.dumps(report))
    with pytest.raises(InputError, match=rf"report\.json: {FOREIGN}"):
        load_shape(saved)


@pytest.mark.parametrize("key", ["matrix", "kind", "residual", "residuals", "scaled", "px_mm"])
def test_a_report_with_an_entry_missing_is_refused(saved: Path, key: str) -> None:
    report = json.loads((saved / "report.json").read_text())
    del report["shape"][key]
    (saved / "report.json").write_text(json.dumps(report))
    with pytest.raises(InputError, match=rf"report\.json: {FOREIGN}"):
        load_shape(saved)


@pytest.mark.parametrize("shape", [3, "a shape", [1], True])
def test_a_shape_that_is_no_entry_is_refused(saved: Path, shape: object) -> None:
    report = json.loads((saved / "report.json").read_text()) | {"shape": shape}
    (saved / "report.json").write_text(json.dumps(report))
    for load in (load_shape, load_result):
        with pytest.raises(InputError, match=rf"report\.json: {FOREIGN}"):
            load(saved)
