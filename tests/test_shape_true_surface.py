"""True surfaces: of a scene with named objects, of a benchmark folder, and of damaged files."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from photolin.errors import InputError
from photolin.shape.true_surface import is_benchmark, read_benchmark, surface_of
from photolin.synthetic import load_truth, render_scene, write_scene

SHARED = Path(__file__).parents[2] / "shared" / "data"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    folder = tmp_path / "scene"
    write_scene(render_scene("sphere_obstacles", size=(24, 32), images=6), folder)
    return folder


def add_objects(folder: Path, objects: np.ndarray) -> None:
    with np.load(folder / "gt.npz") as stored:
        arrays = dict(stored)
    np.savez(folder / "gt.npz", **arrays | {"objid": objects})


def test_a_scene_gives_its_normals_depth_and_lights_with_power(scene: Path) -> None:
    truth = load_truth(scene)
    surface = surface_of(truth, scene)
    np.testing.assert_allclose(surface.normals, truth.normals, atol=1e-6)
    np.testing.assert_array_equal(surface.depth, truth.depth)
    np.testing.assert_allclose(np.linalg.norm(surface.lights, axis=1), truth.power, rtol=1e-5)
    assert surface.px_mm == truth.px_mm
    assert surface.thing is None
    assert not is_benchmark(scene)


def test_the_first_object_inside_the_mask_is_the_one_to_compare_on(scene: Path) -> None:
    truth = load_truth(scene)
    objects = np.ones(truth.mask.shape, np.uint8)
    objects[:, 16:] = 2
    add_objects(scene, objects)
    for path in (scene, scene / "gt.npz"):
        thing = surface_of(truth, path).thing
        np.testing.assert_array_equal(thing, truth.mask & (np.arange(32) < 16))


@pytest.mark.parametrize(
    ("objects", "words"),
    [
        (np.ones((2, 2), np.uint8), r"objid is uint8 of shape \(2, 2\); whole numbers of shape"),
        (np.ones((24, 32)), "objid is float64 of shape"),
        (np.array(["a"]), "objid is <U1"),
        (np.array([{}], object), "objid cannot be read"),
    ],
)
def test_objects_that_fit_no_picture_are_refused(scene: Path, objects, words: str) -> None:
    truth = load_truth(scene)
    add_objects(scene, objects)
    with pytest.raises(InputError, match=rf"gt\.npz: {words}"):
        surface_of(truth, scene)


def test_a_benchmark_folder_gives_normals_mask_and_lights(tmp_path: Path) -> None:
    truth = render_scene("sphere_obstacles", size=(24, 32), images=6).truth
    savemat(tmp_path / "Normal_gt.mat", {"Normal_gt": truth.normals * 0.5})
    assert is_benchmark(tmp_path)
    assert is_benchmark(tmp_path / "Normal_gt.mat")
    assert read_benchmark(tmp_path).lights is None
    np.savetxt(tmp_path / "light_directions.txt", truth.lights)
    surface = read_benchmark(tmp_path)
    np.testing.assert_allclose(surface.normals, truth.normals, atol=1e-6)
    np.testing.assert_array_equal(surface.mask, truth.mask)
    np.testing.assert_allclose(surface.lights, truth.lights, atol=1e-6)
    assert surface.depth is None
    assert surface.thing is None


def test_the_real_benchmark_is_read() -> None:
    folder = SHARED / "diligent_ball"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not here")
    surface = read_benchmark(folder)
    assert surface.mask.sum() == 15791
    assert surface.lights is not None
    assert surface.lights.shape == (96, 3)
    assert (surface.normals[surface.mask][:, 2] > 0).mean() > 0.99


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "cannot be read as true normals"),
        (b"MATLAB 5.0" + b"\0" * 200, "cannot be read as true normals"),
        ({"other": np.ones((2, 2, 3))}, "cannot be read as true normals"),
        ({"Normal_gt": "text"}, "cannot be read as true normals"),
        ({"Normal_gt": np.ones((2, 2))}, r"of shape \(2, 2\)"),
        ({"Normal_gt": np.full((2, 2, 3), np.nan)}, "not finite"),
        ({"Normal_gt": np.zeros((2, 2, 3))}, "all normals are zero"),
    ],
)
def test_damaged_normals_are_refused(content, words: str, tmp_path: Path) -> None:
    file = tmp_path / "Normal_gt.mat"
    if isinstance(content, bytes):
        file.write_bytes(content)
    else:
        savemat(file, content)
    with pytest.raises(InputError, match=rf"Normal_gt\.mat: .*{words}.*accepted"):
        read_benchmark(tmp_path)
