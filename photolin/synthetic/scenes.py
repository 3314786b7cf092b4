"""The scenes: what stands where, what it is made of and how it is lit."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .shapes import Block, Floats, Ring, Shape, Vector, cone, lathe, pole, sphere

Texture = Callable[[Floats], Floats]
"""Albedo (P,) at points (P,3)."""

GOLDEN_RATIO = (np.sqrt(5) - 1) / 2


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
    k = np.arange(8 * count)[:, None]
    # multiples of irrational numbers never cluster, however many are taken
    u, v, w = (0.5 + k * (GOLDEN_RATIO, np.sqrt(2), np.sqrt(3))).T % 1
    low, high = np.sin(np.radians(setup.elevations))
    z = low + v * (high - low)
    r = np.sqrt(1 - z**2)
    directions = np.stack((r * np.cos(2 * np.pi * u), r * np.sin(2 * np.pi * u), z), axis=1)
    up = camera(setup.tilt) @ (0, 1, 0)
    allowed = np.flatnonzero(directions @ up >= setup.clearance)[:count]
    weak, strong = setup.power
    return directions[allowed], weak + w[allowed] * (strong - weak)


def veins(dark: float, light: float, size: float) -> Texture:
    """Marble: albedo between `dark` and `light`, veins about `size` mm apart."""
    waves = np.random.default_rng(1).normal(size=(5, 3)) / size

    def texture(points: Floats) -> Floats:
        p = points + size * np.sin(points[:, [1, 2, 0]] / size)
        v = [np.abs(np.sin(p @ wave * 1.8**k)) for k, wave in enumerate(waves)]
        return dark + (light - dark) * np.sqrt(np.average(v, axis=0, weights=0.6 ** np.arange(5)))

    return texture


def painted(ground: Texture, rings: tuple[tuple[float, float], ...], wave: float) -> Texture:
    """Dark rings (height, half width), and a wavy one at the height `wave`, mm, on `ground`."""

    def texture(points: Floats) -> Floats:
        x, y, z = points.T
        crest = wave + 5 * np.sin(6 * np.arctan2(x, z))
        bands = [np.abs(y - height) < half for height, half in (*rings, (crest, 2.2))]
        return np.where(np.any(bands, axis=0), 0.3, ground(points))

    return texture


def _sphere_cone() -> Setup:
    """The scene of Fig. 5; shares of the factors as in Table 1 to about one percent of all."""
    return Setup(
        surfaces=(
            Surface(sphere((-33, 36, 10), 36), 0.85, 0.55, 13),
            Surface(cone((38, 0, -4), 34, 78), 0.7, 0.55, 13),
            Surface(Ring((0, 0, 0)), 0.6),
        ),
        size=(120, 160),
        images=20,
        view=(111, 148),
        centre=(1.5, 32, 0),
        tilt=50,
        elevations=(38, 70),
        clearance=0.12,
    )


def _cup() -> Setup:
    """A deep cup: its inside shadows itself, as in Fig. 7."""
    glaze = painted(veins(0.7, 0.85, 20), ((10, 1.2), (54, 1.2)), 32)
    clay = veins(0.65, 0.85, 20)
    outside = lathe((0, 0, 0), (24, 24, 33, 38, 41, 43, 43), 64)
    inside = lathe((0, 7, 0), (-20, 20, 32, 36, 38.5, 40, 40), 57)
    return Setup(
        surfaces=(
            *(Surface(piece, glaze, 0.4, 30) for piece in outside),
            *(Surface(piece, clay, 0.4, 30) for piece in inside),
            Surface(Ring((0, 64, 0), 40, 43), 0.8, 0.4, 30),
        ),
        size=(128, 128),
        images=24,
        view=(106, 106),
        centre=(0, 34, 0),
        tilt=50,
    )


def _pot() -> Setup:
    """A glossy, painted pot with a narrow neck."""
    rings = ((3.5, 3.5), (33, 1.3), (59, 1.3), (84, 1.6))
    glaze = painted(veins(0.5, 0.9, 14), rings, 46)
    body = lathe((0, 0, 0), (17, 17, 30, 40, 42, 37, 25, 14, 12, 17, 19), 96)
    return Setup(
        surfaces=(
            *(Surface(piece, glaze, 0.5, 40) for piece in body),
            Surface(Ring((0, 0, 0), 0, 17), 0.5),
        ),
        size=(128, 128),
        images=24,
        view=(110, 110),
        centre=(0, 47, 0),
        tilt=15,
        power=(0.75, 1.05),
    )


def _sphere_obstacles() -> Setup:
    """A sphere of 50 mm between poles and blocks, as in Fig. 12."""
    wood = 0.4
    return Setup(
        surfaces=(
            Surface(sphere((0, 0, 0), 50), veins(0.4, 0.95, 14), 0.45, 25),
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
        power=(0.75, 1.05),
    )


SCENES = {
    "sphere_cone": _sphere_cone(),
    "cup": _cup(),
    "pot": _pot(),
    "sphere_obstacles": _sphere_obstacles(),
}
"""Every scene that can be rendered, by name."""
