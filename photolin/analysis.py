"""What a run is asked (Options) and what it gives (Analysis)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from .errors import OptionError
from .factors import Thresholds

Method = Literal["robust", "classification", "statistical"]
METHODS: tuple[Method, ...] = get_args(Method)

Progress = Callable[[str, float], None]
"""Called with the stage's name and the fraction of it that is done, 0 to 1."""
Cancel = Callable[[], bool]
"""Asked between blocks of work; true stops it with `Cancelled`."""


@dataclass(frozen=True)
class Options:
    """What decides a result, besides the images."""

    method: Method = "robust"
    """robust; classification (the 2007 paper to the letter); statistical (its predecessor)."""
    T: float | None = None
    """Relative tolerance of i = l, above 0 up to 1; suggested from the data when left out."""
    Ts: float | None = None
    """Shadow level, fraction of full scale, 0 to below 1; suggested from the data when left out."""
    base_images: tuple[int, int, int] | None = None
    """Three image numbers, from 0; chosen automatically when left out."""
    samples: int = 500
    """Random samples for each image and pixel; for `robust`, which stops by itself, the limit."""
    seed: int = 0
    """Seed of all random choices; the same seed gives the same bytes."""

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise OptionError(f"method is {self.method!r}; accepted are {', '.join(METHODS)}")
        Thresholds(0.05 if self.T is None else self.T, 0.02 if self.Ts is None else self.Ts)
        if not 10 <= self.samples <= 100_000:
            raise OptionError(f"samples is {self.samples}; accepted is 10 to 100000")
        if not 0 <= self.seed < 2**32:
            raise OptionError(f"seed is {self.seed}; accepted is 0 to 4294967295")
        if self.base_images is not None and (
            not len(self.base_images) == len(set(self.base_images)) == 3
            or min(self.base_images) < 0
        ):
            raise OptionError(
                f"base_images is {self.base_images}; "
                "accepted are three different image numbers from 0"
            )


@dataclass(frozen=True, eq=False)
class Confidence:
    """What a result rests on; read-only."""

    lit: NDArray[np.uint16]
    """(H,W) images in which a pixel is lit (i >= Ts) and not saturated; 0 outside the mask."""
    diffuse: NDArray[np.uint16]
    """(H,W) images in which it is D."""
    margin: NDArray[np.uint16]
    """(H,W) votes by which the winner beat the best different solution; all its votes (twice its D
    plus its S) where highlights known from around it left no other; 0 by published methods."""
    spread: NDArray[np.float32]
    """(H,W) 0 where the lights of its D observations lie in a plane, 1 where they spread evenly."""
    support: NDArray[np.float64]
    """(K,) share of an image's lit pixels that are possible, not darker than the fit allows."""
    residual: NDArray[np.float64]
    """(K,) median of |i - l|/i among its lit pixels."""
    gain: NDArray[np.float64]
    """(K,) median of i/l there."""
    saturated: NDArray[np.float64]
    """(K,) share of saturated pixels."""

    def __post_init__(self) -> None:
        for array in vars(self).values():
            array.setflags(write=False)


@dataclass(frozen=True, eq=False)
class Analysis:
    """The linearization and labels of one stack; read-only."""

    options: Options
    """As given: T and Ts may be None there."""
    thresholds: Thresholds
    """As used, for linearization and labels alike."""
    base_images: tuple[int, int, int]
    """Image numbers of the three bases, from 0."""
    coefficients: NDArray[np.float64]
    """(K,3): linearized image k is their combination of the linearized bases; rows of the base
    images are the unit vectors."""
    linearized_bases: NDArray[np.float32]
    """(3,H,W) signed, fraction of full scale; 0 outside the mask, NaN where not determined."""
    labels: NDArray[np.uint8]
    """(K,H,W) Factor codes; OUTSIDE (255) outside the mask."""
    mask: NDArray[np.bool_]
    """(H,W)"""
    names: tuple[str, ...]
    """K image names."""
    seconds: Mapping[str, float]
    """Wall-clock seconds of each stage, and their `total` (without load and save)."""
    title: str = "stack"
    confidence: Confidence | None = None
    """None in results of versions that did not measure it."""
    lights: NDArray[np.float64] | None = None
    """(K,3) as the stack gave them; x right, y up, z to the camera."""
    files: tuple[tuple[str, str], ...] = ()
    """(path, sha256) of every file read."""
    notes: tuple[str, ...] = ()
    """Sentences on what was decided: by reading, by suggestion, by choice of bases."""
    warnings: tuple[str, ...] = ()
    """Sentences on what is wrong or doubtful."""

    def __post_init__(self) -> None:
        for array in (
            self.coefficients,
            self.linearized_bases,
            self.labels,
            self.mask,
            self.lights,
        ):
            if array is not None:
                array.setflags(write=False)

    def determined(self) -> NDArray[np.bool_]:
        """(H,W) mask pixels that have linearized bases; others are lit in too few images."""
        return self.mask & np.isfinite(self.linearized_bases).all(axis=0)

    def linearized(self, k: int) -> NDArray[np.float32]:
        """Linearized image k: (H,W) float32, signed, fraction of full scale; 0 outside the mask,
        NaN where not determined."""
        c = self.coefficients[k].astype(np.float32)
        b = self.linearized_bases
        return c[0] * b[0] + c[1] * b[1] + c[2] * b[2]
