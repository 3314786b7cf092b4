"""The command line that makes a result again."""

import shlex
from dataclasses import fields, replace
from pathlib import Path

from .analysis import Options
from .factors import Thresholds
from .load import LoadOptions


def run_command(
    stack: str | Path,
    out: str | Path,
    options: Options,
    reading: LoadOptions,
    thresholds: Thresholds,
) -> str:
    """The line for a POSIX shell that reproduces a result byte for byte, by the same version.

    It names whatever differs from the defaults, and T and Ts always: suggested thresholds give the
    same result when they are given. Numbers have all their digits; paths are absolute, and links
    in them stay, as they may name the stack.

    Args:
        stack: folder or file that was read.
        out: folder for the result.
        options: as the run was asked; its T and Ts do not matter.
        reading: as the stack was read.
        thresholds: as the run used them; labels made later by others are not those of a run.
    """
    words = ["photolin", "run", str(Path(stack).absolute()), str(Path(out).absolute())]
    used = replace(options, T=thresholds.T, Ts=thresholds.Ts)
    for given, default in ((used, Options()), (reading, LoadOptions())):
        for field in fields(given):
            value = getattr(given, field.name)
            if value != getattr(default, field.name):
                words += [f"--{field.name.replace('_', '-')}", *_arguments(value)]
    return shlex.join(words)


def _arguments(value: object) -> list[str]:
    match value:
        case tuple():
            return [str(part) for part in value]
        case Path():
            return [str(value.absolute())]
        case float():
            return [repr(float(value))]  # numpy's own floats say their type
    return [str(value)]
