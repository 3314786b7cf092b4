"""The command line of a result: it says the same options, and running it gives the same bytes."""

import shlex
import subprocess
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from photolin import analyze, render_scene
from photolin.analysis import Options
from photolin.cli import VERBS, main
from photolin.command import run_command
from photolin.console import parse
from photolin.export import load_result
from photolin.factors import Thresholds
from photolin.load import LoadOptions, load_stack

USED = Thresholds(0.03125, 0.0071)
NASTY = "a b'c\"d$(e)`f`;*~\\\n-ä"


def parsed(line: str) -> tuple[Path, Path, Options, LoadOptions]:
    """What the command line's own parser makes of a line."""
    program, *words = shlex.split(line)
    assert program == "photolin"
    call = parse(VERBS, words)
    assert isinstance(call, partial)
    given = call.keywords
    assert call.args == ()
    assert given["threads"] is None
    return given["stack"], given["out"], given["analysis"], given["reading"]


@pytest.mark.parametrize(
    ("options", "reading"),
    [
        (Options(), LoadOptions()),
        (Options(method="statistical", samples=77, seed=2**32 - 1), LoadOptions(exclude=(0, 11))),
        (Options(base_images=(7, 1, 4)), LoadOptions(roi=(0, 5, 3, 99), offset=1e-17)),
        (Options(), LoadOptions(lights="none", channel="luminance", transfer="srgb")),
        (
            Options(method="classification"),
            LoadOptions(mask=Path("/m/-x y.png"), lights=Path("/none"), dark=Path(f"/{NASTY}")),
        ),
    ],
)
def test_the_parser_reads_back_what_was_written(options: Options, reading: LoadOptions) -> None:
    line = run_command("/data/s", f"/{NASTY}", options, reading, USED)
    used = replace(options, T=USED.T, Ts=USED.Ts)
    assert parsed(line) == (Path("/data/s"), Path(f"/{NASTY}"), used, reading)


@pytest.mark.parametrize("T", [1.0, 5e-324, 0.1 + 0.2, np.nextafter(0.05, 1)])
def test_no_digit_of_a_threshold_is_lost(T: float) -> None:
    for used in (Thresholds(T, 0.0), Thresholds(0.5, np.float64(T) / 7)):
        _, _, options, _ = parsed(run_command("s", "o", Options(), LoadOptions(), used))
        assert (options.T, options.Ts) == (used.T, used.Ts)


def test_defaults_are_left_out_and_thresholds_are_not() -> None:
    line = run_command("/s", "/o", Options(seed=3), LoadOptions(), Thresholds(0.05, 0.02))
    assert line == "photolin run /s /o --T 0.05 --Ts 0.02 --seed 3"


def test_thresholds_are_those_used_whatever_was_asked() -> None:
    line = run_command("/s", "/o", Options(T=0.5, Ts=0.5), LoadOptions(), Thresholds(0.05, 0.02))
    assert line == "photolin run /s /o --T 0.05 --Ts 0.02"


def test_paths_hold_from_any_folder_and_links_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "link.tif").symlink_to("no suffix")
    monkeypatch.chdir(tmp_path)
    reading = LoadOptions(mask=Path("m.png"), lights=Path("none"))
    stack, out, _, found = parsed(run_command("link.tif", "-o", Options(), reading, USED))
    assert (stack, out) == (tmp_path / "link.tif", tmp_path / "-o")
    assert found == LoadOptions(mask=tmp_path / "m.png", lights=tmp_path / "none")


def test_a_shell_takes_the_line_apart_as_it_was_put_together() -> None:
    reading = LoadOptions(mask=Path(f"/{NASTY}/m"), exclude=(1, 2))
    line = run_command(f"/{NASTY}", "/o", Options(), reading, USED)
    script = f"photolin() {{ printf '%s\\0' \"$@\"; }}; {line}"
    printed = subprocess.run(["/bin/sh", "-c", script], capture_output=True, check=True).stdout
    assert printed.decode().split("\0")[:-1] == shlex.split(line)[1:]


@pytest.mark.parametrize("given", [False, True])
def test_running_the_line_gives_the_same_bytes(given: bool, tmp_path: Path, capsys) -> None:
    folder = tmp_path / "it's a stack"
    folder.mkdir()
    scene = render_scene("sphere_cone", size=(48, 60), images=10, noise=0.01, bits=8).stack
    for k, image in enumerate(scene.images):
        Image.fromarray(np.round(image * 255).astype(np.uint8)).save(folder / f"{k}.png")
    Image.fromarray(scene.mask).save(folder / "mask.png")
    reading = LoadOptions(transfer="linear")
    options = Options()
    if given:
        reading = replace(reading, exclude=(6,), roi=(4, 44, 0, 60))
        options = Options(method="classification", base_images=(2, 5, 8), samples=60, seed=9)
    before = analyze(load_stack(folder, reading), options)
    line = run_command(folder, tmp_path / "out", options, reading, before.thresholds)
    assert main(shlex.split(line)[1:]) == 0
    after = load_result(tmp_path / "out")
    assert after.thresholds == before.thresholds
    assert after.base_images == before.base_images
    assert after.names == before.names
    for name in ("labels", "coefficients", "linearized_bases"):
        assert getattr(after, name).tobytes() == getattr(before, name).tobytes()
    assert "written" in capsys.readouterr().out
