"""Pixels that someone points out in images as shadow or as lit, and what is said of them. Pure."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from photolin.factors import css_colour
from photolin.shadow_level import ShadowLevel
from photolin.stack import ImageStack

from .box import Box
from .histograms import LIT, SHADOW
from .readout import escape, tell_threshold

Kind = Literal["shadow", "lit"]
NAMES: dict[Kind, str] = {"shadow": "Shadows", "lit": "Lit pixels"}
COLOURS: dict[Kind, str] = {"shadow": css_colour(SHADOW), "lit": css_colour(LIT)}
WANTED: dict[Kind, str] = {"shadow": "shadows", "lit": "lit pixels, dim ones too"}
MOST = 20_000
"""Intensities kept of one sample, and four times as many of a kind: an even choice of more."""


ONE_IMAGE = "Shadows of one image alone: others may be brighter, sample some of them too."


@dataclass(frozen=True, eq=False)
class Sample:
    """The mask pixels of a box in one image."""

    kind: Kind
    image: int
    """Number of the image, from 0."""
    box: Box
    count: int
    """Mask pixels in it, at least one."""
    values: NDArray[np.float32]
    """(N,) their intensities, fraction of full scale, or MOST of them; read-only."""


def take_sample(stack: ImageStack, kind: Kind, image: int, box: Box) -> Sample | None:
    """What a box within the picture holds of the mask in an image; None where that is nothing."""
    part = np.s_[box.row0 : box.row1, box.column0 : box.column1]
    places = np.flatnonzero(stack.mask[part])
    if not places.size:
        return None
    rows, columns = np.divmod(_thin(places, MOST), box.column1 - box.column0)
    values = stack.images[image][part][rows, columns]
    values.setflags(write=False)
    return Sample(kind, image, box, places.size, values)


def pool_samples(samples: Iterable[Sample], kind: Kind) -> NDArray[np.float32]:
    """(N,) intensities of all samples of a kind."""
    found = [sample.values for sample in samples if sample.kind == kind]
    return _thin(np.concatenate(found), 4 * MOST) if found else np.empty(0, np.float32)


def _thin(values: NDArray, most: int) -> NDArray:
    """At most `most` of the values, evenly spaced."""
    if len(values) <= most:
        return values
    return values[np.linspace(0, len(values) - 1, most).astype(np.intp)]


def tell_sampling(picking: Kind | None, samples: tuple[Sample, ...], note: str) -> list[str]:
    """What a drag does now, and how many samples there are; HTML."""
    doing, colour = "Not sampling: drags move the picture, clicks select pixels.", "transparent"
    if picking is not None:
        doing = f"Drag or click over {WANTED[picking]}. Shift-drag moves the picture."
        colour = COLOURS[picking]
    style = f"border-left:4px solid {colour};padding-left:0.5em;margin-bottom:0.4em"
    parts = [f'<div style="{style}">{escape(doing)}</div>']
    for kind, name in NAMES.items():
        own = [sample for sample in samples if sample.kind == kind]
        plural = "" if len(own) == 1 else "s"
        count = f"{sum(sample.count for sample in own)} pixels in {len(own)} sample{plural}"
        swatch = (
            f'<span style="display:inline-block;width:0.8em;height:0.8em;margin-right:0.4em;'
            f'background:{COLOURS[kind]}"></span>'
        )
        parts.append(f"<div>{swatch}{escape(f'{name}: {count}' if own else f'{name}: none')}</div>")
    shadows = {sample.image for sample in samples if sample.kind == "shadow"}
    if len(shadows) == 1:
        parts.append(f"<div>{escape(ONE_IMAGE)}</div>")
    if note:
        parts.append(f"<div><b>{escape(note)}.</b></div>")
    return parts


def tell_level(level: ShadowLevel, now: float) -> str:
    """The Ts found beside the one that is set; HTML."""
    wrong = f"{level.error:.1%} of the samples" if level.error else "no sample"
    found, present = tell_threshold(level.Ts), tell_threshold(now)
    text = f"Ts {found} (line): {wrong} on the wrong side. Now {present} (dashed)."
    return f"<div>{escape(text)}</div>"
