"""What a first visitor is told on the picture: what colours mean, what to move, what to click."""

from photolin.factors import LETTERS, TITLES, css_colour

HINT: tuple[tuple[str, str | None], ...] = (
    ("Colours tell what each pixel shows: ", None),
    *((TITLES[factor], css_colour(factor)) for factor in LETTERS),
    (". Move T and Ts, on the right, until the colours look right. Click a pixel to see why it has "
     "its colour.", None),
)  # fmt: skip
"""Texts in reading order, each with its colour (CSS) where it names a class, else None."""
