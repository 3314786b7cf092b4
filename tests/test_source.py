"""What an inspector looks at, and the files and the command that come of it."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

from photolin.analysis import Options
from photolin.cli import main
from photolin.errors import InputError
from photolin.export import load_result
from photolin.factors import Thresholds
from photolin.load import LoadOptions, load_stack
from photolin.load.exclude import exclude_images
from photolin.pipeline import analyze
from photolin.synthetic import render_scene, write_scene
from webapp.source import Source

SCENE = render_scene("sphere_cone", size=(24, 30), images=8)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_scene(SCENE, tmp_path / "scene")
    return tmp_path / "scene"


def test_the_command_of_what_is_shown_makes_it_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder.parent)
    source = Source(load_stack(folder), options=Options(seed=3), path=folder)
    options, thresholds = Options(seed=3, T=0.04, Ts=0.01), Thresholds(0.04, 0.01)
    shown = analyze(exclude_images(source.stack, [2]), options)
    command = source.command(options, thresholds, (2,))
    assert command is not None
    assert main(shlex.split(command)[1:]) == 0
    made = load_result(folder.parent / "scene_result")
    assert np.array_equal(made.labels, shown.labels)
    assert np.array_equal(made.linearized_bases, shown.linearized_bases, equal_nan=True)
    report = json.loads(source.pack(shown, (2,))["report.json"])
    assert report["command"] == command
    assert report["load"]["exclude"] == [2]
    assert report["stack"] == str(folder)


def test_a_stack_in_memory_has_files_but_no_command() -> None:
    source = Source(SCENE.stack)
    result = analyze(SCENE.stack, Options(T=0.04, Ts=0.01, samples=50))
    assert source.command(result.options, result.thresholds, ()) is None
    report = json.loads(source.pack(result, ())["report.json"])
    assert (report["command"], report["stack"], report["load"]) == (None, None, None)


def test_how_the_stack_was_read_is_part_of_the_command(folder: Path) -> None:
    reading = LoadOptions(roi=(0, 20, 0, 30), exclude=(1,))
    source = Source(load_stack(folder), path=folder, reading=reading)
    command = source.command(Options(), Thresholds(0.05, 0.02), (3, 4))
    assert command is not None
    words = shlex.split(command)
    assert words[words.index("--exclude") :][1:3] == ["3", "4"]
    assert words[words.index("--roi") :][1:5] == ["0", "20", "0", "30"]


def test_a_truth_of_another_shape_is_refused() -> None:
    with pytest.raises(InputError, match=r"truth is of shape \(3, 24, 30\), the stack of \(8"):
        Source(SCENE.stack, truth=SCENE.truth.labels[:3])
