"""The surface as it is sent to the page: where its points lie, what a ray from the page meets."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from photolin.shape.recover import Shape
from photolin.shape.resolved import Resolved
from webapp.relief import ARROW_SHOWN, ARROWS, FAINT, FULL, MESH, Relief

H, W, WORLD = 20, 30, 10.0
PIXEL = WORLD / H


@dataclass
class FakeScene:
    """What is in the scene, by name."""

    nodes: dict[str, tuple[Any, ...]] = field(default_factory=dict)

    def remove_by_name(self, name: str) -> None:
        self.nodes.pop(name, None)

    def add_mesh_simple(self, name: str, *parts: Any, **_: Any) -> None:
        assert name not in self.nodes
        self.nodes[name] = parts

    def add_arrows(self, name: str, *parts: Any, **_: Any) -> None:
        assert name not in self.nodes
        self.nodes[name] = parts


@dataclass
class FakeClient:
    scene: FakeScene = field(default_factory=FakeScene)


def make_shape(depth: np.ndarray | None, lights: np.ndarray | None = None) -> Shape:
    flat = np.zeros((H, W, 3), np.float32)
    flat[..., 2] = 1
    given = np.eye(3) if lights is None else lights
    resolved = Resolved(np.eye(3), "lights", 0.0, True, "by lights")
    return Shape(flat, np.ones((H, W), np.float32), depth, given, resolved)


def tilted() -> np.ndarray:
    rows, columns = np.mgrid[:H, :W]
    depth = (0.5 * columns - 0.25 * rows).astype(np.float32)
    depth[3:6, 4:8] = np.nan
    return depth


@pytest.fixture
def client() -> FakeClient:
    return FakeClient()


@pytest.fixture
def relief(client: FakeClient) -> Relief:
    return Relief(client, H, W, WORLD)  # type: ignore[arg-type]


def test_each_vertex_lies_over_its_pixel_of_the_picture_nearer_where_it_is_higher(
    client: FakeClient, relief: Relief
) -> None:
    depth = tilted()
    relief.set(make_shape(depth))
    vertices, faces = client.scene.nodes[MESH]
    columns = vertices[:, 0] / PIXEL + W / 2 - 0.5
    rows = vertices[:, 1] / PIXEL + H / 2 - 0.5
    assert columns == pytest.approx(np.rint(columns), abs=1e-4)
    assert rows == pytest.approx(np.rint(rows), abs=1e-4)
    at = np.rint(rows).astype(int), np.rint(columns).astype(int)
    assert -vertices[:, 2] / PIXEL == pytest.approx(depth[at], abs=1e-4)
    assert len(vertices) == np.isfinite(depth).sum()
    assert faces.max() == len(vertices) - 1


def test_a_ray_of_the_page_meets_the_surface_that_was_set_last(relief: Relief) -> None:
    ray = "ray 10.500000,12.500000,90.000000,0.000000,0.000000,-1.000000"
    assert relief.pixel_on(ray) is None
    relief.set(make_shape(tilted()))
    assert relief.pixel_on(ray) == (12, 10)
    assert relief.pixel_on("12,10") is None
    assert relief.pixel_on("ray of light") is None
    assert relief.height((12, 10)) == 2.0
    assert relief.height((4, 5)) is None
    relief.set(None)
    assert relief.pixel_on(ray) is None
    assert relief.height((12, 10)) is None


def test_another_surface_takes_the_place_of_the_earlier(client: FakeClient, relief: Relief) -> None:
    relief.set(make_shape(tilted()))
    relief.set(make_shape(np.zeros((H, W), np.float32)))
    assert not client.scene.nodes[MESH][0][:, 2].any()
    relief.set(None)
    assert client.scene.nodes == {}


def single() -> np.ndarray:
    depth = np.full((H, W), np.nan, np.float32)
    depth[4, 4] = depth[9, 20] = 1
    return depth


@pytest.mark.parametrize("depth", [None, np.full((H, W), np.nan, np.float32), single()])
def test_without_a_surface_there_is_no_mesh_and_nothing_to_click(
    client: FakeClient, relief: Relief, depth: np.ndarray | None
) -> None:
    relief.set(make_shape(tilted()))
    relief.set(make_shape(depth))
    assert client.scene.nodes == {}
    assert relief.height((4, 4)) is None
    assert relief.pixel_on("ray 4.5,4.5,90.0,0.0,0.0,-1.0") is None


def test_arrows_come_from_the_lights_and_point_to_the_middle(
    client: FakeClient, relief: Relief
) -> None:
    lights = np.array([[0, 0, 2.0], [3, 0, 0.01], [0, 0.5, 0.5]])
    relief.set_arrows(make_shape(None, lights), 1)
    towards = lights / np.linalg.norm(lights, axis=1, keepdims=True) * [1, -1, -1]
    diagonal = float(np.hypot(H, W)) * PIXEL
    for name, numbers, look in ((ARROWS, [0, 2], FAINT), (ARROW_SHOWN, [1], FULL)):
        points, colours = client.scene.nodes[name]
        tails, heads = points[:, 0], points[:, 1]
        for ends in (tails, heads):
            lengths = np.linalg.norm(ends, axis=1)
            assert ends / lengths[:, None] == pytest.approx(towards[numbers], abs=1e-6)
        lengths = np.linalg.norm(tails, axis=1) - np.linalg.norm(heads, axis=1)
        assert lengths == pytest.approx(look.long * diagonal, rel=1e-4)
        assert colours.tolist() == [list(look.colour)] * len(numbers)
    relief.set_arrows(make_shape(None, lights), 2)
    (shown,) = client.scene.nodes[ARROW_SHOWN][0]
    assert shown[1] / np.linalg.norm(shown[1]) == pytest.approx(towards[2], abs=1e-6)
    relief.set_arrows(None, 0)
    assert client.scene.nodes == {}
