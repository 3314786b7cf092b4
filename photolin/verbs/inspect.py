"""The verb that opens the inspector."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tyro.conf import Positional

from ..analysis import Options
from ..console import progress_bar
from ..errors import InputError
from ..export import (
    is_result,
    load_result,
    load_result_source,
    load_result_stack,
    load_shape,
)
from ..load import LoadOptions
from ..stack import ImageStack
from ..synthetic import load_truth
from . import read_stack


def inspect(
    path: Positional[Path],
    analysis: Options = Options(),
    reading: LoadOptions = LoadOptions(),
    *,
    stack: Path | None = None,
    host: str = "127.0.0.1",
    port: int = 8080,
    no_browser: bool = False,
) -> None:
    """Look at a stack or a result in the browser.

    A result brings its own analysis and reading options, and the shape that was recovered from it;
    those given apply to a stack. What is set
    there is kept in photolin_session.json, beside the result or the images, for the next time.

    Args:
        path: What run accepts as stack, or a folder that run wrote.
        stack: Where the images of a result are now, if they have moved.
        host: Address to listen on; any but a loopback address asks visitors for a token.
        port: Port to listen on, 1 to 65535.
        no_browser: Print the address and do not open a browser.
    """
    result = load_result(path) if is_result(path) else None
    images, place, found = None, path, None
    if result is not None:
        found = load_shape(path)
        if found is not None and found.depth is None:  # of a run, which nobody asked for a shape
            found = None
        images = load_result_stack(path, stack)
        was, reading = load_result_source(path)
        path = stack or was or path
    if images is None or reading.exclude:  # all are there to be taken in again
        with progress_bar() as progress:
            images, _ = read_stack(path, replace(reading, exclude=()), progress)
    from webapp.app import serve
    from webapp.keeper import saved_place
    from webapp.source import Source

    source = Source(
        images,
        result,
        result.options if result else analysis,
        path,
        saved_place(place),
        reading,
        find_truth(path, images, reading),
        found,
    )
    serve(source, host=host, port=port, open_browser=not no_browser)


def find_truth(path: Path, images: ImageStack, reading: LoadOptions) -> NDArray[np.uint8] | None:
    """(K,H,W) true labels that lie beside a stack, None where there are none of it.

    A gt.npz of something else is none of our business.
    """
    folder = next((f for f in (path, path.parent) if (f / "gt.npz").is_file()), None)
    if folder is None:
        return None
    try:
        labels = load_truth(folder).labels
    except InputError:
        return None
    if reading.roi is not None:
        row0, row1, column0, column1 = reading.roi
        labels = labels[:, row0:row1, column0:column1]
    return labels if labels.shape == images.shape else None
