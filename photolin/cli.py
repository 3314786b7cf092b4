"""The command line: the verbs, one line for whatever goes wrong.

Exit status: 0 done, 1 a fault of photolin, 2 something the user can mend, 130 stopped by Ctrl-C.
"""

import os
import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from .allocator import use_few_arenas
from .analysis import Options
from .console import (
    complain,
    mend_streams,
    parse,
    progress_bar,
    run_summary,
    stop_at_ctrl_c,
)
from .errors import OutputError
from .export import (
    CONTENTS,
    Contents,
    check_output,
    export_files,
    load_result,
    program_version,
    save_result,
    write_files,
)
from .load import LoadOptions
from .pipeline import analyze
from .verbs import COMMAND, bind, read_stack
from .verbs.evaluate import evaluate
from .verbs.inspect import inspect
from .verbs.report import report
from .verbs.scenes import info, synth
from .verbs.shape import lights, measure_shape, shape


def run(
    stack: Positional[Path],
    out: Positional[Path],
    analysis: Options = Options(),
    reading: LoadOptions = LoadOptions(),
    *,
    threads: int | None = None,
) -> None:
    """Linearize a stack, label every pixel, and write OUT/result.npz and OUT/report.json.

    With known lights, normals and albedo too.

    Args:
        stack: Folder of images, multi-page TIFF, .npy or .npz.
        out: Folder for the result; made when missing, an earlier result in it is replaced.
        threads: Processors to use; all when left out. The result does not depend on it.
    """
    check_output(out)
    if os.path.realpath(stack) in map(os.path.realpath, (out, out / "result.npz")):
        raise OutputError(f"{out}: holds the input; another folder is accepted")
    with progress_bar() as progress, stop_at_ctrl_c() as cancel:
        images, seconds = read_stack(stack, reading, progress)
        result = analyze(images, analysis, threads=threads, progress=progress, cancel=cancel)
        normals = None
        if images.lights is not None:
            result, normals = measure_shape(
                images, result, depth=False, threads=threads, progress=progress, cancel=cancel
            )
    result = replace(result, seconds={"load": seconds, **result.seconds})
    save_result(
        result,
        out,
        shape=normals,
        command=COMMAND.get(),
        stack_path=stack,
        load_options=reading,
    )
    print(run_summary(result, () if normals is None else normals.resolved.doubts))
    print(f"written {out / 'result.npz'} and {out / 'report.json'}")


def export(
    result: Positional[Path],
    out: Positional[Path],
    *,
    what: tuple[Contents, ...] = CONTENTS,
    image: Annotated[tuple[int, ...], arg(help_behavior_hint="")] = (),
) -> None:
    """Write the label maps, masks and linearized images of a result as files.

    Args:
        result: Folder that run wrote.
        out: Folder for the files; made when missing.
        what: labels: indexed PNG, pixel values 0 U, 1 D, 2 S, 3 A, 4 C, 255 outside the mask.
            masks: one PNG of 0 and 255 for each class. linearized: float32 TIFF, signed,
            fraction of full scale.
        image: Image numbers from 0; all when left out.
    """
    check_output(out)
    analysis = load_result(result)
    files: dict[str, bytes] = {}
    for contents in what or CONTENTS:
        files |= export_files(analysis, contents, image or None)
    write_files(out, files)
    print(f"written {len(files)} files to {out}")


VERBS = {
    verb.__name__: bind(verb)
    for verb in (run, inspect, shape, export, report, evaluate, lights, synth, info)
}
"""Name of each verb and what makes its call."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command line (without the program's name) and return its exit status."""
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    mend_streams()
    use_few_arenas()
    try:
        if arguments == ["--version"]:
            print(f"photolin {program_version()}")
            return 0
        COMMAND.set(shlex.join(["photolin", *arguments]))
        parse(VERBS, arguments)()
        sys.stdout.flush()
    except SystemExit:  # --help
        return 0
    except BrokenPipeError:  # the reader of a pipe, such as `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (Exception, KeyboardInterrupt) as error:
        return complain(error)
    return 0
