"""Painting: every part once for each change, lossless in the end, in the order asked for."""

import io
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from photolin.analysis import Options
from photolin.factors import PALETTE, Factor
from photolin.follow import follow_thresholds, prepare_ground
from photolin.load.exclude import exclude_images
from photolin.overview import count_classes
from photolin.pipeline import analyze
from photolin.shape.recover import Shape, recover_shape
from photolin.shape.resolve import resolve_ambiguity
from photolin.stack import ImageStack
from photolin.synthetic import render_scene
from webapp import painter as module
from webapp.frame import Frame, Recovered, compose
from webapp.live import Part, Preview, cut
from webapp.often import render_often
from webapp.painter import Painter, describe, render_layer
from webapp.render import choose_scale, render_residual
from webapp.runs import Runs
from webapp.state import ViewState

STACK = render_scene("sphere_cone", size=(24, 32), images=8).stack
RESULT = analyze(STACK, Options(T=0.05, Ts=0.02, samples=50))
RECOVERED = Recovered(recover_shape(STACK, RESULT, resolve_ambiguity(RESULT)), RESULT)


@dataclass
class FakeSecond:
    """Remembers what it was told of the second picture."""

    calls: list[tuple[str, Any]]

    def set_base(self, encoded: bytes, image_format: str) -> None:
        self.calls.append((f"other {image_format}", decode(encoded)))

    def set_overlay(self, encoded: bytes | None) -> None:
        self.calls.append(("other overlay", None if encoded is None else decode(encoded)))

    def arrange(self, arrangement: str | None, divider: float) -> None:
        self.calls.append(("arrangement", (arrangement, divider)))


@dataclass
class FakeCanvas:
    """Remembers what it was told."""

    calls: list[tuple[str, Any]] = field(default_factory=list)
    readout: str = ""

    @property
    def second(self) -> FakeSecond:
        return FakeSecond(self.calls)

    def set_base(self, encoded: bytes, image_format: str) -> None:
        self.calls.append((f"base {image_format}", decode(encoded)))

    def set_overlay(self, encoded: bytes | None) -> None:
        self.calls.append(("overlay", None if encoded is None else decode(encoded)))

    def set_marker(self, pixel: tuple[int, int] | None) -> None:
        self.calls.append(("marker", pixel))

    def set_pins(self, pins: object) -> None:
        self.calls.append(("pins", pins))

    def set_surface(self, shape: Shape | None) -> None:
        self.calls.append(("surface", shape))

    def set_orbit(self, on: bool) -> None:
        self.calls.append(("orbit", on))

    def set_arrows(self, shape: Shape | None, chosen: int) -> None:
        self.calls.append(("arrows", (shape, chosen)))

    def set_light(self, light: tuple[float, float] | None) -> None:
        self.calls.append(("light", light))

    def set_readout(self, text: str) -> None:
        self.readout = text

    def take(self) -> dict[str, Any]:
        """What was drawn since the last look, by part; no part twice."""
        calls = list(self.calls)
        self.calls.clear()
        assert len({name for name, _ in calls}) == len(calls)
        return dict(calls)


def decode(encoded: bytes) -> np.ndarray:
    image = Image.open(io.BytesIO(encoded))
    return np.asarray(image.convert("RGBA") if image.mode == "P" else image)


def frame(stack: ImageStack = STACK, solved: bool = True, **state: Any) -> Frame:
    return compose(
        Runs(stack, Options()),
        {"robust": RESULT} if solved else {},
        ViewState(T=0.05, Ts=0.02, **state),
    )


@pytest.fixture
def canvas() -> FakeCanvas:
    return FakeCanvas()


@pytest.fixture
def painter(canvas: FakeCanvas) -> Painter:
    return Painter(canvas)  # type: ignore[arg-type]


def test_the_first_frame_draws_everything_and_the_same_again_nothing(
    painter: Painter, canvas: FakeCanvas
) -> None:
    assert painter.paint(frame(), None, rested=False) is False
    assert set(canvas.take()) == {"base png", "overlay", "marker"}
    assert painter.paint(frame(), None, rested=True) is False
    assert canvas.take() == {}


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ({"image": 3}, {"base png", "overlay"}),
        ({"T": 0.01}, {"overlay"}),
        ({"Ts": 0.2}, {"overlay"}),
        ({"opacity": 0.3}, {"overlay"}),
        ({"outlines": True}, {"overlay"}),
        ({"shown": frozenset({Factor.CAST})}, {"overlay"}),
        ({"layer": "labels"}, {"base png", "overlay"}),
        ({"layer": "how often"}, {"base png", "overlay"}),
        ({"often": "lit"}, set()),
        ({"layer": "residual"}, {"base png", "overlay"}),
        ({"layer": "residual", "outlines": True}, {"base png", "overlay"}),
        ({"gain": 2.0}, {"base png"}),
        ({"pixel": (3, 4)}, {"marker"}),
        ({"beside": "statistical"}, set()),
    ],
)
def test_a_change_draws_the_parts_it_concerns(
    painter: Painter, canvas: FakeCanvas, change: dict[str, Any], parts: set[str]
) -> None:
    first = frame()
    painter.paint(first, None, rested=False)
    canvas.take()
    state = replace(first.state, **change)
    painter.paint(compose(Runs(STACK, Options()), {"robust": RESULT}, state), None, rested=False)
    assert set(canvas.take()) == parts


def test_a_new_result_is_drawn_though_nothing_else_changed(
    painter: Painter, canvas: FakeCanvas
) -> None:
    painter.paint(frame(solved=False), None, rested=False)
    assert canvas.take()["overlay"] is None
    painter.paint(frame(), None, rested=False)
    assert canvas.take()["overlay"] is not None
    other = replace(RESULT, coefficients=RESULT.coefficients[::-1].copy())
    painter.paint(
        compose(Runs(STACK, Options()), {"robust": other}, frame().state), None, rested=False
    )
    assert "overlay" in canvas.take()


def test_the_label_layer_has_exactly_the_colours_of_the_labels(
    painter: Painter, canvas: FakeCanvas
) -> None:
    shown = frame(layer="labels", opacity=0.2, image=5)
    painter.paint(shown, None, rested=False)
    overlay = canvas.take()["overlay"]
    colours = np.zeros((256, 3), np.uint8)
    for factor, colour in PALETTE.items():
        colours[factor] = colour
    assert (overlay[..., 3] == 255).all()
    assert np.array_equal(overlay[..., :3], colours[shown.labels])


@pytest.mark.parametrize("layer", ["linearized", "residual"])
def test_a_signed_picture_hides_the_labels_and_says_so_until_outlines_are_asked_for(
    painter: Painter, canvas: FakeCanvas, layer: str
) -> None:
    painter.paint(frame(layer=layer), None, rested=False)
    assert canvas.take()["overlay"] is None
    assert canvas.readout.endswith("; labels hidden here, outlines show them")
    painter.paint(frame(layer=layer, outlines=True), None, rested=False)
    drawn = canvas.take()
    assert set(drawn) == {"overlay"}
    assert 0 < np.count_nonzero(drawn["overlay"][..., 3]) < 0.5 * STACK.mask.size
    assert "hidden" not in canvas.readout
    painter.paint(frame(), None, rested=False)
    assert np.count_nonzero(canvas.take()["overlay"][..., 3]) == STACK.mask.size
    assert "hidden" not in canvas.readout


def test_a_large_picture_goes_out_rough_at_first_and_exact_once_at_rest(
    painter: Painter, canvas: FakeCanvas, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "LARGE", 100)
    assert painter.paint(frame(), None, rested=False) is True
    assert "base jpeg" in canvas.take()
    assert painter.paint(frame(), (2, 3), rested=False) is True
    assert canvas.take() == {}
    assert painter.paint(frame(), None, rested=True) is False
    exact = canvas.take()
    assert set(exact) == {"base png"}
    assert np.array_equal(exact["base png"], render_layer(frame())[0])
    assert painter.paint(frame(), None, rested=True) is False
    assert canvas.take() == {}
    assert painter.paint(frame(image=1), None, rested=False) is True
    assert painter.paint(frame(image=0), None, rested=False) is True


def test_the_readout_says_the_scale_or_the_pixel_under_the_pointer(
    painter: Painter, canvas: FakeCanvas
) -> None:
    painter.paint(frame(gain=2.5), None, rested=False)
    assert canvas.readout == "input, shown 2.5 times brighter"
    painter.paint(frame(layer="linearized"), None, rested=False)
    assert canvas.readout.startswith("linearized, black -")
    assert "of full scale, zero mid-grey" in canvas.readout
    painter.paint(frame(layer="linearized"), (2, 3), rested=False)
    assert canvas.readout.startswith("row 2  column 3  i ")
    painter.paint(frame(layer="linearized"), None, rested=False)
    assert canvas.readout.startswith("linearized, black -")


def test_layers_show_zero_as_mid_grey_or_white() -> None:
    linearized, text = render_layer(frame(layer="linearized"))
    zero = RESULT.linearized(0) == 0
    assert np.array_equal(linearized[zero], np.full(zero.sum(), 128))
    assert ((linearized < 128) <= (RESULT.linearized(0) < 0)).all()
    assert "zero mid-grey" in text
    residual, text = render_layer(frame(layer="residual"))
    excess = STACK.images[0] - RESULT.linearized(0)
    scale = choose_scale(excess, STACK.mask)
    expected = render_residual(excess, scale)
    assert np.array_equal(residual, expected)
    assert (render_residual(np.zeros((1, 1), np.float32), scale) == 255).all()
    assert "zero white" in text


def test_layers_that_need_a_result_show_the_input_until_there_is_one() -> None:
    shown = [render_layer(frame(solved=False, layer=layer))[0] for layer in ("input", "residual")]
    assert np.array_equal(*shown)
    assert describe(frame(solved=False), (1, 2)).startswith("row 1  column 2  i ")


def test_the_pointer_outside_the_mask_reads_the_input_alone() -> None:
    mask = np.ones(STACK.mask.shape, bool)
    mask[0] = False
    stack = replace(STACK, mask=mask)
    assert describe(frame(stack), (0, 5)).endswith("outside the mask")


def test_an_image_gone_back_to_is_not_encoded_again(monkeypatch: pytest.MonkeyPatch) -> None:
    encoded: list[int] = []
    encode = module.encode_png
    monkeypatch.setattr(module, "encode_png", lambda p: (encoded.append(1), encode(p))[1])
    canvas = FakeCanvas()
    painter = Painter(canvas)  # pyright: ignore[reportArgumentType]
    first = None
    for image in (0, 1, 0, 1, 2, 0):
        painter.paint(frame(image=image), None, rested=False)
        base = canvas.take()["base png"]
        first = base if first is None else first
        assert np.array_equal(base, render_layer(frame(image=image))[0])
    assert len(encoded) == 3
    for image in range(3):  # signed pictures belong to a result, which must not be kept alive
        painter.paint(frame(image=image, layer="residual"), None, rested=False)
    assert len(painter._encoded) == 3


@pytest.mark.parametrize(
    ("encoding", "rested", "sent"),
    [
        ("quick, then exact", False, "base jpeg"),
        ("quick, then exact", True, "base png"),
        ("exact (PNG)", False, "base png"),
        ("quick (JPEG)", True, "base jpeg"),
    ],
)
def test_a_large_picture_is_sent_as_chosen(
    monkeypatch: pytest.MonkeyPatch, encoding: str, rested: bool, sent: str
) -> None:
    monkeypatch.setattr(module, "LARGE", 10)
    canvas = FakeCanvas()
    painter = Painter(canvas)  # pyright: ignore[reportArgumentType]
    rough = painter.paint(frame(encoding=encoding), None, rested=rested)
    assert sent in canvas.take()
    assert rough == (encoding == "quick, then exact" and not rested)


def test_the_surface_is_sent_once_it_is_turned_and_only_then(
    painter: Painter, canvas: FakeCanvas
) -> None:
    def draw(**state: Any) -> dict[str, Any]:
        shown = ViewState(T=0.05, Ts=0.02, **state)
        composed = compose(Runs(STACK, Options()), {"robust": RESULT}, shown, None, RECOVERED)
        painter.paint(composed, None, rested=True)
        return canvas.take()

    assert "surface" not in draw()
    turned = draw(relief=True)
    assert turned["surface"] is RECOVERED.shape
    assert turned["orbit"] is True
    assert turned["arrows"] == (RECOVERED.shape, 0)
    assert draw(relief=True) == {}
    assert draw(relief=True, image=3)["arrows"] == (RECOVERED.shape, 3)
    assert set(draw(relief=True, image=3, arrows=False)) == {"arrows"}
    assert set(draw(relief=True, image=3, arrows=False)) == set()
    flat = draw(image=3)
    assert flat == {"orbit": False}
    lit = draw(image=3, layer="relit", light=(0.1, 0.2))
    assert set(lit) == {"base png", "overlay", "light"}
    assert lit["light"] == (0.1, 0.2)
    assert set(draw(image=3, layer="relit", light=(0.3, 0.2))) == {"base png", "light"}


def test_without_a_shape_nothing_is_turned_and_no_light_is_offered(
    painter: Painter, canvas: FakeCanvas
) -> None:
    painter.paint(frame(relief=True, layer="relit"), None, rested=False)
    assert not {"surface", "orbit", "arrows", "light"} & set(canvas.take())


def test_captions_of_a_shape_say_nothing_of_labels(painter: Painter, canvas: FakeCanvas) -> None:
    shown = ViewState(T=0.05, Ts=0.02, layer="normals")
    painter.paint(
        compose(Runs(STACK, Options()), {"robust": RESULT}, shown, None, RECOVERED),
        None,
        rested=True,
    )
    assert canvas.readout.startswith("normals: red x right")
    assert "labels" not in canvas.readout


BOTH = {"against": "residual", "layer": "input"}


def test_a_second_picture_is_drawn_once_and_the_line_costs_no_picture(
    painter: Painter, canvas: FakeCanvas
) -> None:
    painter.paint(frame(), None, rested=True)
    first = canvas.take()
    painter.paint(frame(**BOTH), None, rested=True)
    drawn = canvas.take()
    assert set(drawn) == {"other png", "other overlay", "arrangement"}
    assert drawn["arrangement"] == ("split", 0.5)
    assert np.array_equal(drawn["other png"], render_layer(frame(layer="residual"))[0])
    assert drawn["other overlay"] is None
    assert canvas.readout.startswith("left: robust, input\nright: robust, residual, blue -")
    for state in ({"divider": 0.2}, {"arrangement": "side by side"}, {"arrangement": "left"}):
        painter.paint(frame(**BOTH, **state), None, rested=True)
        assert set(canvas.take()) == {"arrangement"}
    assert canvas.readout == "left: robust, input"
    painter.paint(frame(), None, rested=True)
    assert canvas.take() == {"arrangement": (None, 0.0)}
    assert set(first) == {"base png", "overlay", "marker"}


def test_a_difference_is_one_picture_without_labels(painter: Painter, canvas: FakeCanvas) -> None:
    state = {"layer": "input", "against": "linearized", "arrangement": "difference"}
    painter.paint(frame(**state), None, rested=True)
    drawn = canvas.take()
    assert set(drawn) == {"base png", "overlay", "marker"}
    residual, _ = render_layer(frame(layer="residual"))
    assert np.array_equal(drawn["base png"], residual)
    assert drawn["overlay"] is None
    assert canvas.readout.startswith("left minus right, blue -")
    painter.paint(frame(), None, rested=True)
    again = canvas.take()
    assert np.array_equal(again["base png"], render_layer(frame())[0])
    assert again["overlay"] is not None


def test_true_labels_take_the_place_of_computed_ones_and_the_pointer_reads_both(
    painter: Painter, canvas: FakeCanvas
) -> None:
    truth = np.full(STACK.shape, Factor.CAST, np.uint8)
    runs = Runs(STACK, Options(), truth=truth)

    def draw(**state: Any) -> dict[str, Any]:
        shown = ViewState(T=0.05, Ts=0.02, **state)
        painter.paint(compose(runs, {"robust": RESULT}, shown), (3, 4), rested=True)
        return canvas.take()

    assert len(np.unique(draw(against="labels")["other overlay"][..., :3], axis=0)) > 1
    drawn = draw(against="truth")["other overlay"]
    assert (drawn == (*PALETTE[Factor.CAST], 255)).all()
    assert canvas.readout.startswith("left:  row 3  column 4  i ")
    assert canvas.readout.endswith("\nright: truth C")
    draw(against="residual")
    left, right = canvas.readout.split("\n")
    assert left.removeprefix("left:  ") == right.removeprefix("right: ")


def test_true_labels_are_drawn_anew_when_another_image_takes_the_number_of_one_left_out(
    painter: Painter, canvas: FakeCanvas
) -> None:
    truth = np.arange(8, dtype=np.uint8)[:, None, None] % 5 + np.zeros(STACK.shape, np.uint8)
    state = ViewState(image=3, T=0.05, Ts=0.02, against="truth")
    painter.paint(compose(Runs(STACK, Options(), truth=truth), {}, state), None, rested=True)
    assert (canvas.take()["other overlay"] == (*PALETTE[Factor(3)], 255)).all()
    runs = Runs(exclude_images(STACK, [3]), Options(), excluded=(3,), truth=np.delete(truth, 3, 0))
    painter.paint(compose(runs, {}, state), None, rested=True)
    assert (canvas.take()["other overlay"] == (*PALETTE[Factor(4)], 255)).all()


def test_on_the_surface_both_are_one_picture(painter: Painter, canvas: FakeCanvas) -> None:
    shown = ViewState(T=0.05, Ts=0.02, relief=True, against="linearized", divider=0.5)
    composed = compose(Runs(STACK, Options()), {"robust": RESULT}, shown, None, RECOVERED)
    painter.paint(composed, None, rested=True)
    drawn = canvas.take()
    assert not {"arrangement", "other png"} & set(drawn)
    right = render_layer(frame(layer="linearized"))[0]
    assert np.array_equal(drawn["base png"][:, 16:, 0], right[:, 16:])


def test_a_rough_second_picture_is_made_exact_too(
    painter: Painter, canvas: FakeCanvas, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "LARGE", 100)
    assert painter.paint(frame(**BOTH), None, rested=False) is True
    assert {"base jpeg", "other jpeg"} <= set(canvas.take())
    assert painter.paint(frame(**BOTH), None, rested=True) is False
    assert set(canvas.take()) == {"base png", "other png"}


def test_before_there_is_a_result_the_truth_alone_has_labels(
    painter: Painter, canvas: FakeCanvas
) -> None:
    runs = Runs(STACK, Options(), truth=np.full(STACK.shape, Factor.CAST, np.uint8))

    def draw(against: Any, pointer: tuple[int, int] | None) -> dict[str, Any]:
        shown = ViewState(T=0.05, Ts=0.02, against=against)
        painter.paint(compose(runs, {}, shown), pointer, rested=True)
        return canvas.take()

    assert draw("labels", (3, 4))["other overlay"] is None
    assert canvas.readout == f"row 3  column 4  i {STACK.images[0, 3, 4]:.3f}"
    draw("labels", None)
    assert canvas.readout == "left: robust, input\nright: robust, labels"
    assert (draw("truth", None)["other overlay"] == (*PALETTE[Factor.CAST], 255)).all()
    assert canvas.readout == "left: robust, input\nright: truth"


def test_how_often_is_of_all_images_and_drawn_once_whichever_is_shown(
    painter: Painter, canvas: FakeCanvas
) -> None:
    shown = frame(layer="how often", often="any shadow")
    counts = count_classes(RESULT.labels, Factor.ATTACHED, Factor.CAST)
    painter.paint(shown, None, rested=True)
    assert np.array_equal(
        canvas.take()["base png"], render_often(counts, len(STACK.images), STACK.mask)
    )
    most = counts.max()
    assert canvas.readout == (
        "any shadow in none (dark purple), a quarter (teal), all (yellow) of 8 images, "
        f"at most {most} here"
    )
    row, column = np.argwhere(counts == most)[0].tolist()
    painter.paint(frame(layer="how often", often="any shadow", image=3), (row, column), rested=True)
    assert set(canvas.take()) <= {"overlay"}
    assert canvas.readout == f"row {row}  column {column}  any shadow in {most} of 8 images"
    painter.paint(frame(layer="how often", often="lit", image=3), None, rested=True)
    assert "base png" in canvas.take()
    assert painter._encoded == {}  # it belongs to a result, which must not be kept alive
    mask = STACK.mask.copy()
    mask[0] = False
    words = describe(frame(replace(STACK, mask=mask), layer="how often"), (0, 5))
    assert words == "row 0  column 5  outside the mask"


def test_how_often_shows_the_image_itself_until_there_is_a_result(
    painter: Painter, canvas: FakeCanvas
) -> None:
    for image in (0, 3):
        painter.paint(frame(solved=False, layer="how often", image=image), None, rested=True)
        expected = render_layer(frame(image=image))[0]
        assert np.array_equal(canvas.take()["base png"], expected)


def test_how_often_is_compared_by_both_methods(painter: Painter, canvas: FakeCanvas) -> None:
    other = analyze(STACK, Options(method="statistical", T=0.05, Ts=0.02, samples=50))
    state = ViewState(
        T=0.05, Ts=0.02, layer="how often", against="how often", beside="statistical", divider=0
    )
    results = {"robust": RESULT, "statistical": other}
    painter.paint(compose(Runs(STACK, Options()), results, state), None, rested=True)  # pyright: ignore
    expected = render_often(
        count_classes(other.labels, Factor.SPECULAR), len(STACK.images), STACK.mask
    )
    assert np.array_equal(canvas.take()["other png"], expected)


def test_only_what_shows_the_input_is_called_brighter() -> None:
    assert render_layer(frame(gain=2.0))[1] == "input, shown 2 times brighter"
    assert render_layer(frame(gain=2.0, layer="labels"))[1] == "labels"


def test_how_often_is_drawn_anew_where_the_preview_looks_at_another_part(
    painter: Painter, canvas: FakeCanvas
) -> None:
    state = ViewState(T=0.2, Ts=0.05, layer="how often", often="lit")
    runs, ground, shown = Runs(STACK, Options()), prepare_ground(STACK), []
    for part in (Part(0, 12, 0, 32, 2), Part(12, 24, 0, 32, 2)):
        own = follow_thresholds(*cut(STACK, part), ground, RESULT, state.thresholds)
        composed = compose(runs, {"robust": RESULT}, state, Preview(own, part, RESULT))
        painter.paint(composed, None, rested=True)
        assert composed.often is not None
        shown.append(canvas.take()["base png"])
        assert np.array_equal(
            shown[-1], render_often(composed.often, len(STACK.images), STACK.mask)
        )
    assert not np.array_equal(*shown)
