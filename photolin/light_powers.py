"""Whether the powers of known lights are those of the images."""

import numpy as np
from numpy.typing import NDArray

from .errors import PhotolinError
from .shape.some_lights import resolve_from_lights

UNEVEN = 0.02
"""Mean change of exposure against the given powers from which on it is worth a closer look: at most
0.015 on real stacks whose powers were measured, 0.04 and more where powers vary by 20 %."""
ALIKE = 1e-3
"""Relative difference of lengths up to which lights are given as equally strong."""
BELONG = 2.0
"""Degrees, rms, up to which directions fit the images; beyond it more than powers is wrong."""
NAMED = 3
"""Images that a sentence names."""


def is_uneven(gain: NDArray[np.floating]) -> bool:
    """Whether images are brighter and darker than their lights say, (K,) median i/l of each."""
    return bool(np.abs(gain / np.median(gain) - 1).mean() > UNEVEN)


def doubt_powers(
    lights: NDArray[np.floating], names: tuple[str, ...], coefficients: NDArray[np.float64]
) -> list[str]:
    """A sentence where the images contradict the powers of their lights.

    Args:
        lights: (K,3) as given, towards the light; the length is the power.
        names: K image names.
        coefficients: (K,3) of the images as if no light were known; with the directions given, they
            tell the powers, but for a common factor.
    """
    numbers = np.arange(len(lights))
    try:
        found = resolve_from_lights(coefficients, numbers, lights, powers=False)
    except PhotolinError:  # the directions do not tell
        return []
    if found.residual > BELONG:
        return []
    given = np.linalg.norm(lights, axis=1)
    ratio = np.linalg.norm(found.lights(coefficients), axis=1) / given
    ratio /= np.median(ratio)
    if not is_uneven(ratio):
        return []
    equal = np.ptp(given) <= ALIKE * given.max()
    worst = np.argsort(-np.abs(np.log(ratio)), kind="stable")[:NAMED]
    which = ", ".join(f"{ratio[k]:.2f} in image {k} ({names[k]})" for k in sorted(worst))
    return [
        f"the light powers given{', which are all equal,' if equal else ''} are not those of the "
        f"images: off by {100 * np.abs(ratio - 1).mean():.0f} % on average; true power by given "
        f"one: {which}; give x y z of the length of the power, or let photolin shape STACK OUT "
        "--powers unknown find the powers"
    ]
