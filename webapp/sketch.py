"""What was pointed out of a sphere, to be drawn on the picture. Pure."""

from dataclasses import dataclass

from photolin.shape.known import Sphere

from .state import Pixel


@dataclass(frozen=True)
class Sketch:
    """A sphere's outline, and the pixels that were clicked on it."""

    circle: Sphere
    """Row and column of its centre and its radius, pixels; whole at pixel centres."""
    guessed: bool
    """Whether nobody has said so yet."""
    rim: tuple[Pixel, ...] = ()
    """Clicked on the outline."""
    points: tuple[Pixel, ...] = ()
    """Clicked on the sphere."""
