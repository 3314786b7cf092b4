"""How a stack is read."""

import operator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Literal, get_args

from ..errors import OptionError

Channel = Literal["mean", "luminance", "max", "r", "g", "b"]
Transfer = Literal["auto", "linear", "srgb"]


@dataclass(frozen=True)
class LoadOptions:
    """What decides the numbers of a stack, besides its files."""

    channel: Channel = "mean"
    """How colour becomes one channel; luminance weighs linear values by Rec. 709."""
    transfer: Transfer = "auto"
    """How stored values relate to light; auto decides by the kind of file and its tags."""
    mask: Path | None = None
    """Image file, bright on the object; the layout's own when left out."""
    lights: Literal["none"] | Path | None = None
    """Lights file: a line of x y z for each image, right, up and to the camera, as long as the
    light is strong; the layout's own when left out; "none" ignores lights."""
    dark: Path | None = None
    """Image taken with the lights off, subtracted from all; the layout's own when left out."""
    offset: float = 0.0
    """Constant subtracted from all images, fraction of full scale: ambient light, black level."""
    roi: tuple[int, int, int, int] | None = None
    """Region to read: row0, row1, column0, column1, half-open; everything when left out."""
    exclude: tuple[int, ...] = ()
    """Images to leave out, numbers from 0 in the order of the files; what is left counts anew."""

    def __post_init__(self) -> None:
        for name, value, kinds in (
            ("channel", self.channel, get_args(Channel)),
            ("transfer", self.transfer, get_args(Transfer)),
        ):
            if value not in kinds:
                raise OptionError(f"{name} is {value!r}; accepted are {', '.join(kinds)}")
        if not 0 <= self.offset < 1:
            raise OptionError(f"offset is {self.offset:g}; accepted is 0 to below 1")
        if self.roi is not None:
            row0, row1, col0, col1 = self.roi
            if not (0 <= row0 < row1 and 0 <= col0 < col1):
                raise OptionError(
                    f"roi is {self.roi}; accepted is row0 row1 col0 col1 with 0 <= row0 < row1 "
                    "and 0 <= col0 < col1"
                )
        self._order_exclude()

    def _order_exclude(self) -> None:
        """Any sequence, as JSON gives a list, becomes a tuple in ascending order."""
        exclude = tuple(sorted(map(operator.index, self.exclude)))
        if exclude and exclude[0] < 0:
            raise OptionError(f"exclude is {exclude[0]}; accepted are image numbers from 0")
        for k, following in pairwise(exclude):
            if k == following:
                raise OptionError(f"exclude names image {k} twice; accepted is each image once")
        object.__setattr__(self, "exclude", exclude)
