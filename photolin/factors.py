"""Photometric factors and the rule that tells them apart (Eq. 3 and 4 of Mukaigawa et al. 2007)."""

from dataclasses import dataclass
from enum import IntEnum
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import OptionError


class Factor(IntEnum):
    """Codes of a label map; stable across versions and files."""

    UNDEFINED = 0
    DIFFUSE = 1
    SPECULAR = 2
    ATTACHED = 3
    CAST = 4


OUTSIDE = 255
"""Code of a pixel outside the mask."""

LETTERS = {
    Factor.DIFFUSE: "D",
    Factor.SPECULAR: "S",
    Factor.ATTACHED: "A",
    Factor.CAST: "C",
    Factor.UNDEFINED: "U",
}
"""The paper's letter of each factor, in the order a legend shows them."""

TITLES = {
    Factor.DIFFUSE: "diffuse",
    Factor.SPECULAR: "specular",
    Factor.ATTACHED: "attached shadow",
    Factor.CAST: "cast shadow",
    Factor.UNDEFINED: "undefined",
}

PALETTE = {
    Factor.DIFFUSE: (0x00, 0x9E, 0x73),
    Factor.SPECULAR: (0xE6, 0x9F, 0x00),
    Factor.ATTACHED: (0x00, 0x72, 0xB2),
    Factor.CAST: (0xCC, 0x79, 0xA7),
    Factor.UNDEFINED: (0xD5, 0x5E, 0x00),
}
"""sRGB of each factor (Okabe and Ito, colour-blind safe), everywhere a factor has a colour."""


@dataclass(frozen=True)
class Thresholds:
    """The two thresholds of Eq. (3)."""

    T: float
    """Relative tolerance of i = l, unitless, in (0, 1]."""
    Ts: float
    """Shadow level, fraction of full scale, in [0, 1)."""

    def __post_init__(self) -> None:
        if not (isfinite(self.T) and 0 < self.T <= 1):
            raise OptionError(f"T is {self.T:g}; accepted is a number above 0 and up to 1")
        if not (isfinite(self.Ts) and 0 <= self.Ts < 1):
            raise OptionError(f"Ts is {self.Ts:g}; accepted is a number from 0 to below 1")


def css_colour(factor: int) -> str:
    """The colour of a factor as CSS and SVG have it."""
    return "#{:02X}{:02X}{:02X}".format(*PALETTE[Factor(factor)])


def classify(i: ArrayLike, l: ArrayLike, thresholds: Thresholds) -> NDArray[np.uint8]:
    """Label observations by Eq. (3).

    Args:
        i: input intensities, fraction of full scale, any shape.
        l: linearized intensities (signed), same shape.
        thresholds: T and Ts.

    Returns:
        Factor codes, uint8, of the broadcast shape. Every (i, l) gets exactly one; NaN gets
        UNDEFINED. Compared in float32, the precision stacks and results are stored in.
    """
    i, l = np.asarray(i, np.float32), np.asarray(l, np.float32)
    T, Ts = np.float32(thresholds.T), np.float32(thresholds.Ts)
    with np.errstate(invalid="ignore", over="ignore"):
        lit, dark, excess, slack = i >= Ts, i < Ts, i - l, T * i
        rules = [
            (lit & (np.abs(excess) <= slack), Factor.DIFFUSE),
            (lit & (excess > slack) & (l >= 0), Factor.SPECULAR),
            (dark & (l <= 0), Factor.ATTACHED),
            (dark & (l > 0), Factor.CAST),
        ]
    conditions, codes = zip(*rules, strict=True)
    return np.select(conditions, codes, default=Factor.UNDEFINED).astype(np.uint8)


def classifiable(labels: ArrayLike) -> NDArray[np.bool_]:
    """Eq. (4): true for D, A and C; false for S, U and outside the mask."""
    return _CLASSIFIABLE[np.asarray(labels, np.uint8)]


_CLASSIFIABLE = np.isin(np.arange(256), (Factor.DIFFUSE, Factor.ATTACHED, Factor.CAST))
