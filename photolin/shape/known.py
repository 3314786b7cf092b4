"""What a user knows of a scene: a sphere, points of known normal, lights of some images."""

import re
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

import numpy as np

from ..errors import InputError, OptionError
from ..load.lights import parse_table

FAR = 1e6
"""Rows and columns beyond which nothing is a pixel."""
UNIT = 1e-3
"""Difference of all lengths from 1 up to which lights are directions without powers."""

POINTS = "lines of row column x y z, or of row column with the option sphere, are accepted"
LIGHTS = "lines of three numbers are accepted"
"""What files hold."""
BOTH = (
    "lights and points or a sphere are known; one of them is accepted, to resolve the ambiguity "
    "of unknown lights"
)

Sphere = tuple[float, float, float]
"""Row and column of the centre and radius of an outline, pixels; whole at pixel centres."""
Point = tuple[int, int]
"""(row, column)"""
Vector = tuple[float, float, float]
"""x right, y up, z to the camera."""


@dataclass(frozen=True)
class Known:
    """What someone knows of a scene besides its images; one kind of it is used."""

    sphere: Sphere | None = None
    """A sphere in the scene: all its pixels are used, or only `points` where some are given."""
    points: tuple[Point, ...] = ()
    """Pixels of known normal: those of `normals`, or of the sphere."""
    normals: tuple[Vector, ...] = ()
    """Unit normals of the points."""
    images: tuple[int, ...] = ()
    """Numbers of the images whose lights are known, from 0."""
    lights: tuple[Vector, ...] = ()
    """Their lights, towards the light."""
    powers: bool = False
    """Whether the lengths of `lights` are their powers, to a common unit."""

    def __post_init__(self) -> None:
        if self.lights and (self.points or self.sphere):
            raise OptionError(BOTH)
        if self.normals and len(self.normals) != len(self.points):
            raise OptionError(
                f"{len(self.points)} points and {len(self.normals)} normals; "
                "one normal for each point is accepted"
            )
        if self.normals and self.sphere:
            raise OptionError("points have normals and a sphere; one of them is accepted")
        if len(self.images) != len(self.lights):
            raise OptionError(
                f"{len(self.images)} images and {len(self.lights)} lights of them; "
                "equal numbers are accepted"
            )
        if self.points and not (self.normals or self.sphere):
            raise OptionError("points without normals; accepted with the sphere they lie on")


def read_known(
    names: tuple[str, ...],
    points: Path | None = None,
    sphere: Sphere | None = None,
    lights: Path | None = None,
) -> Known:
    """What files say is known of a scene.

    Args:
        names: of the images, to find those of `lights`.
        points: lines ``row column x y z``, a pixel and its unit normal; or ``row column`` alone,
            pixels of the sphere. Blanks, tabs, commas or semicolons between; a first line of words
            is a header, what follows # a remark.
        sphere: row and column of the centre and radius of its outline, pixels.
        lights: lines ``name x y z``, as in .lp files, for some of the images. Lengths are powers
            unless all are 1, or the file is .lp.

    Raises:
        InputError: names the file and what cannot be used in it.
        OptionError: what does not go together, see `Known`.
    """
    if lights is not None:
        if points is not None:
            raise OptionError(BOTH)
        text = _read_text(lights, LIGHTS)
        found = lights_in_text(text, names, str(lights), positions=lights.suffix.lower() == ".lp")
        return replace(found, sphere=sphere)
    if points is None:
        return Known(sphere)
    return points_in_text(_read_text(points, POINTS), str(points), sphere)


def points_in_text(text: str, where: str, sphere: Sphere | None = None) -> Known:
    """What lines of points say, as in the file `points` of `read_known`.

    Args:
        where: what the text is called in errors.
        sphere: that points without normals lie on.

    Raises:
        InputError: names the line that cannot be used.
        OptionError: what does not go together, see `Known`.
    """
    lines = [
        (n, re.split(r"[\s,;]+", line.split("#")[0].strip(" \t,;")))
        for n, line in enumerate(text.splitlines(), 1)
    ]
    lines = [(n, words) for n, words in lines if any(words)]
    if lines and not any(map(_is_number, lines[0][1])):
        del lines[0]
    if not lines:
        raise InputError(f"{where}: holds no points; {POINTS}")
    for n, words in lines:
        if len(words) not in (2, 5) or not all(map(_is_number, words)):
            raise InputError(f"{where}, line {n}: {' '.join(words)[:60]!r} is no point; {POINTS}")
        if len(words) != len(lines[0][1]):
            raise InputError(f"{where}, line {n}: some points have normals, others none; {POINTS}")
        if any(float(word) % 1 or abs(float(word)) > FAR for word in words[:2]):
            raise InputError(f"{where}, line {n}: row and column are not whole; {POINTS}")
    table = [[float(word) for word in words] for _, words in lines]
    return Known(
        sphere,
        tuple((int(row), int(column)) for row, column, *_ in table),
        tuple((x, y, z) for _, _, x, y, z in table) if len(table[0]) == 5 else (),
    )


def lights_in_text(
    text: str, names: tuple[str, ...], where: str, *, positions: bool = False
) -> Known:
    """What lines of lights say, as in the file `lights` of `read_known`.

    Args:
        names: of the images, to find those of the lights.
        where: what the text is called in errors.
        positions: whether lengths say nothing, as in .lp files.

    Raises:
        InputError: names the line that cannot be used.
    """
    labels, vectors = parse_table(text, where)
    numbers = {name.lower(): k for k, name in enumerate(names)}
    images = []
    for label in labels:
        name = label.replace("\\", "/").rsplit("/", 1)[-1].lower()
        if name not in numbers:
            raise InputError(
                f"{where}: {label or 'a line without a name'!r} is no image of the stack; names "
                f"such as {names[0]} before x y z are accepted"
            )
        images.append(numbers[name])
    lengths = np.linalg.norm(vectors, axis=1)
    return Known(
        images=tuple(images),
        lights=tuple((x, y, z) for x, y, z in vectors.tolist()),
        powers=not positions and bool((np.abs(lengths - 1) > UNIT).any()),
    )


def _is_number(word: str) -> bool:
    try:
        return isfinite(float(word))
    except ValueError:
        return False


def _read_text(path: Path, accepted: str) -> str:
    try:
        return path.read_text("utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not text; {accepted}") from error
