"""A sphere that someone points out: its outline first, then points on it. Pure."""

from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from photolin.analysis import Analysis
from photolin.errors import PhotolinError
from photolin.shape.circle import fit_circle
from photolin.shape.known import Sphere

from .state import Pixel

THREE, ENOUGH = 3, 5
"""Clicks on the rim that make a circle; points from which the shape is recovered at once: the
paper's number."""
RIM, ON = "outline", "points"
Part = Literal["outline", "points"]
"""Of the sphere. What is wanted: the outline alone, or points inside it too."""
FIRST = "First the outline: click the rim of the sphere three times."
WHOLE = "Of a whole sphere no points are wanted."
LINE = "These clicks lie on a line. Click all around the rim."


class Click(NamedTuple):
    """One click on the picture."""

    part: Part
    pixel: Pixel
    before: Sphere
    """The outline before it."""
    guessed: bool
    """Whether that was the guess."""


@dataclass(frozen=True)
class Pointed:
    """What was clicked and set of a sphere; a step makes a new one."""

    outline: Sphere
    """Row and column of the centre and radius, pixels; whole at pixel centres."""
    guessed: bool = True
    """Whether nobody has set the outline yet."""
    clicks: tuple[Click, ...] = ()
    """In their order."""
    wanted: Part | None = None
    """None while no sphere is."""
    picking: Part | None = None
    """What clicks on the picture are; None: they select pixels."""
    refused: str = ""
    """Why the last step was not taken."""

    @property
    def rim(self) -> tuple[Pixel, ...]:
        """What was clicked on the rim."""
        return tuple(click.pixel for click in self.clicks if click.part == RIM)

    @property
    def points(self) -> tuple[Pixel, ...]:
        """What was clicked on the sphere."""
        return tuple(click.pixel for click in self.clicks if click.part == ON)

    @property
    def is_enough(self) -> bool:
        """Whether a shape can be recovered from the points."""
        return not self.guessed and len(self.points) >= ENOUGH

    def want(self, wanted: Part | None) -> "Pointed":
        """Begin to ask for a part of the sphere, or for none."""
        after = ON if wanted == ON else None
        picking = None if wanted is None else RIM if self.guessed else after
        return replace(self, wanted=wanted, picking=picking, refused="")

    def set(self, outline: Sphere) -> "Pointed":
        """Take an outline that is known."""
        return replace(self, outline=outline, guessed=False, refused="")

    def keep(self) -> "Pointed":
        """Take the guess for the outline, and go on."""
        return replace(self, guessed=False, refused="").go_on()

    def go_on(self) -> "Pointed":
        """From the outline to what comes next."""
        return replace(self, picking=ON) if self.wanted == ON else self

    def pick(self, part: Part | None) -> "Pointed":
        """Take clicks for a part; points come after the outline."""
        if part == ON and self.wanted == RIM:
            return replace(self, refused=WHOLE)
        if part == ON and self.guessed:
            return replace(self, picking=RIM, refused=FIRST)
        return replace(self, picking=part, refused="")

    def click(self, pixel: Pixel, result: Analysis | None) -> "Pointed":
        """Take a click, or say why not; the third on the rim sets the outline.

        Args:
            result: where points need linearized values.
        """
        assert self.picking is not None
        if fault := self._fault(pixel, result):
            return replace(self, refused=fault)
        click = Click(self.picking, pixel, self.outline, self.guessed)
        taken = replace(self, clicks=(*self.clicks, click), refused="")
        return taken._fit() if self.picking == RIM else taken

    def undo(self) -> "Pointed":
        """Forget the last click."""
        if not self.clicks:
            return replace(self, refused="")
        *others, last = self.clicks
        earlier = replace(self, clicks=tuple(others), picking=last.part, refused="")
        if last.part == ON:
            return earlier
        return replace(earlier, outline=last.before, guessed=last.guessed)

    def _fit(self) -> "Pointed":
        try:
            (row, column), radius = fit_circle(*np.array(self.rim, float).T)
        except PhotolinError:
            return replace(self, refused=LINE if len(self.rim) >= THREE else "")
        fitted = self.set((round(row, 1), round(column, 1), round(radius, 1)))
        return fitted.go_on() if self.guessed else fitted

    def _fault(self, pixel: Pixel, result: Analysis | None) -> str:
        """Why a click cannot be taken, or nothing."""
        where = f"Row {pixel[0]}, column {pixel[1]}"
        if pixel in (self.rim if self.picking == RIM else self.points):
            return f"{where} was clicked before."
        if self.picking == RIM:
            return ""
        row, column, radius = self.outline
        if np.hypot(pixel[0] - row, pixel[1] - column) >= radius:
            return f"{where} is outside the outline. Click inside it, or correct the outline."
        if result is None:
            return ""
        value = result.linearized_bases[:, pixel[0], pixel[1]]
        lit = bool(np.isfinite(value).all() and value.any())
        return "" if lit else f"{where} has no value: it is masked, or lit in too few images."

    def steps(self, *, flat: bool) -> list[tuple[str, bool]]:
        """Sentences on what to do, and whether each is to be done now.

        Args:
            flat: whether the picture is flat, as it is to be for clicks.
        """
        count, picking = len(self.points), self.picking if flat else None
        first = f"1. Click the rim of the sphere three times: {len(self.rim)} of {THREE}."
        if not self.guessed:
            first = "1. The outline is set; press outline to correct it."
            if picking == RIM:
                first = "1. The outline is set. More clicks on the rim correct it."
        second = "2. Press Recover shape."
        if self.wanted == ON:
            second = f"2. Click five points on it, spread wide: {count} of {ENOUGH}."
            if count >= ENOUGH:
                second = f"2. {count} points clicked. Each further one recovers the shape again."
        done = self.wanted == RIM and not self.guessed
        lines = [(first, picking == RIM), (second, picking == ON or done)]
        if self.guessed:
            lines.append(("The dashed outline is a guess from the mask.", False))
        if not flat:
            lines.append(("In 3D clicks select pixels.", False))
        elif picking is None:
            lines.append(("Clicks on the picture select pixels.", False))
        return lines
