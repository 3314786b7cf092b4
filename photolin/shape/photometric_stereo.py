"""Photometric stereo without linearization, and from labels: what Table 3 of Mukaigawa et al. 2007
compares (section 4.C).

`simple` is least squares on all observations, shadows and highlights included: `fit_all` with
known lights, `factorize_all` without. From labels, `fit_diffuse` uses the D observations of an
analysis alone. All give bases that `normals_from_bases` takes.
"""

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ..analysis import Analysis, Cancel, Progress
from ..blocks import run_blocks
from ..errors import DegenerateError, InputError
from ..kernels import diffuse_rows
from ..saturation import find_white
from ..stack import ImageStack, check_lights

BLOCK = 4096
PLANE = 1e-6
"""Third singular value of all observations, relative to the first, below which they have rank 2."""


def fit_all(stack: ImageStack, lights: NDArray[np.floating]) -> NDArray[np.float32]:
    """Least squares on all observations: n = argmin sum over k of (i_k - s_k·n)^2.

    Args:
        lights: (K,3) direction towards the light times power; x right, y up, z to the camera.

    Returns:
        (3,H,W) surface vectors, unit normal times albedo; 0 outside the mask. The matrix that goes
        with them is the identity.

    Raises:
        InputError: lights of another count, zero or not finite.
        DegenerateError: lights in one plane.
    """
    known = np.asarray(lights, np.float64)
    check_lights(known, len(stack.images), stack.title)
    return _picture(stack, np.einsum("ik,kp->ip", np.linalg.pinv(known), _observations(stack)))


def factorize_all(stack: ImageStack) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Best rank-3 factorization of all observations (Hayakawa, JOSA A 11(11), 1994).

    Returns:
        (3,H,W) bases b, 0 outside the mask, and (K,3) coefficients c, i_k near c_k·b, in a frame
        in which c has orthogonal columns of length sqrt(K/3): up to a 3x3 matrix. The same matrix
        and its inverse applied to both leaves the product.

    Raises:
        DegenerateError: the observations have a rank below 3.
    """
    X = _observations(stack)
    # K x K instead of K x P: quick, and its rounding is far below the noise of images
    # a sum's last digits depend on how many threads of BLAS share it
    with threadpool_limits(1, "blas"):
        values, vectors = np.linalg.eigh(X @ X.T)
    sizes = np.sqrt(np.maximum(values[:-4:-1], 0))
    if not sizes[2] > PLANE * sizes[0]:
        raise DegenerateError(
            f"{stack.title}: the observations have fewer than three independent parts; "
            "lights and surfaces that are spread in space are accepted"
        )
    scale = np.sqrt(len(X) / 3)
    first = vectors[:, :-4:-1]
    # the sign of an eigenvector is arbitrary: images get brighter with the first, on the whole
    first = first * np.where(first.sum(axis=0) < 0, -1, 1)
    return _picture(stack, np.einsum("kc,kp->cp", first, X) / scale), first * scale


def fit_diffuse(
    stack: ImageStack,
    analysis: Analysis,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> NDArray[np.float32]:
    """Bases by least squares on the D observations of an analysis that are not saturated.

    Args:
        analysis: of this stack, by any method; its labels and coefficients are used.
        threads: processors to use; the result does not depend on it.

    Returns:
        (3,H,W) in the frame of `analysis.base_images`; NaN where D are fewer than three or their
        lights lie in a plane, 0 outside the mask.

    Raises:
        InputError: stack and analysis differ in shape.
        Cancelled: `cancel` said so.
    """
    if analysis.labels.shape != stack.shape:
        raise InputError(
            f"the labels have shape {analysis.labels.shape}, the images {stack.shape}; "
            "the analysis of this stack is accepted"
        )
    K, H, W = stack.shape
    q, r = np.linalg.qr(analysis.coefficients)
    scale = np.sqrt(K / 3)
    out, white = np.empty((3, H * W)), find_white(stack)
    A, X = np.ascontiguousarray((q * scale).T), stack.images.reshape(K, -1)
    labels = analysis.labels.reshape(K, -1)

    def work(start: int, stop: int) -> None:
        diffuse_rows(X, labels, A, white, out, start, stop)

    run_blocks(
        work, H * W, BLOCK, threads=threads, stage="normals", progress=progress, cancel=cancel
    )
    bases = np.einsum("ij,jp->ip", np.linalg.inv(r) * scale, out)
    return np.where(stack.mask, bases.reshape(3, H, W), 0).astype(np.float32)


def _observations(stack: ImageStack) -> NDArray[np.float64]:
    """(K,P) of the mask pixels."""
    return stack.images.reshape(len(stack.images), -1)[:, stack.pixels].astype(np.float64)


def _picture(stack: ImageStack, values: NDArray[np.float64]) -> NDArray[np.float32]:
    """(3,H,W) of values (3,P) of the mask pixels."""
    _, H, W = stack.shape
    bases = np.zeros((3, H * W), np.float32)
    bases[:, stack.pixels] = values
    return bases.reshape(3, H, W)
