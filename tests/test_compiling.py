"""What is told while the loops are compiled, in this process and on a fresh machine."""

import os
import pty
import subprocess
import sys
import termios
from pathlib import Path

import numpy as np
import pytest
from numba import njit

from photolin.compiling import COMPILING, tell_compiling

ROOT = Path(__file__).parent.parent
Told = list[tuple[str, float]]


def compile_something() -> None:
    """Compile a loop that calls a loop."""
    inner = njit(lambda x: x + 1)
    outer = njit(lambda x: inner(x) * 2)
    assert outer(np.float32(3)) == 8


def test_compiling_is_told_for_as_long_as_it_lasts_and_then_the_stage_again() -> None:
    told: Told = []
    with tell_compiling(lambda *what: told.append(what)) as progress:
        progress("thresholds", 0.25)
        compile_something()
        progress("coefficients", 0.0)
    stages = [stage for stage, _ in told]
    inside = stages.count(COMPILING)
    assert inside >= 2  # the outer loop and the inner one within it
    assert stages == ["thresholds", *[COMPILING] * inside, "thresholds", "coefficients"]
    fractions = [fraction for stage, fraction in told if stage == COMPILING]
    assert fractions == sorted(fractions)
    assert 0 <= fractions[0] < fractions[-1] <= 1
    assert told[-2] == ("thresholds", 0.25)


def test_what_is_told_meanwhile_waits_until_the_end() -> None:
    told: Told = []
    with tell_compiling(lambda *what: told.append(what)) as progress:
        teller = progress.__self__
        teller.on_start(None)
        progress("linearize", 0.5)
        assert [stage for stage, _ in told] == [COMPILING]
        teller.on_end(None)
    assert told[1:] == [("linearize", 0.5)]


def test_nothing_is_told_of_what_is_compiled_already_or_later() -> None:
    told: Told = []
    loop = njit(lambda x: x - 1)
    loop(np.float32(2))
    with tell_compiling(lambda *what: told.append(what)):
        loop(np.float32(5))
    compile_something()
    assert told == []


@pytest.fixture
def command(tmp_path: Path) -> list[str]:
    """A run of a small stack whose loops are replaced by one that compiles at once."""
    np.save(tmp_path / "stack.npy", np.random.default_rng(0).random((6, 8, 8), np.float32))
    code = (
        "import sys, numpy, numba, photolin.cli as cli, photolin.errors as errors\n"
        "def analyze(*_, progress, **__):\n"
        "    progress('thresholds', 0.0)\n"
        "    numba.njit(lambda x: x + 1)(1)\n"
        "    raise errors.InputError('enough')\n"
        "cli.analyze = analyze\n"
        "sys.exit(cli.main(sys.argv[1:]))"
    )
    return [sys.executable, "-c", code, "run", str(tmp_path / "stack.npy"), str(tmp_path / "out")]


def test_a_first_run_says_so_in_one_line_where_there_is_no_terminal(command: list[str]) -> None:
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ran.stdout == ""
    assert ran.stderr == f"photolin: {COMPILING}\nphotolin: enough\n"


def test_a_first_run_says_so_in_the_progress_bar_of_a_terminal(command: list[str]) -> None:
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 100))
    with subprocess.Popen(command, cwd=ROOT, stderr=theirs) as process:
        os.close(theirs)
        seen = b""
        try:
            while part := os.read(ours, 4096):
                seen += part
        except OSError:  # the other end is closed
            pass
    os.close(ours)
    assert process.returncode == 2
    assert COMPILING.encode() in seen
    assert b"photolin: compiling" not in seen
