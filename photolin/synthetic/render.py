"""From a scene's name to its images and their truth."""

from dataclasses import dataclass, replace
from math import isfinite
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import OptionError
from ..factors import OUTSIDE, Factor
from ..stack import MIN_IMAGES, ImageStack
from .scenes import SCENES, Setup, Surface, camera, place_lights
from .shapes import Floats

Bits = Literal[8, 16]

LIFT = 1e-6
"""Distance a shadow ray starts above its surface, mm: more than rounding, less than any detail."""

VALUE_LIMIT = 200_000_000
"""Most values of a scene, images times pixels: about 5 GB while it is rendered."""


@dataclass(frozen=True, eq=False)
class Truth:
    """What is known of a scene; space is x right, y up, z to the camera."""

    labels: NDArray[np.uint8]
    """(K,H,W) Factor codes, OUTSIDE (255) outside the mask. A where n·s <= 0, C where n·s > 0 and
    occluded, S where the highlight exceeds 0.5 % of full scale and 2 % of the diffuse part."""
    ideal: NDArray[np.float32]
    """(K,H,W) albedo · power · (n·s), signed, fraction of full scale; 0 outside the mask."""
    normals: NDArray[np.float32]
    """(H,W,3) unit; 0 outside the mask."""
    albedo: NDArray[np.float32]
    """(H,W)"""
    depth: NDArray[np.float32]
    """(H,W) z in mm; NaN outside the mask."""
    lights: NDArray[np.float32]
    """(K,3) unit, towards the light."""
    power: NDArray[np.float32]
    """(K,)"""
    mask: NDArray[np.bool_]
    """(H,W)"""
    px_mm: float
    """Side of a pixel, mm: x = (column + .5 - W/2) · px_mm, y = (H/2 - row - .5) · px_mm."""

    def __post_init__(self) -> None:
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)


@dataclass(frozen=True, eq=False)
class Scene:
    """A rendered stack and its truth."""

    stack: ImageStack
    truth: Truth
    bits: Bits | None
    """Bits the images are quantised to; None: not quantised."""


@dataclass(frozen=True, eq=False)
class Geometry:
    """The P visible points, one for each mask pixel in raster order."""

    mask: NDArray[np.bool_]
    """(H,W)"""
    points: Floats
    """(P,3) mm, in space."""
    normals: Floats
    """(P,3) unit, in space, facing the camera."""
    depth: Floats
    """(P,) z in the camera frame, mm."""
    albedo: Floats
    """(P,)"""
    gloss: Floats
    """(P,)"""
    shininess: Floats
    """(P,)"""


def render_scene(
    name: str,
    *,
    size: tuple[int, int] | None = None,
    images: int | None = None,
    seed: int = 0,
    noise: float = 0.0,
    bits: Bits | None = 16,
    ambient: float = 0.0,
) -> Scene:
    """Render one of SCENES as a camera would take it.

    Args:
        name: one of SCENES.
        size: rows and columns, 16 to 4096; the scene's own when left out.
        images: number of images, 6 to 1000; the scene's own when left out. The first n lights are
            the same for every number.
        seed: seed of the noise, 0 to 4294967295; nothing else is random.
        noise: standard deviation of Gaussian noise, fraction of full scale, 0 to 1.
        bits: 8 or 16 bits of quantisation; None for none.
        ambient: constant level added to every pixel, fraction of full scale, 0 to below 1.

    Returns:
        The stack, clipped to [0, 1] after ambient and noise, and the truth, free of both.

    Raises:
        OptionError: an argument is out of range, or all together are too large.
    """
    setup = _configure(name, size, images)
    _check_camera(noise, bits, ambient, seed)
    truth, exact = render_truth(setup)
    taken = exact + ambient
    if noise:
        taken += np.random.default_rng(seed).normal(0, noise, taken.shape)
    taken = np.clip(taken, 0, 1)
    if bits:
        full = 2**bits - 1
        taken = np.round(taken * full) / full
    names = tuple(f"{k:03d}.png" for k in range(len(taken)))
    stack = ImageStack(taken.astype(np.float32), truth.mask, names, title=name)
    return Scene(stack, truth, bits)


def render_truth(setup: Setup) -> tuple[Truth, Floats]:
    """The truth of a scene and its (K,H,W) images before clipping, noise and quantisation."""
    H, W = setup.size
    px_mm = max(setup.view[0] / H, setup.view[1] / W)
    seen = trace(setup, px_mm)
    rotation = camera(setup.tilt)
    lights, power = place_lights(setup, setup.images)
    normals = seen.normals @ rotation.T
    mirrored = 2 * normals[:, 2:] * normals - (0, 0, 1)

    labels = np.full((setup.images, H, W), OUTSIDE, np.uint8)
    ideal, images = np.zeros(labels.shape, np.float32), np.zeros(labels.shape)
    for k, (s, p) in enumerate(zip(lights, power, strict=True)):
        diffuse = seen.albedo * p * (normals @ s)
        specular = seen.gloss * p * np.maximum(mirrored @ s, 0) ** seen.shininess
        attached = normals @ s <= 0
        cast = occluded(setup.surfaces, seen, s @ rotation, ~attached)
        shiny = (specular > 0.005) & (specular > 0.02 * diffuse)
        labels[k, seen.mask] = np.select(
            [attached, cast, shiny],
            [Factor.ATTACHED, Factor.CAST, Factor.SPECULAR],
            Factor.DIFFUSE,
        )
        ideal[k, seen.mask] = diffuse
        images[k, seen.mask] = (diffuse + specular) * ~(attached | cast)

    truth = Truth(
        labels=labels,
        ideal=ideal,
        normals=_picture(normals, seen.mask),
        albedo=_picture(seen.albedo, seen.mask),
        depth=_picture(seen.depth, seen.mask, np.nan),
        lights=lights.astype(np.float32),
        power=power.astype(np.float32),
        mask=seen.mask,
        px_mm=px_mm,
    )
    return truth, images


def trace(setup: Setup, px_mm: float) -> Geometry:
    """What each pixel's ray meets first."""
    H, W = setup.size
    rotation = camera(setup.tilt)
    row, column = np.mgrid[:H, :W].reshape(2, -1)
    far = 1e4  # mm in front of the scene
    x, y = (column + 0.5 - W / 2) * px_mm, (H / 2 - row - 0.5) * px_mm
    origins = np.stack((x, y, np.full(len(x), far)), axis=1) @ rotation + setup.centre
    distances = np.stack([s.shape.hit(origins, -rotation[2]) for s in setup.surfaces])
    first, distance = distances.argmin(0), distances.min(0)
    hit = np.isfinite(distance)

    first, distance = first[hit], distance[hit]
    points = origins[hit] - distance[:, None] * rotation[2]
    normals, albedo = np.zeros(points.shape), np.zeros(len(points))
    for k, surface in enumerate(setup.surfaces):
        here = first == k
        normals[here] = surface.shape.normals(points[here])
        albedo[here] = surface.albedo(points[here]) if callable(surface.albedo) else surface.albedo
    normals *= np.where(normals @ rotation[2] < 0, -1, 1)[:, None]
    gloss, shininess = np.array([(s.gloss, s.shininess) for s in setup.surfaces])[first].T
    mask = hit.reshape(H, W)
    return Geometry(mask, points, normals, far - distance, albedo, gloss, shininess)


def occluded(
    surfaces: tuple[Surface, ...], seen: Geometry, light: Floats, lit: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """(P,) true where a ray from a point with `lit` towards the light meets a surface."""
    origins = seen.points[lit] + LIFT * seen.normals[lit]
    blocked = np.zeros(len(lit), bool)
    for surface in surfaces:
        blocked[lit] |= np.isfinite(surface.shape.hit(origins, light))
    return blocked


def _picture(values: Floats, mask: NDArray[np.bool_], outside: float = 0.0) -> NDArray[np.float32]:
    picture = np.full((*mask.shape, *values.shape[1:]), outside, np.float32)
    picture[mask] = values
    return picture


def _configure(name: str, size: tuple[int, int] | None, images: int | None) -> Setup:
    if name not in SCENES:
        raise OptionError(f"there is no scene {name!r}; accepted are {', '.join(SCENES)}")
    setup = SCENES[name]
    H, W = size or setup.size
    if not (16 <= H <= 4096 and 16 <= W <= 4096):
        raise OptionError(f"size is {H} x {W}; accepted are 16 to 4096 rows and columns")
    count = setup.images if images is None else images
    if not MIN_IMAGES <= count <= 1000:
        raise OptionError(f"images is {count}; accepted is {MIN_IMAGES} to 1000")
    if H * W * count > VALUE_LIMIT:
        raise OptionError(
            f"{count} images of {H} x {W} are too large to render; "
            f"accepted are {VALUE_LIMIT // 10**6} million values, images times pixels"
        )
    return replace(setup, size=(H, W), images=count)


def _check_camera(noise: float, bits: int | None, ambient: float, seed: int) -> None:
    if not (isfinite(noise) and 0 <= noise <= 1):
        raise OptionError(f"noise is {noise:g}; accepted is a fraction of full scale, 0 to 1")
    if bits not in (8, 16, None):
        raise OptionError(f"bits is {bits}; accepted are 8, 16 and None")
    if not (isfinite(ambient) and 0 <= ambient < 1):
        raise OptionError(f"ambient is {ambient:g}; accepted is a fraction, 0 to below 1")
    if not 0 <= seed < 2**32:
        raise OptionError(f"seed is {seed}; accepted is 0 to 4294967295")
