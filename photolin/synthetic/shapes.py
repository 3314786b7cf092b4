"""What a ray can meet: quadrics of revolution, rings and blocks.

All shapes share two methods. `hit` gives the distance along each ray to the first point of the
surface, infinity where it is missed; `normals` the unit normals at points of the surface.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Vector = tuple[float, float, float]
Floats = NDArray[np.float64]


class Shape(Protocol):
    """A surface in space, mm."""

    def hit(self, origins: Floats, direction: Floats) -> Floats:
        """(P,) distances > 0, mm, from origins (P,3) along one unit direction (3,)."""
        ...

    def normals(self, points: Floats) -> Floats:
        """(P,3) unit normals at surface points (P,3); which side they show is not defined."""
        ...


@dataclass(frozen=True)
class Quadric:
    """r² = a + b·h + c·h² for low <= h <= high: sphere, cone, cylinder and all between.

    h is the height above `base` along `axis`, r the distance from the axis. The ends are open.
    """

    base: Vector
    a: float
    b: float
    c: float
    low: float
    high: float
    axis: Vector = (0, 1, 0)
    """Unit vector."""

    def hit(self, origins: Floats, direction: Floats) -> Floats:
        axis = np.asarray(self.axis, float)
        o = origins - self.base
        h, slope = o @ axis, float(direction @ axis)
        q2 = 1 - slope**2 * (1 + self.c)
        q1 = 2 * (o @ direction) - slope * (self.b + 2 * h * (1 + self.c))
        q0 = (o * o).sum(-1) - self.a - self.b * h - (1 + self.c) * h**2
        root = np.sqrt(np.maximum(q1**2 - 4 * q2 * q0, 0))
        s = -(q1 + np.copysign(root, q1)) / 2  # never the difference of like numbers
        missed = q1**2 < 4 * q2 * q0
        nearest = np.full(len(o), np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            for t in (s / q2, q0 / s):
                height = h + t * slope
                good = ~missed & (t > 0) & (height >= self.low) & (height <= self.high)
                nearest = np.where(good & (t < nearest), t, nearest)
        return nearest

    def normals(self, points: Floats) -> Floats:
        axis = np.asarray(self.axis, float)
        o = points - self.base
        h = (o @ axis)[:, None]
        gradient = o - h * axis - (self.b / 2 + self.c * h) * axis
        return gradient / np.linalg.norm(gradient, axis=1, keepdims=True)


@dataclass(frozen=True)
class Ring:
    """The flat part inner <= r <= outer of the plane through `base`; a disc, or all of it."""

    base: Vector
    inner: float = 0.0
    outer: float = np.inf
    axis: Vector = (0, 1, 0)
    """Unit vector."""

    def hit(self, origins: Floats, direction: Floats) -> Floats:
        axis = np.asarray(self.axis, float)
        o = origins - self.base
        with np.errstate(divide="ignore", invalid="ignore"):
            t = -(o @ axis) / float(direction @ axis)
            r = np.linalg.norm(o + t[:, None] * direction, axis=1)
        return np.where((t > 0) & (r >= self.inner) & (r <= self.outer), t, np.inf)

    def normals(self, points: Floats) -> Floats:
        return np.broadcast_to(np.asarray(self.axis, float), points.shape)


@dataclass(frozen=True)
class Block:
    """A box with sides along the axes."""

    centre: Vector
    half: Vector
    """Half of each side, mm."""

    def hit(self, origins: Floats, direction: Floats) -> Floats:
        o, half = origins - self.centre, np.asarray(self.half, float)
        with np.errstate(divide="ignore", invalid="ignore"):
            sides = np.sort([(-half - o) / direction, (half - o) / direction], axis=0)
        enter, leave = sides[0].max(-1), sides[1].min(-1)
        t = np.where(enter > 0, enter, leave)
        return np.where((enter <= leave) & (t > 0), t, np.inf)

    def normals(self, points: Floats) -> Floats:
        o = (points - self.centre) / np.asarray(self.half, float)
        side = np.abs(o).argmax(-1)
        return np.eye(3)[side] * np.sign(np.take_along_axis(o, side[:, None], 1))


def sphere(centre: Vector, radius: float) -> Quadric:
    """The whole sphere, mm."""
    return Quadric(centre, radius**2, 0, -1, -radius, radius)


def cone(base: Vector, radius: float, height: float) -> Quadric:
    """An upright cone: `radius` at `base`, its tip `height` above, mm."""
    k = (radius / height) ** 2
    return Quadric(base, k * height**2, -2 * k * height, k, 0, height)


def pole(base: Vector, radius: float, length: float, axis: Vector = (0, 1, 0)) -> Quadric:
    """An open cylinder from `base` along `axis`, mm."""
    return Quadric(base, radius**2, 0, 0, 0, length, axis)


def lathe(base: Vector, radii: tuple[float, ...], height: float) -> tuple[Quadric, ...]:
    """A smooth surface of revolution from `base` up to `height`, mm.

    r² is the uniform quadratic B-spline in h with the control values `radii`·|`radii`|: one
    quadric for each span, and no crease between them. Two equal radii at an end make it end
    there upright, two opposite ones (-r, r) close it with a round bottom.
    """
    spans = len(radii) - 2
    step = height / spans
    p = np.multiply(radii, np.abs(radii))
    pieces = []
    for k in range(spans):
        a, b, c = (p[k] + p[k + 1]) / 2, (p[k + 1] - p[k]) / step, (p[k] - 2 * p[k + 1] + p[k + 2])
        start = (base[0], base[1] + k * step, base[2])
        pieces.append(Quadric(start, float(a), float(b), float(c / 2 / step**2), 0, step))
    return tuple(pieces)
