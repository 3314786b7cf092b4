"""The terminal's side: parsing, one-line complaints, a progress bar, summaries."""

import io
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr

import numpy as np
import tyro
from tqdm import tqdm

from .analysis import Analysis, Cancel, Progress
from .compiling import COMPILING, tell_compiling
from .errors import OptionError, PhotolinError
from .factors import OUTSIDE, TITLES
from .kinds import KINDS
from .shape.resolved import Resolved
from .stack import ImageStack

Call = Callable[[], None]
"""What a command line asks for, ready to be made."""

STYLE = (
    tyro.conf.DisallowNone,
    tyro.conf.FlagCreatePairsOff,
    tyro.conf.OmitArgPrefixes,
    tyro.conf.PositionalMetavarFromFieldName,
)


def parse(verbs: dict[str, Callable[..., Call]], arguments: Sequence[str]) -> Call:
    """The call a command line asks for; OptionError in one line instead of tyro's box."""
    if arguments and not arguments[0].startswith("-") and arguments[0] not in verbs:
        raise OptionError(f"{arguments[0]} is no verb; accepted are {', '.join(verbs)}")
    box = io.StringIO()
    try:
        with redirect_stderr(box):
            return tyro.extras.subcommand_cli_from_dict(
                verbs,
                prog="photolin",
                description="Tell diffuse, specular, attached and cast shadow apart.",
                args=list(arguments),
                config=STYLE,
                registry=KINDS,
            )
    except SystemExit as stop:
        if not stop.code:
            raise
    verb = [word for word in arguments[:1] if word in verbs]
    hint = " ".join(["photolin", *verb, "--help"])
    raise OptionError(f"{_unbox(box.getvalue())}; {hint} lists what is accepted") from None


def mend_streams() -> None:
    """Let printing neither fail where a stream is closed nor at names it has no letters for."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, io.StringIO())
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def complain(error: BaseException) -> int:
    """Print exactly one line on stderr and return the exit status that goes with it."""
    match error:
        case PhotolinError():
            status, message = 2, str(error)
        case MemoryError():
            status, message = 2, "memory is full; --roi reads a part of the images"
        case KeyboardInterrupt():
            status, message = 130, "stopped"
        case _ if os.environ.get("PHOTOLIN_DEBUG") == "1":
            raise error
        case OSError():  # what is printed, or the current folder: files of ours are PhotolinError
            where = error.filename or "the output or the current folder"
            status, message = (
                2,
                (
                    f"{where}: cannot be used ({error.strerror or error}); "
                    "a place that exists, with room and permission, is accepted"
                ),
            )
        case _:
            fault = f"{type(error).__name__}: {error}"
            status, message = 1, f"{fault} (a fault of photolin; please report it and the command)"
    print("photolin:", " ".join(message.split()), file=sys.stderr)
    return status


def _unbox(box: str) -> str:
    """The sentence in tyro's error box, without frame, colours, nested help and type names."""
    body: list[str] = []
    for framed in box.splitlines()[1:-1]:
        line = re.sub(r"\x1b\[[0-9;]*m", "", framed)[2:].rstrip(" │|")
        rule = re.fullmatch(r"[─-]{3,}", line.strip())
        if body and (rule or line.startswith("Got errors")):
            break
        if not rule and not line.startswith(" " * 8):
            body.append(line)
    sentence = " ".join(" ".join(body).split()).rstrip(".")
    return re.sub(r"^Error parsing (\S+): (?=.* is accepted$)", r"\1 is ", sentence)


@contextmanager
def stop_at_ctrl_c() -> Iterator[Cancel]:
    """Let Ctrl-C also stop the threads of a pool, which would else finish what is queued."""
    stop = threading.Event()

    def interrupt(*_: object) -> None:
        stop.set()
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, interrupt)
    try:
        yield stop.is_set
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """A bar on stderr while that is a terminal; otherwise one line, if there is compiling to do."""
    layout = "{desc:<14} {percentage:3.0f}% |{bar}| {elapsed}"
    stages: list[str] = []
    with tqdm(total=100, disable=None, leave=False, bar_format=layout, miniters=0) as bar:

        def report(stage: str, fraction: float) -> None:
            if bar.disable and stage == COMPILING and stage not in stages:
                print(f"photolin: {stage}", file=sys.stderr, flush=True)
            bar.set_description_str(stage, refresh=False)
            bar.update(100 * fraction - bar.n)
            if stages[-1:] != [stage]:
                stages.append(stage)
                bar.refresh()

        with tell_compiling(report) as progress:
            yield progress


def thresholds(result: Analysis) -> str:
    return f"T {result.thresholds.T:.4g}, Ts {result.thresholds.Ts:.4g}"


def run_summary(result: Analysis, doubts: Sequence[str] = ()) -> str:
    """What a run decided and found, for people; `doubts` are those of its normals."""
    inside = result.labels[result.labels != OUTSIDE]
    shares = ", ".join(f"{title} {(inside == f).mean():.1%}" for f, title in TITLES.items())
    bases = ", ".join(f"{k} ({result.names[k]})" for k in result.base_images)
    K, H, W = result.labels.shape
    return "\n".join(
        [
            f"{result.title}: {K} images of {H} rows x {W} columns, method {result.options.method}",
            f"thresholds: {thresholds(result)}",
            f"base images: {bases}",
            f"labels: {shares}",
            *remarks(result),
            *(f"warning: {text}" for text in doubts),
            f"seconds: {result.seconds['total']:.2f} (reading {result.seconds['load']:.2f})",
        ]
    )


def shape_summary(result: Analysis, resolved: Resolved) -> str:
    """What was read, how the shape was found, and what is wrong with it, a line each."""
    lines = [*result.notes, f"{result.title}: {resolved.note}"]
    if resolved.residual:
        lines.append(f"residual: {resolved.residual:.3g}, {resolved.residual_means}")
    undetermined = np.count_nonzero(result.mask & ~result.determined())
    if undetermined:
        pixels = np.count_nonzero(result.mask)
        lines.append(f"undetermined: {undetermined} of {pixels} pixels have no normal")
    if result.confidence is not None:
        weak = np.count_nonzero(result.determined() & (result.confidence.diffuse < 3))
        if weak:
            lines.append(
                f"marked: {weak} normals rest on fewer than three diffuse observations; there "
                "`diffuse` in result.npz is below 3"
            )
    doubts = (*result.warnings, *resolved.doubts)
    return "\n".join([*lines, *(f"warning: {text}" for text in doubts)])


def stack_summary(stack: ImageStack) -> str:
    """What was read: size, mask, lights, remarks, and the brightness of each image."""
    K, H, W = stack.shape
    rows = [
        f"{k:5d}  {image[stack.mask].mean():.4f}  {image[stack.mask].max():.4f}  {name}"
        for k, (name, image) in enumerate(zip(stack.names, stack.images, strict=True))
    ]
    return "\n".join(
        [
            f"{stack.title}: {K} images of {H} rows x {W} columns",
            *remarks(stack),
            "image  mean    max     name (fractions of full scale, inside the mask)",
            *rows,
        ]
    )


MEASURES = {
    "macro": """\
macro: mean over the true classes of the percentage that was labelled rightly; 100 is perfect""",
    "p99": """\
rms: root mean square of linearized minus ideal image, fraction of full scale
p99: 99 of 100 pixels differ from the ideal image by less than this, fraction of full scale""",
    "light error": """\
light error: mean angle between true and estimated lights, up to one linear map for all, degrees""",
    r"normals( \(|  )": """\
normals: angle between true and found normals, degrees; pixels without one are counted apart""",
    r"depth( \(|  )": """\
depth: errors in mm, less the mean error of each part (for the median, less its median error); parts
    are bounded by outlines and by jumps of the true depth""",
    "lights as found": """\
lights as found: mean angle between true lights and those of the shape, without any map, degrees""",
}
"""What the numbers of an evaluation mean, by what names them in it."""


def explain_measures(text: str) -> str:
    """The lines of MEASURES for what an evaluation holds."""
    return "\n".join(line for name, line in MEASURES.items() if re.search(name, text))


def remarks(of: ImageStack | Analysis) -> list[str]:
    """Notes and warnings, one a line."""
    return [*of.notes, *(f"warning: {text}" for text in of.warnings)]
