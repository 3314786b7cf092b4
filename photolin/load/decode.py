"""Images of a layout to (K,H,W), one at a time in each thread."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..analysis import Progress
from ..errors import InputError, OptionError
from .layout import Frame, Layout
from .options import Channel, LoadOptions
from .pictures import Picture, check_size, read_picture
from .transfer import linear_plane, one_channel


@dataclass(frozen=True, eq=False)
class Plan:
    """What is done to every image alike."""

    first: Picture
    """The picture that all others must be alike."""
    where: str
    """What errors call the first."""
    transfer: Literal["linear", "srgb"]
    auto: bool
    """Whether files may not ask for another transfer."""
    channel: Channel
    region: tuple[slice, slice]
    offset: float
    dark: Sequence[NDArray] | None = None
    black: bool = False
    """Whether an image may be all black, as one channel of it may be."""


def make_plan(layout: Layout, options: LoadOptions) -> Plan:
    """Decide from the first image how all are read.

    Raises:
        InputError: the first image or a dark frame cannot be used, or the stack is too large.
        OptionError: the region lies outside the images.
    """
    first = layout.frames[0].read()
    H, W = first.pixels.shape[:2]
    row0, row1, col0, col1 = options.roi or (0, H, 0, W)
    if row1 > H or col1 > W:
        raise OptionError(
            f"roi is {options.roi}; accepted are rows up to {H} and columns up to {W}"
        )
    check_size(row1 - row0, col1 - col0, str(layout.where), len(layout.frames))
    plan = Plan(
        first=first,
        where=layout.frames[0].where,
        transfer=first.transfer if options.transfer == "auto" else options.transfer,
        auto=options.transfer == "auto",
        channel=options.channel,
        offset=options.offset,
        region=(slice(row0, row1), slice(col0, col1)),
    )
    return replace(plan, dark=_read_dark(layout.dark, plan)) if layout.dark else plan


def _read_dark(paths: Sequence[Path], plan: Plan) -> list[NDArray]:
    """The mean of the dark frames, (H,W) linear for each channel."""
    pictures = [read_picture(path) for path in paths]
    for path, picture in zip(paths, pictures, strict=True):
        _check_alike(picture, str(path), plan)
    return [
        np.mean([linear_plane(p, c, plan.transfer) for p in pictures], axis=0)
        for c in range(plan.first.pixels.shape[2])
    ]


def read_images(
    layout: Layout, plan: Plan, progress: Progress | None, excluded: Layout | None = None
) -> tuple[NDArray[np.float32], list[str]]:
    """All images (K,H,W) of the region in [0, 1], and what had to be done for that.

    Args:
        excluded: images of the same stack that are left out. They have a say in the scale of
            values above 1, so that leaving one out does not change the unit of Ts.

    Raises:
        InputError: names the first image, in order, that cannot be used.
    """
    images, top = read_values(layout, plan, progress)
    if excluded is not None and (plan.first.pixels.dtype.kind == "f" or layout.powers is not None):
        top = max(top, _brightest(excluded, plan))
    return images, _fit(images, top, plan)


def _brightest(excluded: Layout, plan: Plan) -> float:
    """The maximum of images that are left out, those aside that could not be read anyway."""
    top = 0.0
    for k, frame in enumerate(excluded.frames):
        power = None if excluded.powers is None else excluded.powers[k]
        with suppress(InputError):
            top = max(top, float(_read_image(frame, plan, power).max()))
    return top


def read_values(
    layout: Layout, plan: Plan, progress: Progress | None
) -> tuple[NDArray[np.float32], float]:
    """All images (K,H,W) of the region as they are, negative or above 1 too, and the maximum of
    the whole images.

    Raises:
        InputError: names the first image, in order, that cannot be used.
    """
    frames = layout.frames
    rows, columns = plan.region
    images = np.empty(
        (len(frames), rows.stop - rows.start, columns.stop - columns.start), np.float32
    )

    def read(k: int) -> float:
        power = None if layout.powers is None else layout.powers[k]
        image = _read_image(frames[k], plan, power)
        images[k] = image[plan.region]
        return float(image.max())

    tops = []
    with ThreadPoolExecutor(min(8, os.cpu_count() or 1)) as pool:
        try:
            for top in pool.map(read, range(len(frames))):
                tops.append(top)
                if progress is not None:
                    progress("load", len(tops) / len(frames))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return images, max(tops)


def _read_image(frame: Frame, plan: Plan, power: NDArray | None) -> NDArray[np.float32]:
    picture = frame.read()
    _check_alike(picture, frame.where, plan)
    image = one_channel(picture, plan.channel, plan.transfer, plan.dark, power)
    if not np.isfinite(image).all():
        raise InputError(f"{frame.where}: holds NaN or infinity; finite values are accepted")
    if image[plan.region].max() <= 0 and not plan.black:
        once = "" if plan.dark is None else " once the dark frame is subtracted"
        raise InputError(f"{frame.where}: is all black{once}; take it out or replace it")
    return image


def _check_alike(picture: Picture, where: str, plan: Plan) -> None:
    """Raise InputError unless `picture` has the size, kind and transfer of the first."""
    here, first = _describe(picture), _describe(plan.first)
    if here != first:
        raise InputError(
            f"{where}: is {here}, but {plan.where} is {first}; "
            "images of one size and kind are accepted"
        )
    if plan.auto and picture.transfer != plan.transfer:
        raise InputError(
            f"{where}: is {picture.transfer} ({picture.why}), but {plan.where} is {plan.transfer} "
            f"({plan.first.why}); name one with the option transfer"
        )


def _describe(picture: Picture) -> str:
    H, W, C = picture.pixels.shape
    full = "" if picture.full in (1, 255, 65535) else f" up to {picture.full:g}"
    return f"{H} x {W} {'gray' if C == 1 else 'RGB'} {picture.pixels.dtype}{full}"


def _fit(images: NDArray[np.float32], top: float, plan: Plan) -> list[str]:
    """Bring `images` into [0, 1] in place, and say how."""
    notes = []
    below = count_below(images)
    if plan.dark is not None:
        notes.append(f"dark frame: observations below it, taken as 0: {below}")
    elif below:
        notes.append(f"values: observations below 0, taken as 0: {below}")
    if top > 1:
        images /= np.float32(top)
        notes.append(f"scale: values go up to {top:.6g}; all images are divided by that")
    if plan.offset:
        images -= np.float32(plan.offset)
        dim = count_below(images)
        notes.append(
            f"offset: {plan.offset:g} is subtracted; observations below it, taken as 0: {dim}"
        )
    np.maximum(images, 0, out=images)
    return notes


def count_below(images: NDArray[np.float32]) -> int:
    """Observations below 0, counted an image at a time to save memory."""
    return sum(int(np.count_nonzero(image < 0)) for image in images)
