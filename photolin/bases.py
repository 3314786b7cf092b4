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
    score = np.array([score_triple(sample.images, t, Ts, lights) for t in triples])
    if not score.max() > 0:
        raise DegenerateError(
            f"no three images are lit at the same pixels (i >= Ts = {Ts:g}); "
            "lower Ts, or use images with larger common lit regions"
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
    return np.sort([rng.choice(count, 3, replace=False) for _ in range(limit)], axis=1)


def score_triple(
    images: NDArray[np.float32],
    triple: NDArray[np.int64],
    Ts: float,
    lights: NDArray[np.float64] | None,
) -> float:
    """Share of pixels lit in all three, times how far from a plane their lights lie, 0 to 1."""
    values = images[triple]
    common = (values >= Ts).all(axis=0) & (values > 0).all(axis=0)
    if common.sum() < 10:
        return 0.0
    if lights is not None:
        s = lights[triple] / np.linalg.norm(lights[triple], axis=1, keepdims=True)
        return float(common.mean() * abs(np.linalg.det(s)))
    # the square root caps the pull of highlights, which would pass for independence
    v = np.minimum(values[:, common], 3 * np.median(values[:, common], axis=1, keepdims=True))
    gram = v @ v.T
    scale = np.sqrt(np.diag(gram))
    return float(common.mean() * np.sqrt(max(np.linalg.det(gram / np.outer(scale, scale)), 0.0)))
