"""What pixels are fitted to, once coefficients and noise are known."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Observations:
    """All observations of a stack with what is known of them."""

    images: NDArray[np.float32]
    """(K,H,W) fraction of full scale."""
    mask: NDArray[np.bool_]
    """(H,W) pixels of the object."""
    factors: NDArray[np.float32]
    """(3,K) coefficients in an orthogonal frame, see `factorize.orthogonalize`."""
    white: NDArray[np.float32]
    """(K,) saturated from there on."""
    Ts: float
    """Shadow level, fraction of full scale."""
    noise: float
    """Standard deviation of an observation, fraction of full scale, above 0."""
    bright: float
    """Level of the brightest grays, fraction of full scale, above 0."""
