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
    # slices indexed from 0 become vector instructions, start + p does not
    x, inside, out = image[start:stop], mask[start:stop], labels[start:stop]
    b0, b1, b2 = bases[0, start:stop], bases[1, start:stop], bases[2, start:stop]
    c0, c1, c2 = c[0], c[1], c[2]
    for p in range(len(out)):
        i = x[p]
        l = c0 * b0[p] + c1 * b1[p] + c2 * b2[p]
        excess = i - l
        slack = T * i
        lit = i >= Ts
        dark = i < Ts
        diffuse = lit & (abs(excess) <= slack)
        specular = lit & (excess > slack) & (l >= 0)
        attached = dark & (l <= 0)
        cast = dark & (l > 0)
        # the four exclude each other, so their codes add up without a branch
        code = np.int32(diffuse) + 2 * np.int32(specular) + 3 * np.int32(attached)
        code += 4 * np.int32(cast)
        out[p] = np.uint8(code) if inside[p] else np.uint8(255)
