"""What one tab shows: scalars only, so that two states can be compared and kept for undo."""

from dataclasses import dataclass
from typing import Literal, get_args

from photolin.analysis import METHODS, Method
from photolin.errors import OptionError
from photolin.factors import Factor, Thresholds

Layer = Literal[
    "input",
    "linearized",
    "residual",
    "labels",
    "how often",
    "albedo",
    "normals",
    "depth",
    "relit",
]
LAYERS: tuple[Layer, ...] = get_args(Layer)
SURFACE: tuple[Layer, ...] = ("albedo", "normals", "depth", "relit")
"""Layers that are there once a shape is."""
Against = Layer | Literal["truth"]
TRUTH = "truth"
"""The label map of the truth, where it is known."""
AGAINST: tuple[Against, ...] = (*LAYERS, TRUTH)
Arrangement = Literal["split", "side by side", "difference", "left", "right"]
ARRANGEMENTS: tuple[Arrangement, ...] = get_args(Arrangement)
Often = Literal["specular", "lit", "attached shadow", "cast shadow", "any shadow", "undefined"]
OFTEN: tuple[Often, ...] = get_args(Often)
Encoding = Literal["quick, then exact", "exact (PNG)", "quick (JPEG)"]
ENCODINGS: tuple[Encoding, ...] = get_args(Encoding)
Theme = Literal["dark", "light"]
THEMES: tuple[Theme, ...] = get_args(Theme)
CHOICES: dict[str, tuple[str, ...]] = {
    "layer": LAYERS,
    "often": OFTEN,
    "method": METHODS,
    "beside": METHODS,
    "encoding": ENCODINGS,
    "against": AGAINST,
    "arrangement": ARRANGEMENTS,
    "theme": THEMES,
}
"""Fields of a state that are one of some words, and the words."""

Pixel = tuple[int, int]
"""(row, column)"""
MOST_PINS = 4


@dataclass(frozen=True)
class ViewState:
    """One view of a stack and its results; a change makes a new one (`dataclasses.replace`)."""

    image: int = 0
    """Image number, from 0."""
    layer: Layer = "input"
    """The picture under the overlay; labels: the label map alone, opaque; how often: in how many
    images a pixel is what `often` says."""
    often: Often = "specular"
    """What the layer how often counts; lit: diffuse or specular."""
    method: Method = "robust"
    """Whose result is shown."""
    beside: Method | None = None
    """Whose result it is compared with: for the selected pixel (Fig. 9), and in the picture."""
    T: float = 0.05
    """Relative tolerance of i = l, unitless, in (0, 1]."""
    Ts: float = 0.02
    """Shadow level, fraction of full scale, in [0, 1)."""
    live: bool = True
    """Linearize again while T or Ts move, where the method is quick enough."""
    opacity: float = 0.55
    """Of the overlay, in [0, 1]."""
    shown: frozenset[Factor] = frozenset(Factor)
    """Classes drawn in the overlay."""
    outlines: bool = False
    """Draw the borders of the classes in place of their areas."""
    patterns: bool = False
    """Mark the classes by patterns too, for eyes that do not tell their colours apart."""
    theme: Theme = "dark"
    """What everything is shown on."""
    against: Against | None = None
    """The layer, by the method beside where one is, or the truth, that is the right picture."""
    arrangement: Arrangement = "split"
    """How the left picture, of `layer` and `method`, and the right one are shown; the last two
    show one of them alone."""
    divider: float = 0.5
    """Share of the width at which the right picture begins when split, 0 to 1."""
    relief: bool = False
    """Lay the picture on the surface, and turn around it."""
    arrows: bool = True
    """Draw the lights beside the surface."""
    light: tuple[float, float] = (-0.4, 0.5)
    """x (right) and y (up) of the unit direction of the light of the layer relit."""
    pixel: Pixel | None = None
    """(row, column) of the selected pixel."""
    pins: tuple[Pixel, ...] = ()
    """(row, column) of up to MOST_PINS pixels that are compared with the selected one."""
    gain: float | None = None
    """Display factor of input images, above 0; None means chosen from the stack."""
    encoding: Encoding = ENCODINGS[0]
    """How the picture under the overlay is sent; small ones are exact unless JPEG is asked for."""

    def __post_init__(self) -> None:
        Thresholds(self.T, self.Ts)
        if self.image < 0:
            raise OptionError(f"image is {self.image}; accepted is a number from 0")
        for name, accepted in CHOICES.items():
            value = getattr(self, name)
            if value is None and name in ("beside", "against"):
                continue
            if value not in accepted:
                listed = ("; " if "," in "".join(accepted) else ", ").join(accepted)
                raise OptionError(f"{name} is {value!r}; accepted are {listed}")
        if not self.light[0] ** 2 + self.light[1] ** 2 < 1:
            raise OptionError(
                f"light is {self.light}; accepted are x and y of a direction towards the camera's "
                "side, of length below 1"
            )
        if not 0 <= self.divider <= 1:
            raise OptionError(f"divider is {self.divider:g}; accepted is 0 to 1")
        if len(self.pins) > MOST_PINS or len(set(self.pins)) < len(self.pins):
            raise OptionError(f"pins are {self.pins}; accepted are {MOST_PINS} different pixels")
        if not 0 <= self.opacity <= 1:
            raise OptionError(f"opacity is {self.opacity:g}; accepted is 0 to 1")
        if self.gain is not None and not 0 < self.gain < float("inf"):
            raise OptionError(f"gain is {self.gain:g}; accepted is a number above 0")

    @property
    def thresholds(self) -> Thresholds:
        """T and Ts as the backend takes them."""
        return Thresholds(self.T, self.Ts)
