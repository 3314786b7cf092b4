"""Label maps of whole images by Eq. (3), at the speed of memory."""

import numpy as np
from numpy.typing import NDArray

from .analysis import Cancel
from .blocks import run_blocks
from .factors import Thresholds
from .kernels import label_rows

BLOCK = 1 << 14
"""Pixels whose bases stay in the cache while all images are labelled."""


def label_images(
    images: NDArray[np.float32],
    linearized_bases: NDArray[np.float32],
    coefficients: NDArray[np.float64],
    mask: NDArray[np.bool_],
    thresholds: Thresholds,
    *,
    threads: int | None = None,
    cancel: Cancel | None = None,
) -> NDArray[np.uint8]:
    """Label maps of K images.

    Args:
        images: (K,H,W), fraction of full scale.
        linearized_bases: (3,H,W) signed.
        coefficients: (K,3).
        mask: (H,W).

    Returns:
        (K,H,W) Factor codes, the same as `factors.classify` gives; OUTSIDE where the mask is false.

    Raises:
        Cancelled: `cancel` said so.
    """
    flat = images.reshape(len(images), -1)
    bases = np.ascontiguousarray(linearized_bases).reshape(3, -1)
    c = coefficients.astype(np.float32)
    labels = np.empty(flat.shape, np.uint8)
    count = flat.shape[1]
    T, Ts = np.float32(thresholds.T), np.float32(thresholds.Ts)

    def work(start: int, stop: int) -> None:
        for k in range(len(flat)):
            label_rows(flat[k], bases, c[k], mask.reshape(-1), T, Ts, labels[k], start, stop)

    run_blocks(work, count, BLOCK, threads=threads, stage="labels", cancel=cancel)
    return labels.reshape(images.shape)
