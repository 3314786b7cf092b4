"""Command lines made in the tests' own process."""

import re
from pathlib import Path

import pytest

from photolin.cli import main


def complaint(arguments: list[str | Path], capsys: pytest.CaptureFixture[str]) -> str:
    """The one line that a command line gets, with exit status 2."""
    capsys.readouterr()
    assert main([str(a) for a in arguments]) == 2
    line = capsys.readouterr().err
    assert re.fullmatch(r"photolin: [^\n]+\n", line), line
    assert "Traceback" not in line
    return line
