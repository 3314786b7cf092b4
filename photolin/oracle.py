"""What perfect knowledge would give: the measure for the error of a linearization."""

import numpy as np
from numpy.typing import NDArray

from .factors import Factor
from .synthetic import Truth

WORST_CONDITION = 1e8
"""Condition of a pixel's normal equations up to which the oracle has an answer."""


def fit_oracle(
    images: NDArray[np.float32], truth: Truth
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Least squares on the true D observations with the true lights.

    Args:
        images: (K,H,W) the stack, noise and highlight tails included.

    Returns:
        (K,P) linearized values of the mask pixels, and (P,) whether the D observations determine
        them.
    """
    mask = truth.mask
    x = images[:, mask].astype(np.float64)
    lights = truth.lights.astype(np.float64) * truth.power[:, None]
    diffuse = (truth.labels[:, mask] == Factor.DIFFUSE).astype(np.float64)
    outer = (lights[:, :, None] * lights[:, None, :]).reshape(-1, 9)
    gram = (diffuse.T @ outer).reshape(-1, 3, 3)
    known = (diffuse.sum(axis=0) >= 3) & (np.linalg.cond(gram) < WORST_CONDITION)
    bases = np.zeros((x.shape[1], 3))
    right = (diffuse * x).T @ lights
    bases[known] = np.linalg.solve(gram[known], right[known][:, :, None])[:, :, 0]
    return lights @ bases.T, known
