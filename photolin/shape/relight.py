"""The linearized scene under a light of one's own."""

import numpy as np
from numpy.typing import NDArray

from ..errors import OptionError
from .recover import Shape


def relight(shape: Shape, light: tuple[float, float, float]) -> NDArray[np.float32]:
    """What a purely diffuse image of the scene shows under a distant light (Eq. 1).

    That is what photometric linearization was made for: images under any light from a few.

    Args:
        light: direction towards the light times power; x right, y up, z to the camera.

    Returns:
        (H,W) albedo times n·s, signed: negative in attached shadow. NaN where the normal is not
        determined, 0 outside the mask. Cast shadows are not in it.

    Raises:
        OptionError: a light that is zero, not finite or of absurd power.
    """
    s = np.array(light, np.float64)
    if s.shape != (3,) or not 1e-9 < np.abs(s).max() < 1e9:
        raise OptionError(f"the light is {light}; x y z of a length from 1e-9 to 1e9 is accepted")
    return (shape.albedo * (shape.normals @ s)).astype(np.float32)
