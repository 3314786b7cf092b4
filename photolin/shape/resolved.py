"""The 3x3 matrix that resolves the ambiguity of unknown lights, and how it was found."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Kind = Literal["lights", "points", "sphere", "some lights", "integrability"]
"""What resolved it: lights of all images; points of known normal; a sphere; lights of some images;
nothing but that normals belong to a surface."""

RESIDUALS: dict[Kind, str] = {
    "lights": "rms angle between the given lights and those found, degrees",
    "points": "rms angle between the given normals and those found, degrees",
    "sphere": "median angle between the sphere's normals and those found, degrees",
    "some lights": "rms angle between the given lights and those found, degrees",
    "integrability": "rms of dp/dy - dq/dx relative to the rms of the derivatives of p and q",
}
"""What `Resolved.residual` is, for each kind."""


@dataclass(frozen=True, eq=False)
class Resolved:
    """n = M b: from linearized bases b to surface vectors n, unit normal times albedo.

    Space is x right, y up, z to the camera. Read-only.
    """

    matrix: NDArray[np.float64]
    """(3,3) M. Row k of its inverse is the light of base image k."""
    kind: Kind
    """What it was found from."""
    residual: float
    """For points the rms angle between given and found normals, degrees; for a sphere the median
    of those; for lights the rms angle between given and found directions, degrees; for
    integrability the rms of dp/dy - dq/dx relative to that of the derivatives of p and q, from 0
    for a surface to about 1 for normals at random. `residual_means` says it in words."""
    scaled: bool
    """Whether albedo and powers have an absolute scale; else the lights of the three base images
    have the mean power 1, and albedo is relative to that."""
    note: str
    """One sentence for the user: what was used, how well it fits, what was assumed."""
    residuals: NDArray[np.float64] | None = None
    """(N,) degrees, of each given point or light, in their order; None for the other kinds."""
    doubts: tuple[str, ...] = ()
    """Sentences on what looks wrong in what was used."""

    def __post_init__(self) -> None:
        for array in (self.matrix, self.residuals):
            if array is not None:
                array.setflags(write=False)

    @property
    def residual_means(self) -> str:
        """What `residual` is, with its unit."""
        return RESIDUALS[self.kind]

    def lights(self, coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        """(K,3) light vectors s_k = c_k M^-1, direction towards the light times power, of images
        with `coefficients` (K,3)."""
        return coefficients @ np.linalg.inv(self.matrix)


def set_scale(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """The multiple of M (3,3) for which the lights of the base images have the mean power 1.

    Albedo is then what an image would show, as a fraction of full scale, under a light of that
    power straight above the surface.
    """
    powers = np.linalg.norm(np.linalg.inv(matrix), axis=1)
    return matrix * powers.mean()
