"""The command line: what it writes, what it says, and how it ends."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import tifffile
from command_line import complaint
from PIL import Image

from photolin.analysis import Options
from photolin.cli import VERBS, main
from photolin.compiling import COMPILING
from photolin.errors import Cancelled
from photolin.export import load_result, load_result_stack, load_shape
from photolin.factors import Factor
from photolin.synthetic import load_truth
from webapp.source import Source

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scene") / "small"
    assert main(["synth", "sphere_cone", str(folder), "--size", "48", "64", "--images", "8"]) == 0
    return folder


@pytest.fixture(scope="module")
def result(stack: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("result") / "new" / "out"
    assert main(["run", str(stack), str(out), "--T", "0.02", "--Ts", "0.005", "--seed", "4"]) == 0
    return out


def test_run_writes_a_result_of_its_stack(stack: Path, result: Path) -> None:
    assert sorted(p.name for p in result.iterdir()) == ["report.json", "result.npz"]
    analysis = load_result(result)
    assert analysis.options == Options(T=0.02, Ts=0.005, seed=4)
    assert analysis.labels.shape == (8, 48, 64)
    assert len(analysis.files) >= 8


def test_the_report_says_how_the_result_came_about(stack: Path, result: Path) -> None:
    report = json.loads((result / "report.json").read_text())
    assert report["command"].startswith(f"photolin run {stack} {result} --T 0.02")
    assert {"load", "total"} <= set(report["seconds"])
    stages = {k: v for k, v in report["seconds"].items() if k not in ("load", "total")}
    assert report["seconds"]["total"] == pytest.approx(sum(stages.values()), rel=0.2)
    assert report["seed"] == 4
    assert len(report["files"][0]["sha256"]) == 64


def test_run_sums_up_what_it_did(stack: Path, tmp_path: Path, capsys) -> None:
    assert main(["run", str(stack), str(tmp_path), "--base-images", "0", "1", "2"]) == 0
    said, err = capsys.readouterr()
    assert err in ("", f"photolin: {COMPILING}\n")  # no progress bar where stderr is no terminal
    analysis = load_result(tmp_path)
    assert f"T {analysis.thresholds.T:.4g}, Ts {analysis.thresholds.Ts:.4g}" in said
    assert "base images: 0 (000.png), 1 (001.png), 2 (002.png)" in said
    share = (analysis.labels == Factor.CAST).mean()
    assert f"cast shadow {share:.1%}" in said
    assert f"written {tmp_path / 'result.npz'}" in said
    assert all(note in said for note in analysis.notes)


@pytest.mark.parametrize("threads", ["1", "3"])
def test_the_same_command_gives_the_same_bytes(
    stack: Path, result: Path, tmp_path: Path, threads: str
) -> None:
    again = ["run", str(stack), str(tmp_path), "--T", "0.02", "--Ts", "0.005", "--seed", "4"]
    assert main([*again, "--threads", threads]) == 0
    assert (tmp_path / "result.npz").read_bytes() == (result / "result.npz").read_bytes()


def test_every_option_reaches_the_run(stack: Path, tmp_path: Path) -> None:
    options = "--method statistical --samples 20 --roi 4 40 8 56 --lights none --transfer linear"
    assert main(["run", str(stack), str(tmp_path), *options.split(), "--channel", "max"]) == 0
    analysis = load_result(tmp_path)
    assert (analysis.options.method, analysis.options.samples) == ("statistical", 20)
    assert analysis.labels.shape == (8, 36, 48)
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["load"]["lights"] == "none"
    assert report["load"]["channel"] == "max"


def test_a_result_finds_its_stack_again(stack: Path, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(stack.parent)
    mask = np.zeros((48, 64), np.uint8)
    mask[10:, 5:50] = 255
    Image.fromarray(mask).save("object.png")
    options = "--T 0.02 --roi 4 40 8 56 --mask object.png"
    assert main(["run", "small", str(tmp_path), *options.split()]) == 0
    monkeypatch.chdir(tmp_path)
    found = load_result_stack(tmp_path)
    assert np.array_equal(found.mask, mask[4:40, 8:56] > 0)
    assert {digest for _, digest in found.files} == {d for _, d in load_result(tmp_path).files}


def test_what_inspect_lets_download_finds_its_stack_again(
    stack: Path, tmp_path: Path, monkeypatch
) -> None:
    served: list[Source] = []
    monkeypatch.setattr("webapp.app.serve", lambda source, **_: served.append(source))
    moved = tmp_path / "moved"
    shutil.copytree(stack, moved)
    roi = ["--roi", "4", "40", "8", "56"]
    assert main(["run", str(stack), str(tmp_path / "out"), "--T", "0.02", *roi]) == 0
    result = load_result(tmp_path / "out")
    for arguments, place in (
        ([stack, *roi], stack),
        ([tmp_path / "out"], stack),
        ([tmp_path / "out", "--stack", moved], moved),
    ):
        assert main(["inspect", *map(str, arguments)]) == 0
        report = json.loads(served[-1].pack(result, ())["report.json"])
        assert report["stack"] == str(place)
        assert report["load"]["roi"] == [4, 40, 8, 56]
        assert served[-1].stack.shape == (8, 36, 48)


def test_inspect_opens_a_result_with_the_shape_that_was_recovered_from_it(
    stack: Path, tmp_path: Path, monkeypatch
) -> None:
    served: list[Source] = []
    monkeypatch.setattr("webapp.app.serve", lambda source, **_: served.append(source))
    run, out = tmp_path / "run", tmp_path / "out"
    assert main(["run", str(stack), str(run), "--T", "0.02"]) == 0
    assert main(["shape", str(run), str(out), "--px-mm", "0.5"]) == 0
    for folder in (run, out):
        assert main(["inspect", str(folder)]) == 0
    without, found = (source.shape for source in served)
    expected = load_shape(out)
    assert without is None
    assert found is not None
    assert expected is not None
    assert np.array_equal(found.normals, expected.normals, equal_nan=True)
    assert np.array_equal(found.depth, expected.depth, equal_nan=True)
    assert found.px_mm == 0.5


def test_inspect_leaves_out_normals_that_a_run_made_by_the_way(
    stack: Path, tmp_path: Path, monkeypatch
) -> None:
    served: list[Source] = []
    monkeypatch.setattr("webapp.app.serve", lambda source, **_: served.append(source))
    lights = tmp_path / "lights.txt"
    truth = load_truth(stack)
    np.savetxt(lights, truth.lights * truth.power[:, None])
    out = tmp_path / "out"
    assert main(["run", str(stack), str(out), "--T", "0.02", "--lights", str(lights)]) == 0
    shape = load_shape(out)
    assert shape is not None
    assert shape.depth is None
    assert main(["inspect", str(out)]) == 0
    assert served[0].shape is None


def test_a_result_refuses_images_that_changed(stack: Path, tmp_path: Path, capsys) -> None:
    assert main(["synth", "sphere_cone", str(tmp_path / "a"), "--size", "32", "32"]) == 0
    assert main(["run", str(tmp_path / "a"), str(tmp_path / "out"), "--T", "0.02"]) == 0
    image = tmp_path / "a" / "images" / "004.png"
    image.write_bytes((stack / "images" / "004.png").read_bytes())
    for k in range(20):  # all of them, so that the stack is whole but another one
        other = tmp_path / "a" / "images" / f"{k:03d}.png"
        other.write_bytes((stack / "images" / f"{k % 8:03d}.png").read_bytes())
    line = complaint(["inspect", tmp_path / "out"], capsys)
    assert re.search(r"\d{3}\.png: is not the file .* --stack", line)


def test_run_refuses_to_write_over_its_input(stack: Path, tmp_path: Path, capsys) -> None:
    assert "holds the input" in complaint(["run", stack, stack], capsys)
    archive = tmp_path / "result.npz"
    np.savez(archive, images=np.ones((6, 4, 4)))
    assert "holds the input" in complaint(["run", archive, tmp_path], capsys)


def test_export_writes_what_was_asked(result: Path, tmp_path: Path) -> None:
    assert main(["export", str(result), str(tmp_path / "all")]) == 0
    assert len(list((tmp_path / "all").iterdir())) == 8 + 8 * 5 + 1
    one = ["export", str(result), str(tmp_path / "one"), "--what", "labels", "linearized"]
    assert main([*one, "--image", "3"]) == 0
    names = sorted(p.name for p in (tmp_path / "one").iterdir())
    assert names == ["labels_003.png", "linearized_003.tif"]
    analysis = load_result(result)
    page = tifffile.imread(tmp_path / "one" / names[1])
    with Image.open(tmp_path / "one" / names[0]) as image:
        assert np.array_equal(np.asarray(image), analysis.labels[3])
    assert np.array_equal(page, analysis.linearized(3), equal_nan=True)


def test_info_says_what_was_read(stack: Path, capsys) -> None:
    assert main(["info", str(stack)]) == 0
    said = capsys.readouterr().out
    assert "8 images of 48 rows x 64 columns" in said
    assert "16-bit" in said
    assert "007.png" in said


def test_evaluate_measures_a_result(stack: Path, result: Path, capsys) -> None:
    assert main(["evaluate", str(result), str(stack / "gt.npz")]) == 0
    said = capsys.readouterr().out
    assert "robust, T 0.02, Ts 0.005" in said
    assert "macro accuracy" in said
    assert all(f"\n{name}: " in said for name in ("macro", "rms", "p99", "light error"))


def test_evaluate_sets_all_methods_beside_the_paper(stack: Path, capsys) -> None:
    assert main(["evaluate", str(stack), "--T", "0.02", "--Ts", "0.005"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"paper +12\.46 +4\.40 +78\.16 +4\.97", said)
    for method in ("robust", "classification", "statistical"):
        assert f"{method}: T 0.02, Ts 0.005" in said
    assert re.search(r"\| +0\.00 +0\.00 +17\.49 +82\.51", said)
    assert all(f"\n{name}: " in said for name in ("macro", "rms", "p99", "light error"))
    first = said[: said.index("Table 3")].splitlines()
    widths = {len(line) for line in first if "|" in line and "paper" not in line}
    assert len(widths) == 1


def test_evaluate_needs_the_truth_of_a_result(result: Path, capsys) -> None:
    assert "name its ground truth" in complaint(["evaluate", result], capsys)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            [],
            "Expected one of {run, inspect, shape, export, report, evaluate, lights, synth, info}",
        ),
        (["fly"], "fly is no verb; accepted are run, inspect, shape, export, report, evaluate, "),
        (["Run", "a", "b"], "Run is no verb; accepted are run, "),
        (["--fly"], "--fly; photolin --help lists"),
        (["run"], "STACK OUT; photolin run --help lists"),
        (["run", "a", "b", "c"], "c; photolin run --help"),
        (["run", "a", "b", "--T", "x"], "--T is x; FLOAT is accepted"),
        (["run", "a", "b", "--T", "0"], "T is 0; accepted is a number above 0"),
        (["run", "a", "b", "--T", "nan"], "T is nan; accepted is a number above 0"),
        (["run", "a", "b", "--Ts", "1"], "Ts is 1; accepted is a number from 0 to below 1"),
        (["run", "a", "b", "--Ts"], "'--Ts'"),
        (["run", "a", "b", "--method", "magic"], "'magic' for argument '--method'"),
        (
            ["run", "a", "b", "--roi", "1", "2", "3"],
            "'--roi'. Expected 4 values; photolin run --help",
        ),
        (["run", "a", "b", "--roi", *"123x"], "--roi is 1 2 3 x; INT INT INT INT is accepted"),
        (["run", "a", "b", "--base-images", "1", "1", "2"], "three different image numbers"),
        (["run", "a", "b", "--seed", "-1"], "seed is -1; accepted is 0 to"),
        (["run", "a", "b", "--nonsense"], "--nonsense"),
        (["run", "no/such", "b"], "no/such: "),
        (["info", "no/such"], "no/such: "),
        (["export", "no/such", "b"], "no/such: "),
        (["inspect", "no/such"], "no/such: "),
        (["evaluate", "no/such"], "no/such"),
        (["synth", "moon", "b"], "'moon'; accepted are sphere_cone"),
        (["synth", "cup", "b", "--bits", "12"], "'12' for argument '--bits'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_wrong_command_gets_one_line_that_teaches(
    arguments: list[str], words: str, tmp_path: Path, monkeypatch, capsys
) -> None:
    monkeypatch.chdir(tmp_path)
    assert words in complaint(arguments, capsys)
    assert list(tmp_path.iterdir()) == []


def test_an_output_that_is_a_file_is_refused_before_any_work(stack: Path, tmp_path, capsys) -> None:
    (tmp_path / "out").write_text("mine")
    for arguments in (["run", stack], ["export", stack]):
        line = complaint([*arguments, tmp_path / "out"], capsys)
        assert "out: is a file; a folder" in line
    assert (tmp_path / "out").read_text() == "mine"


def test_an_empty_folder_leaves_no_output(tmp_path: Path, capsys) -> None:
    (tmp_path / "empty").mkdir()
    assert "empty" in complaint(["run", tmp_path / "empty", tmp_path / "out"], capsys)
    assert not (tmp_path / "out").exists()


def test_a_name_with_a_line_break_still_gets_one_line(capsys) -> None:
    assert "no such" in complaint(["info", "no\nsuch"], capsys)


@pytest.mark.parametrize("verb", sorted(VERBS))
def test_every_verb_explains_itself(verb: str, capsys) -> None:
    assert main([verb, "--help"]) == 0
    said = capsys.readouterr().out
    assert f"photolin {verb}" in said
    described = re.split(r"╭─ (?:positional )?(?:arguments|options)", said)[0]
    assert len(described.splitlines()) > 2
    assert not re.search(r"│ \S+ +\(required\) +│", said)  # an argument without an explanation


def test_help_shows_kinds_and_defaults_as_people_write_them(capsys, monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    for verb in VERBS:
        assert main([verb, "--help"]) == 0
    said = capsys.readouterr().out
    for shown in (
        "--base-images INT INT INT ",
        "--lights none|PATH ",
        "--roi INT INT INT INT ",
        "--size INT INT ",
        "--T FLOAT ",
        "(default: unset)",
    ):
        assert shown in said
    for hidden in ("(default: )", "(default: None)", "{INT", "{none}"):
        assert hidden not in " ".join(said.replace("│", "").split())


def test_the_version_is_told(capsys) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("photolin ")


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (Cancelled("linearize was cancelled"), 2, "linearize was cancelled"),
        (MemoryError(), 2, "--roi"),
        (KeyboardInterrupt(), 130, "stopped"),
        (ZeroDivisionError("by\nzero"), 1, "ZeroDivisionError: by zero .*please report"),
    ],
)
def test_an_error_in_a_run_gets_one_line_and_leaves_no_output(
    stack: Path, tmp_path: Path, monkeypatch, capsys, error: BaseException, status: int, words: str
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("photolin.cli.analyze", fail)
    assert main(["run", str(stack), str(tmp_path / "out")]) == status
    assert re.fullmatch(rf"photolin: .*{words}.*\n", capsys.readouterr().err)
    assert not (tmp_path / "out").exists()


def test_a_fault_shows_its_traceback_on_request(stack: Path, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("PHOTOLIN_DEBUG", "1")
    monkeypatch.setattr("photolin.cli.analyze", lambda *_, **__: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main(["run", str(stack), str(tmp_path / "out")])


@pytest.mark.parametrize("role", ["stack", "out", "mask", "truth"])
def test_links_that_go_in_circles_are_refused(
    stack: Path, tmp_path: Path, capsys, role: str
) -> None:
    (tmp_path / "loop").symlink_to("loop")
    loop, out = tmp_path / "loop", tmp_path / "out"
    arguments = {
        "stack": ["run", loop, out],
        "out": ["run", stack, loop],
        "mask": ["run", stack, out, "--mask", loop],
        "truth": ["evaluate", stack, loop],
    }[role]
    assert f"{loop}: " in complaint(arguments, capsys)
    assert not out.exists()


@contextmanager
def start(*arguments: str | Path, **streams: int) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "photolin", *map(str, arguments)]
    with subprocess.Popen(command, cwd=ROOT, text=True, **streams) as process:
        try:
            yield process
        finally:
            process.kill()


def test_ctrl_c_ends_a_process_with_130_and_nothing_half_written(tmp_path: Path) -> None:
    out, sample = tmp_path / "out", ROOT / "sample_data" / "sphere_cone"
    slow = ("--method", "classification", "--samples", "100000")  # takes most of a minute
    with start("run", sample, out, *slow, stderr=subprocess.PIPE) as process:
        time.sleep(3)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=10)
    assert process.returncode == 130
    assert err.replace(f"photolin: {COMPILING}\n", "") == "photolin: stopped\n"
    assert not out.exists()


def test_a_pipe_whose_reader_leaves_is_no_error(stack: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    with start("info", stack, stdout=write, stderr=subprocess.PIPE) as process:
        os.close(write)
        assert process.communicate(timeout=20)[1] == ""
    assert process.returncode == 0


@pytest.mark.parametrize(
    ("shell", "status", "err"),
    [
        ('exec "$@"', 0, ""),
        ('exec "$@" >&-', 0, ""),
        ('exec "$@" 2>&-', 0, ""),
        ('exec "$@" > /dev/full', 2, "photolin: .*No space left on device.*\n"),
    ],
    ids=["ascii", "no stdout", "no stderr", "full"],
)
def test_what_cannot_be_printed_is_no_fault(
    stack: Path, tmp_path: Path, shell: str, status: int, err: str
) -> None:
    named = tmp_path / "gr\u00f6\u00dfe"
    shutil.copytree(stack, named)
    command = ["sh", "-c", shell, "sh", sys.executable, "-m", "photolin", "info", str(named)]
    ascii_only = os.environ | {"PYTHONIOENCODING": "ascii:strict"}
    done = subprocess.run(command, cwd=ROOT, env=ascii_only, capture_output=True, check=False)
    assert done.returncode == status
    assert re.fullmatch(err, done.stderr.decode())
