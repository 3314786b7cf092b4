"""The verbs shape and lights: every option, every file, every error in one line."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import imagecodecs
import numpy as np
import pytest
import tifffile
from command_line import complaint
from test_shape_chrome_ball import mirror, sky

from photolin.analysis import Options
from photolin.cli import main
from photolin.console import shape_summary
from photolin.export import load_result, load_shape
from photolin.load import load_stack
from photolin.load.lights import read_lights
from photolin.pipeline import analyze
from photolin.shape.directions import angles_between
from photolin.shape.resolve import resolve_ambiguity
from photolin.synthetic import load_truth, render_scene

SIZE = (60, 80)
PIXELS = [(10, 40), (30, 22), (50, 45), (27, 57), (40, 30)]
"""On the sphere of the scene, none behind an obstacle."""
FILES = {
    *("result.npz", "report.json", "normals.tif", "normals.npz", "normals_opengl.png"),
    *("albedo.tif", "albedo.png", "depth.tif", "mesh.ply", "mesh.obj", "mesh.mtl", "mesh.png"),
    *("lights.lp", "light_directions.txt", "light_intensities.txt"),
}


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scene") / "small"
    size = map(str, SIZE)
    assert main(["synth", "sphere_obstacles", str(folder), "--size", *size, "--images", "16"]) == 0
    return folder


@pytest.fixture(scope="module")
def result(stack: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("result") / "out"
    assert main(["run", str(stack), str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def lit(stack: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The stack with its lights beside it."""
    folder = tmp_path_factory.mktemp("lit") / "stack"
    shutil.copytree(stack, folder)
    truth = load_truth(stack)
    np.savetxt(folder / "images" / "lights.txt", truth.lights * truth.power[:, None])
    return folder / "images"


@pytest.fixture
def points(stack: Path, tmp_path: Path) -> Path:
    truth, path = load_truth(stack), tmp_path / "points.csv"
    rows = [(*p, *truth.normals[p].tolist()) for p in PIXELS]
    path.write_text("row,column,x,y,z\r\n" + "\r\n".join(",".join(map(str, r)) for r in rows))
    return path


def sphere(stack: Path) -> list[str]:
    return ["--sphere", str((SIZE[0] - 1) / 2), str((SIZE[1] - 1) / 2), str(_radius(stack))]


def _radius(stack: Path) -> float:
    return 50 / load_truth(stack).px_mm


def run(arguments: list[str | Path]) -> None:
    assert main([str(a) for a in arguments]) == 0


def error(out: Path, stack: Path) -> float:
    """Mean angle to the true normals, degrees, where a pixel is determined."""
    shape, truth = load_shape(out), load_truth(stack)
    assert shape is not None
    there = truth.mask & np.isfinite(shape.normals).all(axis=2)
    return float(angles_between(shape.normals[there].astype(float), truth.normals[there]).mean())


# What is written


def test_a_stack_gives_every_file_and_each_can_be_read(
    stack: Path, points: Path, tmp_path: Path, capsys
) -> None:
    out = tmp_path / "new" / "out"
    run(["shape", stack, out, "--points", points])
    assert {p.name for p in out.iterdir()} == FILES
    shape, analysis = load_shape(out), load_result(out)
    assert shape is not None
    assert shape.depth is not None
    normals = tifffile.imread(out / "normals.tif")
    np.testing.assert_array_equal(normals, shape.normals)
    np.testing.assert_array_equal(tifffile.imread(out / "albedo.tif"), shape.albedo)
    np.testing.assert_array_equal(tifffile.imread(out / "depth.tif"), shape.depth)
    with np.load(out / "normals.npz") as arrays:
        np.testing.assert_array_equal(arrays["mask"], analysis.mask)
    picture = imagecodecs.png_decode((out / "normals_opengl.png").read_bytes())
    there = analysis.determined()
    back = picture[there].astype(float) / 65535 * 2 - 1
    np.testing.assert_allclose(back, shape.normals[there], atol=4e-5)
    np.testing.assert_allclose(
        read_lights(out / "lights.lp", analysis.names),
        shape.lights / np.linalg.norm(shape.lights, axis=1, keepdims=True),
        atol=1e-5,
    )
    for name in ("mesh.ply", "mesh.obj"):
        assert b"unit: pixels" in (out / name).read_bytes()
    said, err = capsys.readouterr()
    assert ": resolved by 5 points of known normal" in said
    assert re.search(r"residual: [\d.e-]+, rms angle between .* degrees\n", said)
    assert f"to {out}" in said
    assert err == ""


def test_a_result_gives_the_same_bytes_as_its_stack_and_keeps_its_labels(
    stack: Path, result: Path, points: Path, tmp_path: Path
) -> None:
    run(["shape", stack, tmp_path / "a", "--points", points])
    run(["shape", result, tmp_path / "b", "--points", points, "--threads", "1"])
    for name in FILES - {"report.json"}:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    np.testing.assert_array_equal(load_result(tmp_path / "b").labels, load_result(result).labels)


def test_a_result_may_hold_its_own_shape(stack: Path, result: Path, points: Path, tmp_path) -> None:
    own = tmp_path / "own"
    shutil.copytree(result, own)
    run(["shape", own, own, "--points", points])
    assert {p.name for p in own.iterdir()} == FILES
    first = json.loads((own / "report.json").read_text())
    assert first["command"].startswith(f"photolin shape {own} {own}")
    assert first["stack"] == str(stack)
    run(["shape", own / "result.npz", own, *sphere(stack)])  # once more, by something else
    second = json.loads((own / "report.json").read_text())
    assert (first["shape"]["kind"], second["shape"]["kind"]) == ("points", "sphere")
    assert error(own, stack) < 1
    for report in (first, second):
        *stages, last = report["seconds"]
        assert last == "total"
        assert stages[0] == "load"
        assert stages[-1] == "shape"
        spent = sum(report["seconds"][name] for name in stages if name != "load")
        assert report["seconds"]["total"] == pytest.approx(spent, abs=1e-6)


def test_colour_images_give_colour_albedo(stack: Path, points: Path, tmp_path: Path) -> None:
    colour = tmp_path / "colour"
    colour.mkdir()
    tint = (1.0, 0.5, 0.25)
    for path in sorted((stack / "images").iterdir()):
        gray = imagecodecs.png_decode(path.read_bytes())
        rgb = np.stack([np.round(gray * t) for t in tint], axis=2).astype(np.uint16)
        (colour / path.name).write_bytes(imagecodecs.png_encode(rgb))
    shutil.copy(stack / "mask.png", colour)
    run(["shape", colour, tmp_path / "out", "--points", points])
    albedo = tifffile.imread(tmp_path / "out" / "albedo.tif")
    assert albedo.shape == (*SIZE, 3)
    there = (np.isfinite(albedo) & (albedo > 0.01)).all(axis=2)
    assert there.mean() > 0.2
    np.testing.assert_allclose(
        np.median(albedo[there] / albedo[there][:, :1], axis=0), tint, rtol=0.01
    )


# Every option


def test_points_on_a_sphere_the_sphere_and_lights_of_some_images_all_find_the_normals(
    stack: Path, result: Path, tmp_path: Path, capsys
) -> None:
    pixels = tmp_path / "pixels.txt"
    pixels.write_text("row\tcolumn\n" + "".join(f"{r}\t{c}\n" for r, c in PIXELS))
    truth = load_truth(stack)
    lights = truth.lights * truth.power[:, None]
    some = tmp_path / "some.txt"
    some.write_text(
        "".join(f"{k:03d}.png {' '.join(map(str, lights[k]))}\n" for k in (3, 0, 7, 12, 15))
    )
    for name, options in {
        "points": ["--points", pixels, *sphere(stack)],
        "sphere": sphere(stack),
        "some lights": ["--some-lights", some],
    }.items():
        run(["shape", result, tmp_path / name, *options])
        assert error(tmp_path / name, stack) < 1.5
        shape = load_shape(tmp_path / name)
        assert shape is not None
        assert shape.resolved.kind == name
        assert shape.resolved.note in capsys.readouterr().out


def test_without_anything_known_it_says_what_was_assumed(result: Path, tmp_path, capsys) -> None:
    run(["shape", result, tmp_path])
    said = capsys.readouterr().out
    assert re.search(r"residual: [\d.e-]+, rms of dp/dy - dq/dx relative to", said)


def test_lights_of_the_stack_are_used_and_no_fit_is_claimed(lit: Path, tmp_path, capsys) -> None:
    run(["shape", lit, tmp_path])
    said = capsys.readouterr().out
    assert ": resolved by the lights given with the stack\n" in said
    assert "residual" not in said
    assert error(tmp_path, lit.parent) < 0.5
    assert load_result(tmp_path).lights is not None


def test_unknown_powers_are_found_and_no_result_is_taken_for_a_stack(
    stack: Path, tmp_path: Path, capsys
) -> None:
    folder = tmp_path / "stack"
    shutil.copytree(stack, folder)
    truth = load_truth(stack)
    np.savetxt(folder / "lights.txt", truth.lights)  # of length 1, powers differ by a fifth
    run(["shape", folder, tmp_path / "given"])
    said = capsys.readouterr().out
    assert "warning: the light powers given, which are all equal, are not those of" in said
    assert "\nlights: lights.txt\n" in said
    out = tmp_path / "found"
    run(["shape", folder, out, "--powers", "unknown"])
    said = capsys.readouterr().out
    assert "powers: found from the images" in said
    assert "are not those" not in said
    assert error(out, stack) < 0.05
    assert error(tmp_path / "given", stack) > 0.5
    shape = load_shape(out)
    assert shape is not None
    ratio = np.linalg.norm(shape.lights, axis=1) / truth.power
    np.testing.assert_allclose(ratio, ratio.mean(), rtol=1e-3)
    assert json.loads((out / "report.json").read_text())["load"]["lights"] == "none"
    line = complaint(["shape", out, tmp_path / "b", "--powers", "unknown"], capsys)
    assert "is a result, linearized with what was known of its lights" in line
    line = complaint(["shape", stack, tmp_path / "b", "--powers", "unknown"], capsys)
    assert "has no lights; with powers unknown, a stack with light directions" in line
    both = ["--powers", "unknown", *sphere(stack)]
    assert "powers unknown takes" in complaint(["shape", folder, tmp_path / "b", *both], capsys)


def test_lights_with_y_down_are_warned_of_by_shape_and_run_and_kept(
    stack: Path, tmp_path: Path, capsys
) -> None:
    truth, down = load_truth(stack), tmp_path / "down.txt"
    np.savetxt(down, truth.lights * truth.power[:, None] * (1, -1, 1))
    warned = "warning: the normals belong to no surface as they are"
    for verb in ("shape", "run"):
        run([verb, stack, tmp_path / verb, "--lights", down])
        said = capsys.readouterr().out
        assert warned in said
        assert "with y turned round they do" in said
    shape = load_shape(tmp_path / "shape")
    assert shape is not None
    assert "y turned round" in shape.resolved.doubts[0]


def test_a_sphere_that_is_none_is_doubted_or_refused(
    stack: Path, result: Path, tmp_path: Path, capsys
) -> None:
    run(["shape", result, tmp_path / "a", *sphere(stack)])
    assert "of the sphere's pixels are off" not in capsys.readouterr().out
    run(["shape", result, tmp_path / "a", "--sphere", "5", "5", "150"])
    assert re.search(r"warning: \d+ % of the sphere's pixels are off by", capsys.readouterr().out)


def test_points_win_over_lights_of_the_stack(lit: Path, points: Path, tmp_path, capsys) -> None:
    run(["shape", lit, tmp_path, "--points", points])
    said = capsys.readouterr().out
    assert "resolved by 5 points of known normal" in said
    assert "the lights given with the stack served the linearization alone" in said


def test_a_pixel_s_side_makes_lengths_mm(stack: Path, result: Path, points, tmp_path) -> None:
    run(["shape", result, tmp_path / "px", "--points", points])
    run(["shape", result, tmp_path / "mm", "--points", points, "--px-mm", "0.5"])
    depth = [tifffile.imread(tmp_path / name / "depth.tif") for name in ("px", "mm")]
    np.testing.assert_allclose(depth[1], depth[0] / 2, rtol=1e-6)
    assert b"unit: mm" in (tmp_path / "mm" / "mesh.ply").read_bytes()
    assert json.loads((tmp_path / "mm" / "report.json").read_text())["shape"]["depth_unit"] == "mm"
    with np.load(tmp_path / "mm" / "result.npz") as arrays:
        np.testing.assert_allclose(arrays["depth"], depth[1], rtol=1e-6)


def test_directx_turns_green_over_and_nothing_else(result: Path, points: Path, tmp_path) -> None:
    pictures = []
    for name, options in {"opengl": [], "directx": ["--directx"]}.items():
        run(["shape", result, tmp_path / name, "--points", points, *options])
        png = (tmp_path / name / f"normals_{name}.png").read_bytes()
        pictures.append(imagecodecs.png_decode(png).astype(int))
    there = pictures[0].any(axis=2)
    np.testing.assert_array_equal(pictures[0][..., ::2], pictures[1][..., ::2])
    assert np.abs(pictures[0] + pictures[1] - 65535)[there][:, 1].max() <= 1
    assert not (tmp_path / "directx" / "normals_opengl.png").exists()


def test_options_of_analysis_and_reading_reach_a_stack(stack: Path, tmp_path: Path) -> None:
    options = "--T 0.03 --Ts 0.004 --method classification --samples 50 --seed 3 --roi 4 60 8 76"
    run(["shape", stack, tmp_path, *options.split(), *sphere(stack)[:1], "25.5", "31.5", "29"])
    analysis = load_result(tmp_path)
    assert (analysis.options.T, analysis.options.Ts, analysis.options.seed) == (0.03, 0.004, 3)
    assert (analysis.options.method, analysis.options.samples) == ("classification", 50)
    assert analysis.labels.shape == (16, 56, 68)
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["load"]["roi"] == [4, 60, 8, 76]


def test_images_that_moved_are_named_with_stack(
    stack: Path, result: Path, points: Path, tmp_path: Path, capsys
) -> None:
    own = tmp_path / "own"
    shutil.copytree(result, own)
    report = json.loads((own / "report.json").read_text()) | {"stack": str(tmp_path / "gone")}
    (own / "report.json").write_text(json.dumps(report))
    line = complaint(["shape", own, tmp_path / "out", "--points", points], capsys)
    assert "gone is missing); name them with --stack" in line
    run(["shape", own, tmp_path / "out", "--points", points, "--stack", stack])
    assert json.loads((tmp_path / "out" / "report.json").read_text())["stack"] == str(stack)


def test_run_writes_normals_and_albedo_where_lights_are_known(
    stack: Path, lit: Path, result: Path, tmp_path: Path
) -> None:
    assert load_shape(result) is None
    run(["run", lit, tmp_path])
    assert {p.name for p in tmp_path.iterdir()} == {"result.npz", "report.json"}
    shape = load_shape(tmp_path)
    assert shape is not None
    assert shape.depth is None
    assert error(tmp_path, stack) < 0.5
    report = json.loads((tmp_path / "report.json").read_text())
    assert list(report["seconds"])[-2:] == ["shape", "total"]


# Every error


def test_what_cannot_go_together_is_said_before_any_analysis(
    stack: Path, points: Path, tmp_path: Path, capsys, monkeypatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise AssertionError("work was done")

    monkeypatch.setattr("photolin.verbs.shape.analyze", fail)
    pixels, some = tmp_path / "pixels.txt", tmp_path / "some.lp"
    pixels.write_text("1 2\n3 4\n5 6\n7 8\n")
    some.write_text("000.png 0 0 1\n001.png 0 1 1\n002.png 1 0 1\n003.png 1 1 1\n")
    out, ball = tmp_path / "out", sphere(stack)
    both = "lights and points or a sphere are known; one of them is accepted"
    for options, words in (
        ([*ball, "--some-lights", some], both),
        (["--points", points, "--some-lights", some], both),
        (["--points", points, *ball], "points have normals and a sphere; one of them is accepted"),
        (["--points", pixels], "points without normals; accepted with the sphere they lie on"),
        (["--points", tmp_path / "gone"], "gone: cannot be read (No such file"),
        (["--points", tmp_path], "cannot be read (Is a directory)"),
        (["--points", stack / "gt.npz"], "gt.npz: is not text"),
        (["--some-lights", points], "line 1: 'row,column,x,y,z' is not three numbers"),
        (["--sphere", "1", "2"], "'--sphere'. Expected 3 values"),
        (["--sphere", "1", "2", "x"], "--sphere is 1 2 x; FLOAT FLOAT FLOAT is accepted"),
        (["--px-mm", "0"], "px_mm is 0; accepted are mm from 1e-06 to 1e+06"),
        (["--px-mm", "-1"], "px_mm is -1; accepted are mm"),
        (["--px-mm", "nan"], "px_mm is nan; accepted are mm"),
        (["--px-mm", "1e300"], "px_mm is 1e+300; accepted are mm"),
        (["--px-mm", "x"], "--px-mm is x; FLOAT is accepted"),
        (["--fly"], "--fly; photolin shape --help lists"),
        (["--T", "2"], "T is 2; accepted is a number above 0"),
    ):
        assert words in complaint(["shape", stack, out, *options], capsys)
        assert not out.exists()


def test_points_that_cannot_be_used_are_named(stack: Path, result: Path, tmp_path, capsys) -> None:
    shape, truth = tmp_path / "out", load_truth(stack)
    rows = [(*p, *truth.normals[p].tolist()) for p in PIXELS]
    outside_mask = tuple(int(i) for i in np.argwhere(~truth.mask)[0])
    for row, words in (
        ((60, 4, 0, 0, 1), "row 60, column 4 is outside the image of 60 rows and 80 columns"),
        ((-1, 4, 0, 0, 1), "row -1, column 4 is outside the image"),
        ((*outside_mask, 0, 0, 1), "has no linearized bases (outside the mask, or lit in too few"),
        ((*PIXELS[0], 0, 0, 2), "has length 2; unit vectors x y z are accepted"),
        ((*PIXELS[0], 0, 0, -1), "faces away from the camera; z above 0 is accepted"),
    ):
        table = tmp_path / "points.txt"
        table.write_text("".join(" ".join(map(str, r)) + "\n" for r in [*rows, row]))
        assert words in complaint(["shape", result, shape, "--points", table], capsys)
    table.write_text("".join(" ".join(map(str, r)) + "\n" for r in rows[:3]))
    line = complaint(["shape", result, shape, "--points", table], capsys)
    assert "3 points of known normal; at least 4 are needed" in line
    table.write_text("".join(f"{r} {c}\n" for r, c in [*PIXELS, (0, 0)]))
    line = complaint(["shape", result, shape, "--points", table, *sphere(stack)], capsys)
    assert "row 0, column 0 is outside the sphere" in line
    line = complaint(["shape", result, shape, "--sphere", "30", "40", "-3"], capsys)
    assert "a radius above 0 pixels" in line
    assert not shape.exists()


def test_outputs_that_hold_the_images_or_are_files_are_refused(
    stack: Path, result: Path, points: Path, tmp_path: Path, capsys
) -> None:
    before = sorted(p.name for p in stack.iterdir())
    for path in (stack, result):
        line = complaint(["shape", path, stack, "--points", points], capsys)
        assert "holds the images; another folder is accepted" in line
    line = complaint(["shape", stack, stack / "images", "--points", points], capsys)
    assert "images: holds the images; another folder is accepted" in line
    assert sorted(p.name for p in stack.iterdir()) == before
    (tmp_path / "file").write_text("mine")
    for verb in ("shape", "lights"):
        assert "file: is a file; a folder" in complaint([verb, stack, tmp_path / "file"], capsys)
    assert "no/such: " in complaint(["shape", "no/such", tmp_path / "out"], capsys)
    assert not (tmp_path / "out").exists()


def test_files_that_were_read_are_not_replaced(lit: Path, balls: Path, tmp_path, capsys) -> None:
    images = tmp_path / "depth.tif"
    pages = np.stack([imagecodecs.png_decode(p.read_bytes()) for p in sorted(lit.glob("*.png"))])
    tifffile.imwrite(images, pages, photometric="minisblack")
    before = images.read_bytes()
    lights = ["--lights", str(lit / "lights.txt")]
    line = complaint(["shape", images, tmp_path, *lights], capsys)
    assert "depth.tif: is part of the input and would be replaced; another folder" in line
    assert images.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["depth.tif"]
    shots = tmp_path / "shots"
    shutil.copytree(balls, shots)
    np.savetxt(shots / "light_directions.txt", sky())
    line = complaint(["lights", shots, shots], capsys)
    assert "light_directions.txt: is part of the input" in line


@pytest.mark.parametrize(
    ("interruption", "status"), [(KeyboardInterrupt(), 130), (OSError(28, "No space left"), 2)]
)
@pytest.mark.parametrize("at", ["result.npz", "depth.tif", "lights.lp"])
def test_an_interrupted_write_leaves_what_was_there(
    result: Path, points: Path, tmp_path: Path, monkeypatch, capsys, at, interruption, status
) -> None:
    own = tmp_path / "own"
    shutil.copytree(result, own)
    (own / "depth.tif").write_bytes(b"of old")
    before = {p.name: p.read_bytes() for p in own.iterdir()}
    real = Path.write_bytes

    def half(path: Path, data: bytes) -> int:
        real(path, data[:9])
        if at in path.name:
            raise interruption
        return real(path, data)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_bytes", half)
        assert main(["shape", str(result), str(own), "--points", str(points)]) == status
    assert re.fullmatch(r"photolin: [^\n]+\n", capsys.readouterr().err)
    assert {p.name: p.read_bytes() for p in own.iterdir()} == before


# Lights from a ball


@pytest.fixture(scope="module")
def balls(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("balls") / "ball"
    folder.mkdir()
    images, mask = mirror(sky())
    for k, image in enumerate(images):
        png = imagecodecs.png_encode(np.round(image * 65535).astype(np.uint16))
        (folder / f"ball{k}.png").write_bytes(png)
    (folder / "mask.png").write_bytes(imagecodecs.png_encode(mask.astype(np.uint8) * 255))
    return folder


def test_a_mirror_ball_gives_its_lights_as_files(balls: Path, tmp_path: Path, capsys) -> None:
    run(["lights", balls, tmp_path])
    # no powers, which a ball does not show: those of a stack in the same folder stay
    assert {p.name for p in tmp_path.iterdir()} == {"lights.lp", "light_directions.txt"}
    names = load_stack(balls).names
    for name in ("lights.lp", "light_directions.txt"):
        found = read_lights(tmp_path / name, names)
        assert angles_between(found, sky()).max() < 0.5
    said = capsys.readouterr().out
    assert "ball: centre row 72.3, column 81.6, radius 60.0 pixels" in said
    assert said.endswith(
        f"directions, no powers\nnext: photolin shape STACK OUT --some-lights "
        f"{tmp_path / 'lights.lp'}\n"
    )
    assert "warning" not in said


def test_its_lp_file_counts_and_names_the_images(balls: Path, tmp_path: Path) -> None:
    run(["lights", balls, tmp_path])
    count, *lines = (tmp_path / "lights.lp").read_text().splitlines()
    assert count == "8"
    assert [line.split()[0] for line in lines] == [f"ball{k}.png" for k in range(8)]


def test_a_ball_without_mask_or_without_a_spot_is_refused(
    balls: Path, tmp_path: Path, capsys
) -> None:
    bare = tmp_path / "bare"
    shutil.copytree(balls, bare)
    (bare / "mask.png").unlink()
    line = complaint(["lights", bare, tmp_path / "out"], capsys)
    assert "has no mask; mark the ball's disc with the option mask" in line
    dark = tmp_path / "dark"
    shutil.copytree(balls, dark)
    mask = imagecodecs.png_decode((balls / "mask.png").read_bytes())
    flat = np.where(mask > 0, np.uint16(3000), np.uint16(0))
    (dark / "ball3.png").write_bytes(imagecodecs.png_encode(flat))
    line = complaint(["lights", dark, tmp_path / "out"], capsys)
    assert "image ball3.png shows no spot on the ball; take it out, or mark the ball better" in line
    assert not (tmp_path / "out").exists()


def test_normals_on_fewer_than_three_diffuse_observations_are_counted() -> None:
    scene = render_scene("sphere_cone", size=(24, 32), images=8)
    result = analyze(scene.stack, Options(T=0.05, Ts=0.02, samples=50))
    assert result.confidence is not None
    diffuse = np.where(result.mask, 8, 0).astype(np.uint16)
    resolved = resolve_ambiguity(result)
    for few in (0, 5):
        diffuse[0, :few] = 2
        weak = replace(result, confidence=replace(result.confidence, diffuse=diffuse.copy()))
        said = shape_summary(weak, resolved)
        assert ("marked: 5 normals rest on fewer than three" in said) == (few == 5)
