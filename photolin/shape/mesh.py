"""From depth to a triangle mesh."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import DegenerateError, InputError, OptionError

STEEPEST = 10.0
"""Rise over run beyond which neighbours are not joined: a jump of depth, not a surface. 84 degrees
from facing the camera, where a pixel shows the surface to a tenth at best."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles between pixels; x right, y up, z to the camera. Read-only."""

    vertices: NDArray[np.float32]
    """(N,3) in the unit of `px`, pixels or mm; x = y = 0 is the middle of the picture."""
    faces: NDArray[np.int32]
    """(M,3) vertex numbers, counter-clockwise seen from the camera."""
    uv: NDArray[np.float32]
    """(N,2) texture coordinates, 0 to 1: u right, v up, (0, 0) the lower left corner."""
    pixels: NDArray[np.int64]
    """(N,) flat index (row * W + column) of each vertex's pixel, ascending."""

    def __post_init__(self) -> None:
        for array in vars(self).values():
            array.setflags(write=False)


def build_mesh(
    depth: NDArray[np.floating],
    mask: NDArray[np.bool_],
    px: float = 1.0,
    *,
    step: int = 1,
    most_vertices: int | None = None,
    steepest: float = STEEPEST,
) -> Mesh:
    """Join each pixel to its neighbours, two triangles to a square of four pixels.

    Squares are cut along the diagonal with less difference of depth; three pixels make one
    triangle. Two pixels are joined only where the depth between them rises by at most `steepest`
    times their distance in the image; hence no triangle bridges a jump of depth. Pixels of no
    triangle are left out.

    Args:
        depth: (H,W) z to the camera in pixels, as `integrate_normals` gives it; NaN is left out.
        mask: (H,W) bool, the pixels to join.
        px: side of a pixel, such as mm per pixel; it scales all vertices, depth included.
        step: 1 takes every pixel, 2 every other in rows and columns, and so on.
        most_vertices: takes the least step, from `step`, that gives no more vertices.
        steepest: rise over run.

    Raises:
        InputError: shapes or types other than these.
        OptionError: px, step, most_vertices or steepest is out of range.
        DegenerateError: no triangle: no three neighbours have depth.
    """
    if mask.dtype != np.bool_ or mask.ndim != 2 or depth.shape != mask.shape:
        raise InputError(
            f"depth and mask ({mask.dtype}) are of shapes {depth.shape} and {mask.shape}; "
            "one shape (rows, columns) and a bool mask are accepted"
        )
    _check_options(px, step, most_vertices, steepest)
    known = np.where(mask & np.isfinite(depth), depth, np.nan).astype(np.float64)
    if most_vertices is not None:
        step = max(step, int(np.sqrt(np.isfinite(known).sum() / most_vertices)))
    while True:
        faces = _triangles(known, step, steepest)
        if len(faces) == 0:
            raise DegenerateError(
                f"no three neighbouring pixels have depth without a jump, at a step of {step}; "
                "a surface of some pixels, smaller steps and more vertices are accepted"
            )
        used = np.zeros(known.size, np.bool_)
        used[faces] = True
        pixels = np.flatnonzero(used)
        if most_vertices is None or len(pixels) <= most_vertices:
            break
        step += 1
    H, W = mask.shape
    numbers = np.empty(known.size, np.int32)
    numbers[pixels] = np.arange(len(pixels), dtype=np.int32)
    row, column = np.divmod(pixels, W)
    x, y = column + 0.5 - W / 2, H / 2 - row - 0.5
    return Mesh(
        vertices=(px * np.stack([x, y, known[row, column]], axis=1)).astype(np.float32),
        faces=numbers[faces],
        uv=np.stack([(column + 0.5) / W, 1 - (row + 0.5) / H], axis=1).astype(np.float32),
        pixels=pixels.astype(np.int64),
    )


def _check_options(px: float, step: int, most_vertices: int | None, steepest: float) -> None:
    if not 0 < px < np.inf:
        raise OptionError(f"px is {px}; accepted is a length above 0")
    if step < 1:
        raise OptionError(f"step is {step}; accepted is a whole number from 1")
    if most_vertices is not None and most_vertices < 3:
        raise OptionError(f"most_vertices is {most_vertices}; accepted is a whole number from 3")
    if not steepest > 0:
        raise OptionError(f"steepest is {steepest}; accepted is a rise over run above 0")


def _triangles(depth: NDArray[np.float64], step: int, steepest: float) -> NDArray[np.int32]:
    """(M,3) flat indices of pixels, counter-clockwise seen from the camera, in raster order."""
    z = depth[::step, ::step]
    # half the memory, and more than any picture has pixels
    index = np.arange(depth.size, dtype=np.int32).reshape(depth.shape)[::step, ::step]
    corners = np.s_[:-1, :-1], np.s_[:-1, 1:], np.s_[1:, :-1], np.s_[1:, 1:]
    a, b, c, d = (index[at] for at in corners)
    za, zb, zc, zd = (z[at] for at in corners)

    def rise(one: NDArray, other: NDArray) -> NDArray:
        return np.nan_to_num(np.abs(one - other), nan=np.inf)

    most = steepest * step
    top, bottom = rise(za, zb) <= most, rise(zc, zd) <= most
    left, right = rise(za, zc) <= most, rise(zb, zd) <= most
    falling, rising = rise(za, zd), rise(zb, zc)
    cut = rising <= falling
    whole = np.where(cut, rising, falling) <= most * np.sqrt(2)
    kept = (
        (cut & whole & left & top, (a, c, b)),
        (cut & whole & bottom & right, (b, c, d)),
        (~cut & whole & left & bottom, (a, c, d)),
        (~cut & whole & right & top, (a, d, b)),
    )
    faces = np.concatenate([np.stack([v[good] for v in three], axis=1) for good, three in kept])
    return faces[np.argsort(faces.min(axis=1), kind="stable")]
