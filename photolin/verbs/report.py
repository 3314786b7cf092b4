"""The verb that writes a result as a web page."""

from pathlib import Path

from tyro.conf import Positional

from ..command import run_command
from ..errors import InputError, OutputError
from ..export import (
    load_result,
    load_result_source,
    load_result_stack,
    load_shape,
    write_files,
)
from ..export.html import report_html


def report(
    result: Positional[Path],
    out: Positional[Path],
    *,
    stack: Path | None = None,
) -> None:
    """Write a result as one web page to send: pictures, shares, thresholds, and its command.

    Without the images it is written too, with the labels alone.

    Args:
        result: Folder that run wrote.
        out: File for the page, its name ending in .html; replaced where it is there.
        stack: Where the images of the result are now, if they have moved.
    """
    if out.suffix.lower() not in (".html", ".htm"):
        raise OutputError(
            f"{out}: is no name of a page; a file name that ends in .html is accepted"
        )
    analysis, shape = load_result(result), load_shape(result)
    was, reading = load_result_source(result)
    try:
        images = load_result_stack(result, stack)
    except InputError as error:
        if stack is not None:
            raise
        print(f"warning: {error}")
        images = None
    place, command = stack or was, None
    if place is not None:
        folder = result if result.is_dir() else result.parent
        command = run_command(place, folder, analysis.options, reading, analysis.thresholds)
    page = report_html(analysis, stack=images, shape=shape, command=command)
    write_files(out.parent, {out.name: page})
    print(f"written {out} ({len(page) / 1e6:.1f} MB)")
