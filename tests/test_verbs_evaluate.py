"""The verb evaluate: surfaces of results and stacks, DiLiGenT folders as truth, every error."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import complaint
from scipy.io import savemat

from photolin.cli import main
from photolin.console import explain_measures
from photolin.synthetic import load_truth

FIGURES = ("normals", "depth", "lights as found")


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scene") / "small"
    size = ["--size", "60", "80", "--images", "16"]
    assert main(["synth", "sphere_obstacles", str(folder), *size]) == 0
    return folder


@pytest.fixture(scope="module")
def lit(stack: Path) -> Path:
    """A file of the stack's lights."""
    truth, path = load_truth(stack), stack.parent / "lights.txt"
    np.savetxt(path, truth.lights * truth.power[:, None])
    return path


@pytest.fixture(scope="module")
def results(stack: Path, lit: Path) -> dict[str, Path]:
    """Without a shape, with normals alone, and with all of it."""
    out = {name: stack.parent / name for name in ("plain", "normals", "shape")}
    lights = ["--lights", str(lit)]
    assert main(["run", str(stack), str(out["plain"])]) == 0
    assert main(["run", str(stack), str(out["normals"]), *lights]) == 0
    assert main(["shape", str(stack), str(out["shape"]), *lights]) == 0
    return out


@pytest.fixture
def benchmark_folder(stack: Path, tmp_path: Path) -> Path:
    """The scene in the layout of DiLiGenT, without labels."""
    folder, truth = tmp_path / "diligent", load_truth(stack)
    shutil.copytree(stack / "images", folder)
    shutil.copy(stack / "mask.png", folder)
    savemat(folder / "Normal_gt.mat", {"Normal_gt": truth.normals.astype(float)})
    np.savetxt(folder / "light_directions.txt", truth.lights)
    np.savetxt(folder / "light_intensities.txt", np.repeat(truth.power[:, None], 3, axis=1))
    return folder


def say(arguments: list[str | Path], capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    assert main([str(a) for a in arguments]) == 0
    said = capsys.readouterr().out
    measured, _, legend = said.partition(explain_measures(said))
    assert legend == "\n"
    return measured


def figures(said: str) -> set[str]:
    return {name for name in FIGURES if f"\n{name} " in said}


def test_a_result_is_measured_by_what_it_has(stack: Path, results: dict[str, Path], capsys) -> None:
    expected = {"plain": set(), "normals": {"normals", "lights as found"}, "shape": set(FIGURES)}
    for name, out in results.items():
        said = say(["evaluate", out, stack], capsys)
        assert "macro accuracy" in said
        assert figures(said) == expected[name]
    mean = re.search(
        r"normals +mean ([\d.]+), median [\d.]+ degrees over \d+ pixels; \d+ und", said
    )
    assert mean is not None
    assert float(mean[1]) < 0.5
    assert re.search(
        r"depth +rms [\d.]+, median [\d.]+, largest [\d.]+ mm over \d+ pixels in \d+ parts", said
    )
    assert "lights as found     0.000 degrees" in said


def test_every_figure_is_explained() -> None:
    whole = "macro p99 light error\nnormals  1\ndepth  1\nlights as found  1"
    explained = [line.split(":")[0] for line in explain_measures(whole).splitlines()]
    assert {*explained} >= {"macro", "rms", "p99", "light error", *FIGURES}
    assert explain_measures("no normals: depth") == ""


@pytest.mark.parametrize("lights", [False, True])
def test_a_stack_gets_the_three_tables(stack: Path, lit: Path, lights: bool, capsys) -> None:
    said = say(["evaluate", stack, *(["--lights", lit] if lights else [])], capsys)
    how = "the lights given with the stack" if lights else "five points of known normal"
    assert re.search(rf"Table 3: surfaces on \d+ pixels, .* resolved by {how}", said)
    table = said[said.index("Table 3") :].splitlines()
    assert [line.split()[0] for line in table[3:7]] == [
        "simple",
        "statistical",
        "classification",
        "robust",
    ]
    assert said.index("Table 1") < said.index("Table 2") < said.index("Table 3")


def test_a_benchmark_folder_is_a_truth_of_normals_and_lights(
    benchmark_folder: Path, results: dict[str, Path], capsys
) -> None:
    for truth in (benchmark_folder, benchmark_folder / "Normal_gt.mat"):
        said = say(["evaluate", results["shape"], truth], capsys)
        assert figures(said) == {"normals", "lights as found"}
        assert "\nlight error         0.000 degrees" in said
        assert "macro" not in said
    said = say(["evaluate", results["plain"], benchmark_folder], capsys)
    assert "no normals: photolin shape adds them to a result" in said
    assert "light error" in said


def test_a_benchmark_stack_is_its_own_truth(benchmark_folder: Path, capsys) -> None:
    said = say(["evaluate", benchmark_folder], capsys)
    assert "Table 1" not in said
    row = next(line for line in said.splitlines() if line.startswith("robust  "))
    assert float(row.split()[1]) < 0.5  # degrees
    assert row.split()[4:] == ["-"] * 4


def test_a_surface_that_cannot_be_compared_leaves_the_labels(tmp_path: Path, capsys) -> None:
    """All normals of a plane alike: no five points determine anything."""
    folder = tmp_path / "scene"
    size = ["--size", "60", "80", "--images", "16"]
    assert main(["synth", "sphere_obstacles", str(folder), *size]) == 0
    with np.load(folder / "gt.npz") as stored:
        arrays = dict(stored)
    arrays["normals"][:] = (0, 0, 1)
    np.savez(folder / "gt.npz", **arrays)
    said = say(["evaluate", folder], capsys)
    assert "Table 2" in said
    assert re.search(r"Table 3 is left out: the 5 points do not determine the ambiguity", said)


def test_truths_that_do_not_fit_are_refused(
    results: dict[str, Path], benchmark_folder: Path, tmp_path: Path, capsys
) -> None:
    shape = results["shape"]
    line = complaint(["evaluate", shape], capsys)
    assert (
        "name its ground truth after it: gt.npz, the folder that holds it, or a folder of" in line
    )
    assert "not found; a gt.npz" in complaint(["evaluate", shape, tmp_path], capsys)
    savemat(benchmark_folder / "Normal_gt.mat", {"Normal_gt": np.ones((4, 5, 3))})
    line = complaint(["evaluate", shape, benchmark_folder], capsys)
    assert "the truth is of 4 x 5 pixels; a result of the truth's own stack is accepted" in line
    line = complaint(["evaluate", benchmark_folder], capsys)
    assert "the images are of 60 x 80 pixels, the truth of 4 x 5" in line
    (benchmark_folder / "Normal_gt.mat").write_bytes(b"nothing")
    line = complaint(["evaluate", shape, benchmark_folder], capsys)
    assert "Normal_gt.mat: cannot be read as true normals" in line
