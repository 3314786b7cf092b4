"""Verbs from linearized images to normals, depth and lights."""

import os
import shlex
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Literal

import numpy as np
from tyro.conf import Positional

from ..analysis import Analysis, Cancel, Options, Progress
from ..console import progress_bar, shape_summary, stop_at_ctrl_c
from ..errors import InputError, OptionError, OutputError
from ..export import (
    check_output,
    is_result,
    load_result,
    load_result_source,
    load_result_stack,
    result_files,
    write_files,
)
from ..export.lights import lights_diligent, lights_lp
from ..export.surface import surface_files
from ..load import LoadOptions
from ..pipeline import analyze
from ..shape.channels import measure_colour
from ..shape.known import Sphere, read_known
from ..shape.recover import Shape, check_scale, recover_shape
from ..shape.resolve import NOTHING, Known, resolve_ambiguity
from ..stack import ImageStack
from . import COMMAND, check_kept, read_stack


def shape(
    path: Positional[Path],
    out: Positional[Path],
    analysis: Options = Options(),
    reading: LoadOptions = LoadOptions(),
    *,
    points: Path | None = None,
    sphere: Sphere | None = None,
    some_lights: Path | None = None,
    px_mm: float | None = None,
    directx: bool = False,
    stack: Path | None = None,
    powers: Literal["given", "unknown"] = "given",
    threads: int | None = None,
) -> None:
    """Normals, albedo, depth, mesh and lights of a stack or a result, as files in OUT.

    Without known lights, normals are known up to a 3x3 matrix. It is resolved by points of known
    normal, a sphere in the scene, the lights of some images, or, with none of these, by what makes
    the normals those of a surface, up to the stated convention. A result brings its own analysis
    and reading options; those given apply to a stack.

    Lights are lines of x y z for each image, or name x y z: towards the light, x right, y up, z to
    the camera. Their length is the power of the light; all of length 1 says that all lights are
    equally strong. In .lp files lengths say nothing, and lights count as equally strong.

    Rows count downwards and columns to the right, from 0; whole numbers are centres of pixels: the
    middle of H rows is row (H - 1) / 2.

    Args:
        path: What run accepts as stack, or a folder that run wrote.
        out: Folder for the files; made when missing. It may be that of the result itself.
        points: Text file of lines: row column x y z, a pixel of the images as read (inside roi)
            and its unit normal, x right, y up, z to the camera. With sphere, lines of row column
            alone are points of that sphere.
        sphere: Row and column of the centre of a sphere in the scene and its radius, pixels; a
            pixel's own centre is at whole numbers.
        some_lights: Lights of some of the images, or of all, lines of: name x y z. The lengths are
            powers, unless all are 1 or the file is .lp: powers are then unknown and found.
        px_mm: Side of a pixel, mm: depth and mesh are then in mm, else in pixels.
        directx: Green of the normal map is y down (DirectX) instead of y up (OpenGL).
        stack: Where the images of a result are now, if they have moved.
        powers: unknown takes the directions of the lights of the stack alone and finds their
            powers from the images.
        threads: Processors to use; all when left out. The result does not depend on it.
    """
    check_output(out)
    check_scale(px_mm)
    given = is_result(path)
    was, reading = load_result_source(path) if given else (path, reading)
    source = stack or was or path if given else path
    if os.path.realpath(out) in map(os.path.realpath, (source, source / "images")):
        raise OutputError(f"{out}: holds the images; another folder is accepted")
    with progress_bar() as progress, stop_at_ctrl_c() as cancel:
        if given:
            result, images, seconds = load_result(path), load_result_stack(path, stack), 0.0
        else:
            result, (images, seconds) = None, read_stack(path, reading, progress)
        known = read_known(images.names, points, sphere, some_lights)
        if powers == "unknown":
            images, known = free_powers(images, known, path, analyzed=given)
            reading = replace(reading, lights="none")
        if result is None:
            result = analyze(images, analysis, threads=threads, progress=progress, cancel=cancel)
            result = replace(result, seconds={"load": seconds, **result.seconds})
        result, found = measure_shape(
            images, result, known, px_mm=px_mm, threads=threads, progress=progress, cancel=cancel
        )
        colour = measure_colour(source, reading, result, found, progress)
    files = surface_files(found, result, colour, convention="directx" if directx else "opengl")
    about = {"command": COMMAND.get(), "stack_path": source, "load_options": reading}
    files = result_files(result, shape=found, **about) | files
    check_kept(out, files, images.files)
    # all at once: an interruption leaves either all or what was there before
    write_files(out, files)
    print(shape_summary(result, found.resolved))
    print(f"written {', '.join(files)} to {out}")


def free_powers(
    images: ImageStack, known: Known, path: Path, *, analyzed: bool
) -> tuple[ImageStack, Known]:
    """The stack without its lights, and their directions as what is known.

    Raises:
        InputError: it has no lights.
        OptionError: it was analyzed with their powers, or something else is known as well.
    """
    if analyzed:
        raise OptionError(
            f"{path}: is a result, linearized with what was known of its lights; powers unknown is "
            "accepted with the stack itself"
        )
    if known != NOTHING:
        raise OptionError(
            "powers unknown takes the directions of all lights; points, sphere and some_lights are "
            "accepted without it"
        )
    if images.lights is None:
        raise InputError(
            f"{path}: has no lights; with powers unknown, a stack with light directions is accepted"
        )
    note = "powers: found from the images, the lengths of the lights are not used"
    directions = tuple((x, y, z) for x, y, z in images.lights.tolist())
    every = Known(images=tuple(range(len(directions))), lights=directions, powers=False)
    return replace(images, lights=None, notes=(*images.notes, note)), every


def measure_shape(
    stack: ImageStack,
    analysis: Analysis,
    known: Known = NOTHING,
    *,
    depth: bool = True,
    px_mm: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> tuple[Analysis, Shape]:
    """The analysis with the seconds of its shape among its own, and the shape."""
    start = perf_counter()
    found = recover_shape(
        stack,
        analysis,
        resolve_ambiguity(analysis, known),
        depth=depth,
        px_mm=px_mm,
        threads=threads,
        progress=progress,
        cancel=cancel,
    )
    seconds = perf_counter() - start
    # a shape that was there before is replaced, its seconds too
    stages = {k: s for k, s in analysis.seconds.items() if k not in ("shape", "total")}
    total = analysis.seconds["total"] - analysis.seconds.get("shape", 0) + seconds
    took = {**stages, "shape": seconds, "total": total}
    return replace(analysis, seconds=took), found


def lights(
    balls: Positional[Path],
    out: Positional[Path],
    reading: LoadOptions = LoadOptions(),
) -> None:
    """Light directions from images of a mirror ball: OUT/lights.lp and light_directions.txt.

    A ball does not show how strong a light is. photolin shape STACK OUT2 --some-lights
    OUT/lights.lp takes directions alone, and the images of STACK tell the powers; as --lights they
    would count as equally strong.

    Args:
        balls: Images of the ball, one for each light, with a mask of its disc.
        out: Folder for the files; made when missing.
    """
    # what it needs of scipy takes an eighth of a second to import
    from ..shape.chrome_ball import estimate_lights

    check_output(out)
    with progress_bar() as progress:
        images, _ = read_stack(balls, reading, progress)
    if images.mask.all():
        raise InputError(f"{balls}: has no mask; mark the ball's disc with the option mask")
    found = estimate_lights(images.images, images.mask)
    for name, doubt in zip(images.names, found.doubts, strict=True):
        if doubt:
            print(f"warning: {name}: {doubt}")
    if len(found.found) < len(images.names):
        missing = np.setdiff1d(np.arange(len(images.names)), found.found)
        raise InputError(
            f"{balls}: image {images.names[missing[0]]} shows no spot on the ball; "
            "take it out, or mark the ball better"
        )
    # no powers: a ball does not show them, and a stack in OUT may have its own
    name = "light_directions.txt"
    files = {"lights.lp": lights_lp(found.directions, images.names)}
    files[name] = lights_diligent(found.directions)[name]
    check_kept(out, files, images.files)
    write_files(out, files)
    row, column = found.centre
    print(f"ball: centre row {row:.1f}, column {column:.1f}, radius {found.radius:.1f} pixels")
    print(f"written {', '.join(files)} to {out}: directions, no powers")
    print(f"next: photolin shape STACK OUT --some-lights {shlex.quote(str(out / 'lights.lp'))}")
