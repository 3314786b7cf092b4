"""The scenes: what stands where, what it is made of and how it is lit."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .shapes import Block, Floats, Ring, Shape, Vector, cone, lathe, pole, sphere

Texture = Callable[[Floats], Floats]
"""Albedo (P,) at points (P,3)."""


@dataclass(frozen=True)
class Surface:
    """A shape and what it is made of."""

    shape: Shape
    albedo: float | Texture
    gloss: float = 0.0
    """Strength of the highlight at its centre, fraction of full scale for a light of power 1."""
    shininess: float = 1.0
    """Exponent of the highlight."""


@dataclass(frozen=True)
class Setup:
    """A scene before a size and a number of images are chosen."""

    surfaces: tuple[Surface, ...]
    size: tuple[int, int]
    """Rows and columns when none are asked for."""
    images: int
    """Number of images when none is asked for."""
    view: tuple[float, float]
    """Height and width that the picture must hold, mm."""
    centre: Vector = (0, 0, 0)
    """Point of space at the picture's centre."""
    tilt: float = 0.0
    """Angle by which the camera looks down, degrees."""
    elevations: tuple[float, float] = (38, 75)
    """Lowest and highest light, degrees above the image plane."""
    clearance: float = -1.0
    """Least sine of a light's elevation above the ground (y = 0)."""
    power: tuple[float, float] = (0.9, 0.9)
    """Least and greatest power of a light."""


def camera(tilt: float) -> Floats:
    """(3,3) rotation from space to the camera's x right, y up, z to the camera."""
    c, s = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def place_lights(setup: Setup, count: int) -> tuple[Floats, Floats]:
    """`count` lights of a fixed sequence that fills the allowed part of the sky evenly.

    Returns:
        (count,3) unit directions towards the lights, camera frame, and (count,) powers.
    """
    # multiples of these three irrationals are the R3 low-discrepancy sequence (Roberts 2018)
    steps = 1.2207440846057596 ** -np.arange(1, 4)
    u, v, w = (0.5 + np.arange(1, 8 * count + 1)[:, None] * steps).T % 1
    low, high = np.sin(np.radians(setup.elevations))
    z = low + u * (high - low)
    r = np.sqrt(1 - z**2)
    directions = np.stack((r * np.cos(2 * np.pi * v), r * np.sin(2 * np.pi * v), z), axis=1)
    up = camera(setup.tilt) @ (0, 1, 0)
    allowed = np.flatnonzero(directions @ up >= setup.clearance)[:count]
    weak, strong = setup.power
    return directions[allowed], weak + w[allowed] * (strong - weak)


def veins(dark: float, light: float, size: float) -> Texture:
    """Marble: albedo between `dark` and `light`, features of about `size` mm."""

    def texture(points: Floats) -> Floats:
        waves = np.random.default_rng(1).normal(size=(6, 3)) / size
        p = points + 0.6 * size * np.sin(points[:, [1, 2, 0]] * 1.7 / size)
        v = sum(np.abs(np.sin(p @ wave * 1.5**k)) / 1.4**k for k, wave in enumerate(waves))
        v = np.clip(np.asarray(v) / 2.2, 0, 1)
        return dark + (light - dark) * v

    return texture


def glaze(points: Floats) -> Floats:
    """Painted bands and a wave around a pot's belly, over a faint cloud."""
    x, y, z = points.T
    angle = np.arctan2(x, z)
    ground = veins(0.62, 0.82, 14)(points)
    wave = np.abs(y - 46 - 5 * np.sin(6 * angle)) < 2.2
    rings = (np.abs(y - 33) < 1.3) | (np.abs(y - 59) < 1.3) | (np.abs(y - 84) < 1.6) | (y < 7)
    return np.where(wave | rings, 0.3, ground)


def _sphere_cone() -> Setup:
    return Setup(
        surfaces=(
            Surface(sphere((-30, 31, 12), 31), 0.85, 0.55, 13),
            Surface(cone((36, 0, -8), 34, 78), 0.7, 0.55, 13),
            Surface(Ring((0, 0, 0)), 0.6),
        ),
        size=(120, 160),
        images=20,
        view=(120, 160),
        centre=(2, 30, 0),
        tilt=50,
        clearance=0.25,
    )


def _cup() -> Setup:
    clay = 0.75
    return Setup(
        surfaces=(
            *(
                Surface(s, clay, 0.35, 25)
                for s in lathe((0, 0, 0), (22, 30, 36, 39, 41, 42, 43), 70)
            ),
            *(
                Surface(s, clay, 0.35, 25)
                for s in lathe((0, 6, 0), (-8, 8, 27, 34, 37, 38.5, 39.5), 64)
            ),
        ),
        size=(128, 128),
        images=24,
        view=(112, 112),
        centre=(0, 36, 0),
        tilt=45,
    )


def _pot() -> Setup:
    return Setup(
        surfaces=tuple(
            Surface(s, glaze, 0.5, 40)
            for s in lathe((0, 0, 0), (17, 17, 30, 40, 42, 37, 25, 14, 12, 17, 19), 96)
        ),
        size=(128, 128),
        images=24,
        view=(112, 112),
        centre=(0, 48, 0),
        tilt=15,
        power=(0.75, 1.05),
    )


def _sphere_obstacles() -> Setup:
    wood = 0.4
    return Setup(
        surfaces=(
            Surface(sphere((0, 0, 0), 50), veins(0.5, 0.95, 16), 0.45, 25),
            Surface(pole((-59, -80, 46), 6, 160), wood),
            Surface(pole((60, -80, 52), 5, 160), wood),
            Surface(Block((-66, 14, 20), (5, 22, 46)), wood),
            Surface(Block((66, -12, 22), (5, 26, 46)), wood),
            Surface(pole((-74, -49, 62), 4, 32, (1, 0, 0)), wood),
            Surface(pole((44, 48, 60), 4, 30, (1, 0, 0)), wood),
        ),
        size=(120, 160),
        images=24,
        view=(117, 156),
        elevations=(30, 75),
        power=(0.75, 1.05),
    )


SCENES = {
    "sphere_cone": _sphere_cone(),
    "cup": _cup(),
    "pot": _pot(),
    "sphere_obstacles": _sphere_obstacles(),
}
"""Every scene that can be rendered, by name."""
