"""Rendered scenes: laws of light, closed forms of their truth, files and refusals."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from photolin.errors import InputError, OptionError, OutputError
from photolin.factors import OUTSIDE, Factor
from photolin.synthetic import SCENES, Scene, Truth, files, load_truth, render_scene, write_scene
from photolin.synthetic.render import render_truth
from photolin.synthetic.scenes import Setup, Surface, place_lights
from photolin.synthetic.shapes import Block, Quadric, Ring, Shape, cone, lathe, pole, sphere

SAMPLES = Path(__file__).parents[1] / "sample_data"


@pytest.fixture(scope="module", params=SCENES)
def scene(request: pytest.FixtureRequest) -> Scene:
    return render_scene(request.param, bits=None)


@pytest.fixture(scope="module")
def small() -> Scene:
    return render_scene("cup", size=(24, 32), images=6)


def share(truth: Truth, factor: Factor) -> float:
    return 100 * float((truth.labels[:, truth.mask] == factor).mean())


def plane_positions(truth: Truth) -> tuple[np.ndarray, np.ndarray]:
    """x and y (H,W) of the pixel centres, mm."""
    H, W = truth.mask.shape
    row, column = np.mgrid[:H, :W]
    return (column + 0.5 - W / 2) * truth.px_mm, (H / 2 - row - 0.5) * truth.px_mm


# Laws


def test_the_ideal_image_is_albedo_times_power_times_cosine(scene: Scene) -> None:
    t = scene.truth
    lights = t.lights * t.power[:, None]
    expected = np.einsum("hw,hwi,ki->khw", t.albedo, t.normals, lights)
    np.testing.assert_allclose(t.ideal, expected, atol=1e-6)
    assert t.ideal.min() < -0.1  # attached shadow keeps its sign


def test_three_ideal_images_span_all_others(scene: Scene) -> None:
    t = scene.truth
    lights = (t.lights * t.power[:, None]).astype(float)
    coefficients = lights @ np.linalg.inv(lights[:3])
    np.testing.assert_allclose(np.tensordot(coefficients, t.ideal[:3], 1), t.ideal, atol=1e-5)


def test_shadows_are_black_and_lit_pixels_are_the_ideal_plus_a_highlight(scene: Scene) -> None:
    t, images = scene.truth, scene.stack.images
    shadow = np.isin(t.labels, (Factor.ATTACHED, Factor.CAST))
    assert not images[shadow | (t.labels == OUTSIDE)].any()
    excess = images - t.ideal
    diffuse, specular = t.labels == Factor.DIFFUSE, t.labels == Factor.SPECULAR
    assert excess[diffuse].min() > -1e-6
    assert (excess <= np.maximum(0.005, 0.02 * t.ideal) + 1e-6)[diffuse].all()
    open_end = specular & (images < 1)
    assert (excess > 0.005 - 1e-6)[open_end].all()
    assert (excess > 0.02 * t.ideal - 1e-6)[open_end].all()


def test_the_highlight_is_that_of_phong() -> None:
    scene = render_scene("sphere_cone", bits=None)
    t = scene.truth
    mirror = 2 * t.normals[..., 2:] * t.normals - (0, 0, 1)
    cosine = np.clip(np.einsum("hwi,ki->khw", mirror, t.lights.astype(float)), 0, None)
    gloss = np.where(t.albedo > 0.65, 0.55, 0)
    lit = np.isin(t.labels, (Factor.DIFFUSE, Factor.SPECULAR))
    expected = np.minimum(1, (t.ideal + gloss * t.power[:, None, None] * cosine**13) * lit)
    np.testing.assert_allclose(scene.stack.images, expected, atol=2e-6)


def test_labels_follow_the_sign_of_the_ideal(scene: Scene) -> None:
    t = scene.truth
    attached = t.labels == Factor.ATTACHED
    assert (t.ideal[attached] <= 0).all()
    assert (t.ideal[:, t.mask][~attached[:, t.mask]] > 0).all()
    assert (t.labels[:, ~t.mask] == OUTSIDE).all()
    assert not (t.labels[:, t.mask] == Factor.UNDEFINED).any()


def test_doubling_albedo_doubles_the_ideal_and_moves_no_shadow() -> None:
    setup = replace(SCENES["sphere_cone"], size=(30, 40))
    half = tuple(replace(s, albedo=float(s.albedo) / 2) for s in setup.surfaces)  # type: ignore[arg-type]
    bright, _ = render_truth(setup)
    dim, _ = render_truth(replace(setup, surfaces=half))
    np.testing.assert_array_equal(bright.ideal, 2 * dim.ideal)
    for factor in (Factor.ATTACHED, Factor.CAST):
        np.testing.assert_array_equal(bright.labels == factor, dim.labels == factor)


def test_more_images_only_add_lights() -> None:
    few, many = (place_lights(SCENES["pot"], count) for count in (6, 40))
    np.testing.assert_array_equal(few[0], many[0][:6])
    np.testing.assert_array_equal(few[1], many[1][:6])


def test_a_larger_size_shows_the_same_scene() -> None:
    small, large = (render_scene("pot", size=(s, s)).truth for s in (64, 192))
    assert small.px_mm == pytest.approx(3 * large.px_mm)
    for factor in (Factor.DIFFUSE, Factor.SPECULAR, Factor.ATTACHED, Factor.CAST):
        assert share(small, factor) == pytest.approx(share(large, factor), abs=0.5)


def test_the_same_seed_gives_the_same_bytes_and_another_seed_other_noise() -> None:
    def render(seed: int, noise: float) -> bytes:
        scene = render_scene("cup", size=(24, 32), images=6, seed=seed, noise=noise)
        return scene.stack.images.tobytes()

    assert render(3, 0.01) == render(3, 0.01) != render(4, 0.01)
    assert render(3, 0) == render(4, 0)


def test_noise_is_as_strong_as_asked_and_leaves_the_truth_alone() -> None:
    exact = render_scene("sphere_cone", bits=None)
    noisy = render_scene("sphere_cone", bits=None, noise=0.02)
    middle = (exact.stack.images > 0.2) & (exact.stack.images < 0.8)
    assert np.std((noisy.stack.images - exact.stack.images)[middle]) == pytest.approx(
        0.02, rel=0.02
    )
    for key in files.KEYS:
        np.testing.assert_array_equal(getattr(noisy.truth, key), getattr(exact.truth, key))


def test_ambient_lifts_every_pixel_by_the_same_amount() -> None:
    dark, lifted = (render_scene("pot", bits=None, ambient=a).stack.images for a in (0.0, 0.125))
    np.testing.assert_allclose(lifted, np.minimum(dark + 0.125, 1), atol=1e-6)


@pytest.mark.parametrize("bits", [8, 16])
def test_images_are_rounded_to_the_bits_asked_for(bits: Literal[8, 16]) -> None:
    full = 2**bits - 1
    exact, coarse = (render_scene("pot", bits=b).stack.images.astype(float) for b in (None, bits))
    np.testing.assert_allclose(coarse * full, np.round(coarse * full), atol=0.01)
    assert np.abs(coarse - exact).max() <= 0.5001 / full + 1e-7


# Truth


def test_the_sphere_has_the_normals_and_depth_of_a_sphere() -> None:
    t = render_scene("sphere_obstacles").truth
    x, y = plane_positions(t)
    inside = (np.hypot(x, y) < 49.9) & (np.abs(x) < 40) & (np.abs(y) < 40)  # clear of obstacles
    z = np.sqrt(2500 - x**2 - y**2, where=inside, out=np.zeros(x.shape))
    np.testing.assert_allclose(t.depth[inside], z[inside], atol=1e-4)
    expected = np.stack((x, y, z), axis=-1) / 50
    np.testing.assert_allclose(t.normals[inside], expected[inside], atol=1e-5)


def test_normals_are_the_slope_of_the_depth(scene: Scene) -> None:
    t = scene.truth
    up, right = np.gradient(t.depth, -t.px_mm, t.px_mm)
    slope = unit(np.stack((-right, -up, np.ones(up.shape)), axis=-1))
    smooth = np.isfinite(slope).all(-1) & (t.normals[..., 2] > 0.5)
    assert np.median((slope * t.normals).sum(-1)[smooth]) > np.cos(np.radians(1.5))
    np.testing.assert_allclose(np.linalg.norm(t.normals[t.mask], axis=-1), 1, atol=1e-6)
    assert (t.normals[t.mask][:, 2] >= 0).all()
    assert not t.normals[~t.mask].any()
    np.testing.assert_array_equal(np.isnan(t.depth), ~t.mask)


def test_the_shadow_of_a_sphere_on_a_plane_is_where_geometry_puts_it() -> None:
    ball, wall = sphere((0, 0, 15), 10), Ring((0, 0, 0), axis=(0, 0, 1))
    setup = Setup((Surface(ball, 0.8), Surface(wall, 0.5)), (80, 80), 8, view=(80, 80))
    t, _ = render_truth(setup)
    x, y = plane_positions(t)
    point = np.stack((x, y, np.zeros(x.shape)), axis=-1)
    on_wall = np.abs(t.depth) < 1e-6
    for k, s in enumerate(t.lights.astype(float)):
        across = np.linalg.norm(np.cross((0, 0, 15) - point, s), axis=-1)
        clear_cut = on_wall & (np.abs(across - 10) > 1e-3)
        cast = t.labels[k] == Factor.CAST
        np.testing.assert_array_equal(cast[clear_cut], across[clear_cut] < 10)
        assert cast.sum() > 50


@pytest.mark.parametrize(
    "shape",
    [
        sphere((1, 2, 3), 9),
        cone((1, -8, 0), 7, 15),
        pole((-6, 2, 1), 4, 12, (1, 0, 0)),
        Quadric((0, -5, 0), 20, -6, 0.9, 0, 11, (0, 0.6, 0.8)),
        Block((1, -1, 2), (3, 8, 5)),
    ],
)
def test_a_ray_meets_a_shape_where_a_walk_along_it_first_crosses_the_surface(shape: Shape) -> None:
    rng = np.random.default_rng(0)
    origins = rng.uniform(-12, 12, (300, 3))
    steps = np.arange(0, 60, 0.01)
    agreed, met = 0, 0
    for direction in unit(rng.normal(size=(4, 3))):
        for origin, t in zip(origins, shape.hit(origins, direction), strict=True):
            walk = steps[crossings(shape, origin + steps[:, None] * direction)]
            agreed += abs(t - walk[0]) <= 0.02 if len(walk) else np.isinf(t)
            met += len(walk) > 0
    assert met > 40
    assert agreed >= 0.99 * 1200  # steps of 0.01 overlook grazing rays and cut rims


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def crossings(shape: Shape, points: np.ndarray) -> np.ndarray:
    """Indices of the points (N,3) just before which a walk along them crosses the surface."""
    if isinstance(shape, Block):
        side = np.max(np.abs(points - shape.centre) - shape.half, axis=1) <= 0
        within = np.ones(len(points), bool)
    else:
        assert isinstance(shape, Quadric)
        h = (points - shape.base) @ shape.axis
        r2 = ((points - shape.base) ** 2).sum(-1) - h**2
        side = r2 <= shape.a + shape.b * h + shape.c * h**2
        within = (h >= shape.low) & (h <= shape.high)
    return 1 + np.flatnonzero((side[1:] != side[:-1]) & within[1:] & within[:-1])


def test_a_ring_is_met_between_its_radii_only() -> None:
    ring = Ring((0, 1, 0), 2, 3)
    origins = np.array([[r, 5.0, 0] for r in (1.9, 2.1, 2.9, 3.1)])
    down, along = np.array([0.0, -1, 0]), np.array([1.0, 0, 0])
    np.testing.assert_array_equal(ring.hit(origins, down), [np.inf, 4, 4, np.inf])
    assert np.isinf(ring.hit(origins, -down)).all()
    assert np.isinf(ring.hit(origins, along)).all()


def test_a_lathe_has_no_crease_and_closes_where_radii_are_opposite() -> None:
    pieces = lathe((0, 0, 0), (-5, 5, 9, 6, 6), 12)
    assert len(pieces) == 3
    assert pieces[0].a == 0
    for lower, upper in pairwise(pieces):
        h = lower.high
        assert lower.a + lower.b * h + lower.c * h**2 == pytest.approx(upper.a)
        assert lower.b + 2 * lower.c * h == pytest.approx(upper.b)
    last = pieces[-1]
    assert last.a + last.b * last.high + last.c * last.high**2 == pytest.approx(36)
    assert last.b + 2 * last.c * last.high == pytest.approx(0)


def test_sphere_and_cone_have_the_shares_of_table_1() -> None:
    t = render_scene("sphere_cone").truth
    table = {Factor.CAST: 12.5, Factor.ATTACHED: 4.4, Factor.DIFFUSE: 78.2, Factor.SPECULAR: 5.0}
    for factor, percent in table.items():
        assert share(t, factor) == pytest.approx(percent, abs=1.0)
    assert t.labels.shape == (20, 120, 160)
    assert t.mask.all()


def test_every_pixel_of_sphere_and_cone_is_lit_in_four_images() -> None:
    labels = render_scene("sphere_cone").truth.labels
    assert np.isin(labels, (Factor.DIFFUSE, Factor.SPECULAR)).sum(0).min() >= 4


def test_lights_stand_38_to_75_degrees_high_in_all_directions(scene: Scene) -> None:
    t = scene.truth
    np.testing.assert_allclose(np.linalg.norm(t.lights, axis=1), 1, atol=1e-6)
    height = np.degrees(np.arcsin(t.lights[:, 2]))
    assert 38 <= height.min() < height.max() <= 75
    quadrants = {(x > 0, y > 0) for x, y, _ in t.lights}
    assert len(quadrants) == 4


def test_the_inside_of_the_cup_is_shadowed_in_many_images() -> None:
    t = render_scene("cup").truth
    shadowed = (t.labels == Factor.CAST).sum(0)[t.mask]
    assert (shadowed >= 8).mean() > 0.3


# Files


def test_a_written_scene_reads_back_equal(small: Scene, tmp_path: Path) -> None:
    from photolin.load import load_stack

    write_scene(small, tmp_path / "cup")
    stack = load_stack(tmp_path / "cup")
    np.testing.assert_array_equal(stack.images, small.stack.images)
    np.testing.assert_array_equal(stack.mask, small.stack.mask)
    assert (stack.names, stack.title) == (small.stack.names, small.stack.title)
    truth = load_truth(tmp_path / "cup")
    for key in files.KEYS:
        np.testing.assert_array_equal(getattr(truth, key), getattr(small.truth, key))
    assert "6 images of 24 x 32 pixels" in (tmp_path / "cup" / "README.txt").read_text()


def test_lights_are_written_when_asked_for_and_read_back_with_their_powers(
    small: Scene, tmp_path: Path
) -> None:
    from photolin.load import load_stack

    write_scene(small, tmp_path / "with", lights=True)
    write_scene(small, tmp_path / "without")
    found = load_stack(tmp_path / "with").lights
    assert found is not None
    truth = small.truth
    np.testing.assert_allclose(found, truth.lights * truth.power[:, None], atol=1e-6)
    assert (tmp_path / "with" / "lights.txt").read_text().startswith("000.png ")
    assert load_stack(tmp_path / "without").lights is None


def test_an_8_bit_scene_is_written_with_8_bits(tmp_path: Path) -> None:
    from imagecodecs import png_decode

    scene = render_scene("pot", size=(24, 24), images=6, bits=8)
    write_scene(scene, tmp_path / "pot")
    image = png_decode((tmp_path / "pot" / "images" / "003.png").read_bytes())
    assert image.dtype == np.uint8
    np.testing.assert_array_equal(image, np.round(scene.stack.images[3] * 255))


def test_the_same_scene_is_written_with_the_same_bytes(small: Scene, tmp_path: Path) -> None:
    for name in ("one", "two"):
        write_scene(small, tmp_path / name)
    paths = sorted(p.relative_to(tmp_path / "one") for p in (tmp_path / "one").rglob("*.*"))
    assert len(paths) == 9  # six images, mask, truth, README
    for path in paths:
        assert (tmp_path / "one" / path).read_bytes() == (tmp_path / "two" / path).read_bytes()


@pytest.mark.parametrize("name", SCENES)
def test_sample_data_is_what_the_program_renders(name: str) -> None:
    from imagecodecs import png_decode

    scene, truth = render_scene(name), load_truth(SAMPLES / name)
    np.testing.assert_allclose(truth.ideal, scene.truth.ideal, atol=1e-6)
    assert (truth.labels == scene.truth.labels).mean() > 0.9999  # the last bit may differ
    paths = sorted((SAMPLES / name / "images").iterdir())
    stored = np.stack([png_decode(path.read_bytes()) for path in paths])
    rendered = np.round(scene.stack.images.astype(float) * 65535)
    assert stored.dtype == np.uint16
    assert (np.abs(stored - rendered) <= 1).mean() > 0.9999


def test_sample_data_stays_under_ten_megabytes() -> None:
    assert sum(p.stat().st_size for p in SAMPLES.rglob("*") if p.is_file()) < 10e6


def test_an_existing_folder_is_not_overwritten(small: Scene, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    with pytest.raises(OutputError, match=r"mine: exists already; .* does not exist is accepted"):
        write_scene(small, tmp_path / "mine")
    assert not list((tmp_path / "mine").iterdir())


def test_a_write_that_fails_leaves_nothing_behind(
    small: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full_disk(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", full_disk)
    with pytest.raises(OutputError, match="cup: cannot be written: No space left on device"):
        write_scene(small, tmp_path / "cup")
    assert not list(tmp_path.iterdir())


# Refusals


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"name": "teapot"}, "no scene 'teapot'; accepted are sphere_cone, cup, pot, sphere_obst"),
        ({"size": (8, 100)}, "size is 8 x 100; accepted are 16 to 4096"),
        (
            {"size": (4096, 4096)},
            "24 images of 4096 x 4096 are too large to render; accepted are 200",
        ),
        ({"images": 5}, "images is 5; accepted is 6 to 1000"),
        ({"images": 0}, "images is 0; accepted is 6 to 1000"),
        ({"noise": -0.1}, "noise is -0.1; accepted is a fraction"),
        ({"noise": float("nan")}, "noise is nan; accepted is a fraction"),
        ({"bits": 12}, "bits is 12; accepted are 8, 16 and None"),
        ({"ambient": 1.0}, "ambient is 1; accepted is a fraction"),
        ({"seed": -1, "noise": 0.01}, "seed is -1; accepted is 0 to 4294967295"),
    ],
)
def test_an_option_out_of_range_is_refused_with_its_range(options: dict, words: str) -> None:
    with pytest.raises(OptionError, match=words):
        render_scene(**{"name": "pot", **options})


def test_missing_truth_is_refused_with_its_path(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"gt\.npz: not found; a gt\.npz, or the folder"):
        load_truth(tmp_path)


@pytest.mark.parametrize("content", [b"", b"not numpy", b"PK\x03\x04 cut short", b"\x93NUMPY\x01"])
def test_a_file_that_is_no_truth_is_refused_with_its_path(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "gt.npz").write_bytes(content)
    with pytest.raises(InputError, match=r"gt\.npz: cannot be read as ground truth"):
        load_truth(tmp_path / "gt.npz")


def test_damaged_truth_is_refused_wherever_the_damage_is(small: Scene, tmp_path: Path) -> None:
    write_scene(small, tmp_path / "cup")
    whole = (tmp_path / "cup" / "gt.npz").read_bytes()
    rng = np.random.default_rng(0)
    refused = 0
    for start in np.linspace(0, len(whole) - 40, 50).astype(int):
        damaged = whole[:start] + rng.bytes(40) + whole[start + 40 :]
        (tmp_path / "gt.npz").write_bytes(damaged)
        try:
            load_truth(tmp_path)  # a byte nobody reads may be damaged
        except InputError as error:
            refused += "gt.npz: " in str(error)
    assert refused > 45


def test_truth_without_an_array_is_refused_with_the_name(small: Scene, tmp_path: Path) -> None:
    arrays = {key: getattr(small.truth, key) for key in files.KEYS if key != "ideal"}
    np.savez(tmp_path / "gt.npz", **arrays)
    with pytest.raises(InputError, match=r"has no ideal; accepted are labels, ideal, normals"):
        load_truth(tmp_path)


def test_any_label_outside_the_mask_is_read_as_outside(small: Scene, tmp_path: Path) -> None:
    arrays = {key: getattr(small.truth, key) for key in files.KEYS}
    labels = np.where(small.truth.mask, small.truth.labels, 0)
    np.savez(tmp_path / "gt.npz", **{**arrays, "labels": labels})
    np.testing.assert_array_equal(load_truth(tmp_path).labels, small.truth.labels)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("labels", np.zeros((24, 32), np.uint8), r"labels have 2 axes; \(K,H,W\) is accepted"),
        ("ideal", np.zeros((6, 9, 9), np.float32), r"ideal is float32 of shape \(6, 9, 9\)"),
        ("mask", np.full((24, 32), "yes"), r"mask is <U3 of shape \(24, 32\); numbers"),
    ],
)
def test_truth_that_does_not_fit_is_refused(
    small: Scene, tmp_path: Path, key: str, value: np.ndarray, words: str
) -> None:
    arrays = {k: getattr(small.truth, k) for k in files.KEYS}
    np.savez(tmp_path / "gt.npz", **{**arrays, key: value})
    with pytest.raises(InputError, match=words):
        load_truth(tmp_path)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("labels", 0, "labels hold no class"),
        ("labels", 5, "or others than 0 to 4"),
        ("labels", np.nan, "or others than 0 to 4"),
        ("mask", 0, "labels hold no class"),
        ("ideal", np.inf, "ideal holds NaN or infinity"),
        ("ideal", 1e300, "ideal holds NaN or infinity"),
        ("lights", 0, "a light is zero or not finite"),
        ("lights", np.nan, "a light is zero or not finite"),
    ],
)
def test_truth_with_values_nothing_can_be_measured_against_is_refused(
    small: Scene, tmp_path: Path, key: str, value: float, words: str
) -> None:
    arrays = {k: getattr(small.truth, k) for k in files.KEYS}
    np.savez(tmp_path / "gt.npz", **{**arrays, key: np.full(arrays[key].shape, value)})
    with pytest.raises(InputError, match=rf"gt\.npz: .*{words}.*is accepted"):
        load_truth(tmp_path)
