"""The input: one scene, one camera, K lights."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import DegenerateError, InputError

MIN_IMAGES = 6
"""Three base images and three more to linearize them."""


@dataclass(frozen=True, eq=False)
class ImageStack:
    """K registered, linear images of a static scene; validated, read-only."""

    images: NDArray[np.float32]
    """(K,H,W), fraction of full scale in [0, 1], linear."""
    mask: NDArray[np.bool_]
    """(H,W), true where the object is; at least one pixel."""
    names: tuple[str, ...]
    """K image names, in order."""
    title: str = "stack"
    """What a window or report calls the stack."""
    lights: NDArray[np.float64] | None = None
    """(K,3) direction towards the light times power; x right, y up, z to the camera."""
    files: tuple[tuple[str, str], ...] = ()
    """(path, sha256) of every file read."""
    notes: tuple[str, ...] = ()
    """Sentences on what reading decided: transfer, channel, dark frame, mask."""
    warnings: tuple[str, ...] = ()
    """Sentences on what looks wrong with the input."""

    def __post_init__(self) -> None:
        check_images(self.images, self.title)
        check_mask(self.mask, self.images.shape[1:], self.title)
        if len(self.names) != len(self.images):
            raise InputError(
                f"{self.title}: {len(self.names)} names for {len(self.images)} images; "
                "one name for each image is accepted"
            )
        if self.lights is not None:
            check_lights(self.lights, len(self.images), self.title)
        for array in (self.images, self.mask, self.lights):
            if array is not None:
                array.setflags(write=False)

    @property
    def pixels(self) -> NDArray[np.intp]:
        """(P,) flat indices (row * W + column) of the mask pixels, ascending; not kept, for they
        are as large as two images."""
        return np.flatnonzero(self.mask)

    def pick(self, ranks: NDArray[np.intp]) -> NDArray[np.intp]:
        """`pixels[ranks]`, without the list of all where the mask leaves none out."""
        return ranks if self.mask.all() else self.pixels[ranks]

    @property
    def shape(self) -> tuple[int, int, int]:
        """(K, H, W)."""
        K, H, W = self.images.shape
        return K, H, W


def check_images(images: NDArray, title: str) -> None:
    """Raise InputError unless `images` is (K>=6,H,W) float32, finite, in [0, 1], not all black."""
    if images.ndim != 3 or images.dtype != np.float32:
        raise InputError(
            f"{title}: images are {images.dtype} of shape {images.shape}; "
            "float32 of shape (images, rows, columns) is accepted"
        )
    if len(images) < MIN_IMAGES:
        raise InputError(
            f"{title}: {len(images)} images; at least {MIN_IMAGES} are needed "
            "(three base images and three to linearize them)"
        )
    low, high = images.min(axis=(1, 2)), images.max(axis=(1, 2))
    for k, (a, b) in enumerate(zip(low, high, strict=True)):
        if not (np.isfinite(a) and np.isfinite(b)):
            raise InputError(
                f"{title}: image {k} holds NaN or infinity; finite values are accepted"
            )
        if a < 0 or b > 1:
            raise InputError(
                f"{title}: image {k} spans {a:g} to {b:g}; "
                "fractions of full scale, 0 to 1, are accepted"
            )
        if b == 0:
            raise InputError(f"{title}: image {k} is all black; take it out or replace it")


def check_mask(mask: NDArray, shape: tuple[int, ...], title: str) -> None:
    """Raise InputError unless `mask` is bool of `shape` (H,W) with at least one true pixel."""
    if mask.dtype != np.bool_ or mask.shape != shape:
        raise InputError(
            f"{title}: the mask is {' x '.join(map(str, mask.shape))} (rows x columns), the images "
            f"are {' x '.join(map(str, shape))}; a mask of the images' size is accepted"
        )
    if not mask.any():
        raise InputError(
            f"{title}: the mask is empty; mark the object's pixels with non-zero values"
        )


def check_lights(lights: NDArray, count: int, title: str) -> None:
    """Raise unless `lights` is (count,3), finite, non-zero, with three independent directions."""
    if lights.shape != (count, 3):
        numbers = "" if lights.shape[1:] == (3,) else f" of {lights[:1].size} numbers"
        raise InputError(
            f"{title}: {len(lights)} lights{numbers} for {count} images; "
            "one line of x y z for each image is accepted"
        )
    size = np.abs(lights).max(axis=1)
    if not ((size > 1e-9) & (size < 1e9)).all():
        raise InputError(
            f"{title}: a light is zero or not finite; "
            "x y z of a length from 1e-9 to 1e9 is accepted"
        )
    norms = np.linalg.norm(lights, axis=1, keepdims=True)
    if np.linalg.svd(lights / norms, compute_uv=False)[2] < 1e-3 * np.sqrt(count):
        raise DegenerateError(
            f"{title}: the lights lie in one plane (fewer than three independent directions); "
            "photometric linearization needs lights that are spread in space"
        )
