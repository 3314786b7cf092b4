"""Files of light directions and powers."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..stack import check_lights


def read_lights(path: Path, names: tuple[str, ...]) -> NDArray[np.float64]:
    """Lights of the images called `names`: (K,3), x right, y up, z to the camera.

    Text files hold a line ``x y z`` for each image, after an optional line with their count; in
    ``.lp`` files (RTI) a file name comes before the three numbers, which are scaled to length 1
    because they may be positions. Lines with names are matched by name, whatever the ending;
    they are taken in order where no image is named, or only some are, in that order. ``.npy``
    holds (K,3) or (3,K).

    Raises:
        InputError: unreadable, a line that cannot be understood, another count than images, or
            names of some images in another order.
        DegenerateError: fewer than three independent directions.
    """
    if path.suffix.lower() == ".npy":
        lights = _read_npy(path)
        if lights.shape == (3, len(names)) and len(names) != 3:
            lights = lights.T
    else:
        labels, lights = read_table(path)
        lights = _in_order_of(names, labels, lights, path)
    check_lights(lights, len(names), str(path))
    if path.suffix.lower() == ".lp":
        lights = lights / np.linalg.norm(lights, axis=1, keepdims=True)
    return lights


def read_table(path: Path) -> tuple[list[str], NDArray[np.float64]]:
    """`parse_table` of a file.

    Raises:
        InputError: names the file and the line.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not text; lines of three numbers are accepted") from error
    return parse_table(text, str(path))


def parse_table(text: str, where: str) -> tuple[list[str], NDArray[np.float64]]:
    """Lines of ``[name] a b c``, after an optional line with their count.

    Args:
        where: what the text is called in errors.

    Returns:
        The names ("" where a line has none), N of them, and (N,3) finite numbers.

    Raises:
        InputError: names the line.
    """
    lines = [(n, line.split()) for n, line in enumerate(text.splitlines(), 1)]
    lines = [(n, words) for n, words in lines if words and not words[0].startswith("#")]
    count = None
    if lines and len(lines[0][1]) == 1 and lines[0][1][0].isdecimal():
        count = int(lines.pop(0)[1][0])
    if not lines:
        raise InputError(
            f"{where}: holds no lines of three numbers; one for each image is accepted"
        )
    if count is not None and count != len(lines):
        raise InputError(
            f"{where}: announces {count} lights and lists {len(lines)}; equal numbers are accepted"
        )
    rows = [_three_numbers(words, f"{where}, line {n}") for n, words in lines]
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


def _in_order_of(
    names: tuple[str, ...], labels: list[str], lights: NDArray[np.float64], path: Path
) -> NDArray[np.float64]:
    """The lights of `names`, by name where lines have those, else as they come.

    Raises:
        InputError: some images are named, in another order, and others are not; one is named
            twice; or lines hold more than three numbers.
    """
    # lists made on another machine hold its full paths, with either kind of slash
    listed = [label.replace("\\", "/").rsplit("/", 1)[-1].lower() for label in labels]
    wanted = [name.lower() for name in names]
    found = _numbers_of(wanted, listed, path)
    stems = [_stem(name) for name in wanted]
    # pictures may have been converted since: the lines of img_1.jpg are those of img_1.png
    if not found:
        found = _numbers_of(stems, [_stem(name) for name in listed], path)
        wanted = stems
    if not found:
        _check_columns(labels, names, path)
        return lights
    missing = [k for k, name in enumerate(wanted) if name not in found]
    if not missing:
        return lights[[found[name] for name in wanted]]
    in_place = all(found.get(name, k) == k for k, name in enumerate(wanted))
    # a file cannot hold every name as it is: those that it has tell whether it is in order
    if in_place and len(lights) == len(names):
        return lights
    raise InputError(
        f"{path}: names {len(found)} of {len(names)} images, in another order, and not "
        f"{names[missing[0]]}; names of all images, or lines in their order, are accepted"
    )


def _numbers_of(wanted: list[str], listed: list[str], path: Path) -> dict[str, int]:
    """Line number, from 0, of each of the names that is listed; none where names are not unique."""
    known, found = set(wanted), dict[str, int]()
    if len(known) < len(wanted):
        return found
    known.discard("")
    for n, name in enumerate(listed):
        if name in known and found.setdefault(name, n) != n:
            raise InputError(f"{path}: names {name} twice; one line for each image is accepted")
    return found


def _stem(name: str) -> str:
    """Without its ending, which letters begin: that of 1.5 is no ending."""
    return re.sub(r"\.[a-z][a-z0-9]*$", "", name)


def _check_columns(labels: list[str], names: tuple[str, ...], path: Path) -> None:
    """Raise InputError where numbers that are no name come before the three of a line."""
    for n, label in enumerate(labels, 1):
        words = label.split()
        if label in names:
            continue
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            continue
        if len(numbers) > 1 or any(number % 1 for number in numbers):
            raise InputError(
                f"{path}, light {n}: has {len(words) + 3} numbers; x y z, of the length of the "
                "light's power, maybe after the image's name or number, is accepted"
            )


def _read_npy(path: Path) -> NDArray[np.float64]:
    try:
        # mapped, so that a header that lies about its size is refused before memory is taken
        lights = np.lib.format.open_memmap(path, mode="r")
    except (OSError, ValueError, EOFError) as error:
        raise InputError(
            f"{path}: is not a plain array file ({error}); .npy of shape (images, 3) is accepted"
        ) from error
    if lights.dtype.kind not in "buif":
        raise InputError(f"{path}: holds no numbers; .npy of shape (images, 3) is accepted")
    return np.atleast_2d(np.array(lights, np.float64))
