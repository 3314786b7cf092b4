"""The surface in 3D: its mesh, which the page lays the picture on, and the lights as arrows.

In viser's world the picture lies in the plane of x (right) and y (down), and the camera is at
negative z; so a height towards the camera is a negative z there.
"""

from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray

from photolin.errors import DegenerateError
from photolin.shape.mesh import build_mesh
from photolin.shape.recover import Shape

from .ray import meet_relief, ray_in_text
from .state import Pixel

MESH, ARROWS, ARROW_SHOWN = "/canvas/relief", "/canvas/lights", "/canvas/light"
MOST_VERTICES = 150_000
"""Of the mesh in the browser."""
FAR = 0.36
"""Where arrows end, in diagonals of the picture."""


class Look(NamedTuple):
    """Of an arrow."""

    colour: tuple[int, int, int]
    long: float
    """In diagonals of the picture."""
    thick: float
    """Its head, in diagonals of the picture."""


FAINT, FULL = Look((128, 116, 64), 0.03, 0.004), Look((255, 140, 40), 0.09, 0.009)
"""Of the lights, and of that of the image shown."""


class Relief:
    """The surface of one tab; empty until one is set."""

    def __init__(self, client: viser.ClientHandle, height: int, width: int, world: float) -> None:
        """For pictures of `height` rows and `width` columns, `world` high in viser's world."""
        self._client, self._shape = client, (height, width)
        self._pixel = world / height
        self._depth: NDArray[np.float32] | None = None

    def set(self, shape: Shape | None) -> None:
        """Show this surface in place of the earlier one; None removes it."""
        self._client.scene.remove_by_name(MESH)
        self._depth = None
        if shape is None or shape.depth is None:
            return
        try:
            mesh = build_mesh(shape.depth, np.isfinite(shape.depth), most_vertices=MOST_VERTICES)
        except DegenerateError:  # single pixels: nothing to lay a picture on
            return
        self._depth = shape.depth
        turned = mesh.vertices * (np.array([1, -1, -1], np.float32) * np.float32(self._pixel))
        self._client.scene.add_mesh_simple(
            MESH, turned, mesh.faces, side="double", cast_shadow=False, receive_shadow=False
        )

    def set_arrows(self, shape: Shape | None, chosen: int) -> None:
        """Draw the lights as faint arrows towards the scene, that of image `chosen` in full.

        None removes them.
        """
        for name in (ARROWS, ARROW_SHOWN):
            self._client.scene.remove_by_name(name)
        if shape is None:
            return
        towards = shape.lights / np.linalg.norm(shape.lights, axis=1, keepdims=True)
        towards = towards * [1, -1, -1]
        self._draw_arrows(ARROWS, np.delete(towards, chosen, axis=0), FAINT)
        self._draw_arrows(ARROW_SHOWN, towards[[chosen]], FULL)

    def _draw_arrows(self, name: str, towards: NDArray[np.float64], look: Look) -> None:
        diagonal = float(np.hypot(*self._shape)) * self._pixel
        points = np.stack([towards * (FAR + look.long), towards * FAR], axis=1) * diagonal
        size = look.thick * diagonal
        self._client.scene.add_arrows(
            name,
            points.astype(np.float32),
            np.tile(np.array(look.colour, np.uint8), (len(points), 1)),
            shaft_radius=size / 4,
            head_radius=size,
            head_length=2.5 * size,
        )

    def height(self, pixel: Pixel) -> float | None:
        """Height of the surface at a pixel, pixels towards the camera; None where there is none."""
        z = np.nan if self._depth is None else float(self._depth[pixel])
        return z if np.isfinite(z) else None

    def pixel_on(self, text: str) -> Pixel | None:
        """The pixel of the surface that a ray meets, as the page wrote it; None beside it."""
        ray = ray_in_text(text)
        return None if ray is None or self._depth is None else meet_relief(self._depth, ray)
