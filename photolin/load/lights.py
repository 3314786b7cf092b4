"""Files of light directions and powers."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..stack import check_lights


def read_lights(path: Path, names: tuple[str, ...]) -> NDArray[np.float64]:
    """Lights of the images called `names`: (K,3), x right, y up, z to the camera.

    Text files hold a line ``x y z`` for each image, after an optional line with their count; in
    ``.lp`` files (RTI) a file name comes before the three numbers, which are scaled to length 1
    because they may be positions. Lines with names are matched by name where all names are found,
    else taken in order. ``.npy`` holds (K,3) or (3,K).

    Raises:
        InputError: unreadable, a line that cannot be understood, another count than images.
        DegenerateError: fewer than three independent directions.
    """
    if path.suffix.lower() == ".npy":
        lights = _read_npy(path)
        if lights.shape == (3, len(names)) and len(names) != 3:
            lights = lights.T
    else:
        labels, lights = read_table(path)
        lights = _in_order_of(names, labels, lights)
    check_lights(lights, len(names), str(path))
    if path.suffix.lower() == ".lp":
        lights = lights / np.linalg.norm(lights, axis=1, keepdims=True)
    return lights


def read_table(path: Path) -> tuple[list[str], NDArray[np.float64]]:
    """Lines of ``[name] a b c``, after an optional line with their count.

    Returns:
        The names ("" where a line has none), N of them, and (N,3) finite numbers.

    Raises:
        InputError: names the file and the line.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not text; lines of three numbers are accepted") from error
    lines = [(n, line.split()) for n, line in enumerate(text.splitlines(), 1)]
    lines = [(n, words) for n, words in lines if words and not words[0].startswith("#")]
    count = None
    if lines and len(lines[0][1]) == 1 and lines[0][1][0].isdecimal():
        count = int(lines.pop(0)[1][0])
    if not lines:
        raise InputError(f"{path}: holds no lines of three numbers; one for each image is accepted")
    if count is not None and count != len(lines):
        raise InputError(
            f"{path}: announces {count} lights and lists {len(lines)}; equal numbers are accepted"
        )
    rows = [_three_numbers(words, f"{path}, line {n}") for n, words in lines]
    return [" ".join(words[:-3]) for _, words in lines], np.array(rows)


def _three_numbers(words: list[str], where: str) -> list[float]:
    try:
        numbers = [float(word) for word in words[-3:]]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not np.isfinite(numbers).all():
        raise InputError(
            f"{where}: {' '.join(words)[:60]!r} is not three numbers; "
            "x y z with decimal points and blanks between is accepted"
        )
    return numbers


def _in_order_of(names: tuple[str, ...], labels: list[str], lights: NDArray) -> NDArray:
    # Lists made on another machine hold its full paths, with either kind of slash.
    by_name = {
        label.replace("\\", "/").rsplit("/", 1)[-1].lower(): light
        for label, light in zip(labels, lights, strict=True)
    }
    wanted = [name.lower() for name in names]
    if all(name in by_name for name in wanted):
        return np.array([by_name[name] for name in wanted])
    return lights


def _read_npy(path: Path) -> NDArray[np.float64]:
    try:
        lights = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise InputError(
            f"{path}: is not a plain array file ({error}); .npy of shape (images, 3) is accepted"
        ) from error
    if not isinstance(lights, np.ndarray) or lights.dtype.kind not in "buif":
        raise InputError(f"{path}: holds no numbers; .npy of shape (images, 3) is accepted")
    return np.atleast_2d(lights.astype(np.float64))
