"""Eq. (3) over pixels of one image."""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True)
def label_rows(image, bases, c, mask, T, Ts, labels, start, stop):  # pragma: no cover
    """Label pixels start..stop of one image.

    Args:
        image: (N,) float32 observations, flattened.
        bases: (3,N) float32 linearized bases.
        c: (3,) float32 coefficients of the image.
        mask: (N,) bool.
        T, Ts: float32 thresholds.
        labels: (N,) uint8, written.
    """
    for p in range(start, stop):
        i = image[p]
        l = c[0] * bases[0, p] + c[1] * bases[1, p] + c[2] * bases[2, p]
        excess = i - l
        slack = T * i
        lit = i >= Ts
        diffuse = lit & (abs(excess) <= slack)
        specular = lit & (excess > slack) & (l >= 0)
        attached = (i < Ts) & (l <= 0)
        cast = (i < Ts) & (l > 0)
        # the four exclude each other, so their codes add up; no branch, so the loop vectorizes
        code = (
            np.uint8(diffuse)
            + np.uint8(2) * np.uint8(specular)
            + np.uint8(3) * np.uint8(attached)
            + np.uint8(4) * np.uint8(cast)
        )
        labels[p] = code if mask[p] else np.uint8(255)
