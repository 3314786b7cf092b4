"""A stated choice among surfaces that integrability cannot tell apart."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter, gaussian_filter1d
from scipy.optimize import minimize

from .directions import Floats, normalize

PIXELS = 6000
"""Most pixels that are used, spread evenly."""
BIN = 0.01
"""Width of the histogram's bins, of the natural logarithm of albedo."""
BLUR = 0.04
"""Standard deviation of the smoothing of the histogram, same unit."""
RANGE = 2.0
"""Largest distance from the median albedo that is told apart, same unit."""
POWER = 10.0
"""Weight of uneven light powers beside uneven albedo."""
CALM = 0.002
"""Weight that keeps the choice near a mean normal that faces the camera where nothing else does."""
STRETCHES = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Where the search starts: times the usual slope."""
RIM = 6
"""Pixels from the outline within which normals tell which way is out."""


def choose_relief(
    vectors: Floats,
    weights: Floats,
    lights: Floats | None,
    used: NDArray[np.bool_],
    mask: NDArray[np.bool_],
) -> Floats:
    """G (3,3), a generalized bas-relief transformation, for n = G v.

    All surfaces of z' = a z + b x + c y, with albedo and lights to match, give the same images
    (Belhumeur, Kriegman, Yuille 1999). Chosen are those a, b, c for which albedo is most even: its
    logarithm has the least entropy (Alldrin, Mallick, Kriegman 2007) - and light powers too, where
    lights are given, by their mean absolute logarithm from the median. Of the two signs of a, the
    one for which normals at the outline point outward; where no outline is seen, or it does not
    tell, the surface is convex on the whole.

    Args:
        vectors: (N,3) v: surface vectors up to G, z to the camera.
        weights: (N,) weights of the pixels.
        lights: (K,3) the lights that belong to v, or None.
        used: (H,W) which pixels they are.
        mask: (H,W) the object.
    """
    start = face_camera(vectors, weights)
    step = -(-len(vectors) // PIXELS)
    centred = vectors[::step] @ start.T
    share = weights[::step] / weights[::step].sum()
    rays = None if lights is None else lights @ np.linalg.inv(start)

    def unevenness(g: Floats) -> float:
        transform = relief(*g)
        total = entropy(np.log(np.linalg.norm(centred @ transform.T, axis=1)), share)
        if rays is not None:
            powers = np.log(np.linalg.norm(rays @ np.linalg.inv(transform), axis=1))
            total += POWER * float(np.abs(powers - np.median(powers)).mean())
        return total + CALM * float(g @ g)

    best = min((search(unevenness, np.log(s)) for s in STRETCHES), key=lambda found: found[1])[0]
    chosen = relief(*best) @ start
    return (
        np.diag([-1.0, -1.0, 1.0]) @ chosen
        if points_inward(vectors @ chosen.T, used, mask)
        else chosen
    )


def relief(b: float, c: float, stretch: float) -> Floats:
    """n = G v for p, q stretched by e^stretch after b, c were taken from them."""
    a = np.exp(stretch)
    return np.array([[a, 0, a * b], [0, a, a * c], [0, 0, 1]])


def face_camera(vectors: Floats, weights: Floats) -> Floats:
    """G after which the medians of p and q are 0, and that of the slope is 1."""
    seen = vectors[:, 2] > 1e-3 * np.linalg.norm(vectors, axis=1)
    slopes, w = -vectors[seen, :2] / vectors[seen, 2:], weights[seen]
    p, q = weighted_median(slopes[:, 0], w), weighted_median(slopes[:, 1], w)
    # where most normals are one, there is no usual slope
    slope = weighted_median(np.hypot(*(slopes - (p, q)).T), w) or 1.0
    return np.array([[1 / slope, 0, p / slope], [0, 1 / slope, q / slope], [0, 0, 1]])


def search(function, stretch: float) -> tuple[Floats, float]:
    """The least of `function` of (b, c, stretch) that is found from (0, 0, `stretch`)."""
    start = np.array([0, 0, stretch])
    corners = start + np.array([(0, 0, 0), (0.5, 0, 0), (0, 0.5, 0), (0, 0, 0.4)])
    found = minimize(
        function,
        start,
        method="Nelder-Mead",
        options={"initial_simplex": corners, "maxiter": 300, "xatol": 1e-3, "fatol": 1e-6},
    )
    return found.x, float(found.fun)


def entropy(values: Floats, shares: Floats) -> float:
    """Of the smoothed histogram of `values` (N,) with weights that sum to 1."""
    around = np.clip(values - weighted_median(values, shares), -RANGE, RANGE)
    place = (around + RANGE) / BIN
    low = place.astype(int)
    part = place - low
    count = int(2 * RANGE / BIN) + 2
    histogram = np.bincount(low, shares * (1 - part), count)
    histogram += np.bincount(low + 1, shares * part, count)
    density = gaussian_filter1d(histogram, BLUR / BIN)
    return float(-(density * np.log(density + 1e-12)).sum())


def weighted_median(values: Floats, weights: Floats) -> float:
    """The value below which half of the weight lies."""
    order = np.argsort(values, kind="stable")
    sums = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(sums, sums[-1] / 2)])


def points_inward(vectors: Floats, used: NDArray[np.bool_], mask: NDArray[np.bool_]) -> bool:
    """Whether normals near the outline point into the object; else whether it is concave."""
    unit = normalize(vectors)
    # the picture's own border is no outline
    edge = np.asarray(distance_transform_edt(mask))
    calm = gaussian_filter(edge, 1.5)
    down, right = np.gradient(calm, axis=0), np.gradient(calm, axis=1)
    near = (edge <= RIM)[used] if not mask.all() else np.zeros(len(unit), bool)
    out = -(unit[near, 0] * right[used][near] - unit[near, 1] * down[used][near])
    if near.any() and abs(out.mean()) > 0.1:
        return bool(out.mean() < 0)
    rows, columns = np.nonzero(used)
    return bool(unit[:, 0] @ (columns - columns.mean()) - unit[:, 1] @ (rows - rows.mean()) < 0)
