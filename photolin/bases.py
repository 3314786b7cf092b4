"""Which three images serve as bases, and why.

The paper asks for linearly independent lights and large common regions of diffuse reflection. Both
are read off the images: over the pixels that are lit in all three, the determinant of the three
images' correlation matrix is small when their lights lie near a plane, and the number of those
pixels is the common region.
"""

from itertools import combinations
from math import comb

import numpy as np
from numpy.typing import NDArray

from .errors import DegenerateError
from .sample import Sample

MAX_TRIPLES = 3000
"""All triples of up to 27 images; a random choice of more."""
PIXELS = 800
MIN_COMMON = 10
"""Pixels that must be lit in all three, or all of a smaller object's."""
CHUNK = 256


def choose_bases(
    sample: Sample,
    Ts: float,
    seed: int,
    lights: NDArray[np.float64] | None = None,
    count: int = 1,
) -> list[tuple[int, int, int]]:
    """The `count` best triples of base images that differ in at least two images, best first.

    Args:
        lights: (K,3) where known: their own determinant replaces that of the correlation.

    Raises:
        DegenerateError: no three images share lit pixels.
    """
    triples = draw_triples(len(sample.images), MAX_TRIPLES, np.random.default_rng(seed))
    score = score_triples(sample.thin(PIXELS).images, triples, Ts, lights)
    if not score.max() > 0:
        raise DegenerateError(
            f"no three images that are lit at the same pixels (i >= Ts = {Ts:g}) differ enough to "
            "tell surface directions apart; lower Ts, or use images with larger common lit "
            "regions, lights farther apart and an object that is not flat"
        )
    chosen: list[tuple[int, int, int]] = []
    for index in np.argsort(-score, kind="stable"):
        a, b, c = (int(k) for k in triples[index])
        if score[index] > 0 and all(len({a, b, c} & set(t)) < 2 for t in chosen):
            chosen.append((a, b, c))
        if len(chosen) == count:
            break
    return chosen


def draw_triples(count: int, limit: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """(n,3) ascending triples of 0..count: all of them, or `limit` at random."""
    if comb(count, 3) <= limit:
        return np.array(list(combinations(range(count), 3)))
    return np.sort(rng.random((limit, count)).argpartition(3, axis=1)[:, :3], axis=1)


def score_triples(
    images: NDArray[np.float32],
    triples: NDArray[np.int64],
    Ts: float,
    lights: NDArray[np.float64] | None,
) -> NDArray[np.float64]:
    """(n,) share of pixels lit in all three, times how far from a plane the lights lie, 0 to 1."""
    lit = np.logical_and(images >= Ts, images > 0)
    # highlights would pass for independence
    tops = 3 * np.ma.median(np.ma.masked_array(images, ~lit), axis=1, keepdims=True).filled(0)
    values = np.where(lit, np.minimum(images, tops), 0)
    scores = []
    for start in range(0, len(triples), CHUNK):
        chunk = triples[start : start + CHUNK]
        common = np.all(lit[chunk], axis=1)
        v = values[chunk] * common[:, None]
        s = v if lights is None else lights[chunk]
        spread = gram_determinants(s @ s.transpose(0, 2, 1))
        enough = common.sum(axis=1) >= min(MIN_COMMON, common.shape[1])
        scores.append(np.where(enough, common.mean(axis=1) * np.sqrt(spread), 0))
    return np.concatenate(scores)


def gram_determinants(gram: NDArray[np.floating]) -> NDArray[np.float64]:
    """(n,) determinants of (n,3,3) Gram matrices of vectors scaled to length 1, 0 to 1."""
    gram = gram.astype(np.float64)
    scale = np.prod(np.diagonal(gram, axis1=1, axis2=2), axis=1)
    tiny = np.finfo(np.float64).tiny
    return np.asarray(np.maximum(np.linalg.det(gram), 0) / np.maximum(scale, tiny), np.float64)
