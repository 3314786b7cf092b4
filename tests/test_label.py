"""Label maps of a whole stack: those of `classify`, bit for bit."""

import numpy as np
import pytest

from photolin import label as module
from photolin.errors import Cancelled
from photolin.factors import OUTSIDE, Factor, Thresholds, classify
from photolin.label import label_images
from photolin.synthetic import Scene, render_scene


@pytest.fixture(scope="module", params=["sphere_cone", "cup"])
def scene(request: pytest.FixtureRequest) -> Scene:
    return render_scene(request.param, noise=0.01, bits=8)


def solution(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """True bases with some unknown pixels, and coefficients."""
    lights = (scene.truth.lights * scene.truth.power[:, None]).astype(float)
    bases = np.array(scene.truth.ideal[:3])
    bases[:, ::7, ::5] = np.nan
    bases[:, ~scene.truth.mask] = 0
    return bases, lights @ np.linalg.inv(lights[:3])


@pytest.mark.parametrize(("T", "Ts"), [(0.05, 0.02), (0.01, 0.0), (1.0, 0.3)])
def test_the_labels_of_a_scene_are_those_of_classify(scene: Scene, T: float, Ts: float) -> None:
    bases, c = solution(scene)
    stack, t = scene.stack, Thresholds(T, Ts)
    labels = label_images(stack.images, bases, c, stack.mask, t)
    f = c.astype(np.float32)[..., None, None]
    l = f[:, 0] * bases[0] + f[:, 1] * bases[1] + f[:, 2] * bases[2]
    expected = np.where(stack.mask, classify(stack.images, l, t), np.uint8(OUTSIDE))
    assert labels.dtype == np.uint8
    np.testing.assert_array_equal(labels, expected)
    assert (labels[:, ~stack.mask] == OUTSIDE).all()
    assert np.isin(labels[:, stack.mask], list(Factor)).all()


@pytest.mark.parametrize("block", [1, 97, 1 << 30])
@pytest.mark.parametrize("threads", [1, 3])
def test_neither_threads_nor_block_size_change_a_label(
    scene: Scene, block: int, threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    bases, c = (a[:, 40:60, 40:60] if a.ndim == 3 else a for a in solution(scene))
    images, mask = scene.stack.images[:, 40:60, 40:60], scene.stack.mask[40:60, 40:60]
    t = Thresholds(0.05, 0.02)
    expected = label_images(images, bases, c, mask, t)
    monkeypatch.setattr(module, "BLOCK", block)
    found = label_images(images, bases, c, mask, t, threads=threads)
    np.testing.assert_array_equal(found, expected)


def test_the_true_bases_give_the_true_shadows_of_a_clean_scene() -> None:
    scene = render_scene("sphere_cone", size=(60, 80))
    lights = (scene.truth.lights * scene.truth.power[:, None]).astype(float)
    labels = label_images(
        scene.stack.images,
        scene.truth.ideal[:3],
        lights @ np.linalg.inv(lights[:3]),
        scene.truth.mask,
        Thresholds(0.01, 0.001),
    )
    true = scene.truth.labels
    for factor in (Factor.ATTACHED, Factor.CAST):
        assert (labels[true == factor] == factor).mean() > 0.999


def test_labelling_that_is_cancelled_gives_no_labels(scene: Scene) -> None:
    bases, c = solution(scene)
    known = (scene.stack.images, bases, c, scene.stack.mask, Thresholds(0.05, 0.02))
    with pytest.raises(Cancelled, match="labels was cancelled"):
        label_images(*known, cancel=lambda: True)
    asked: list[bool] = []
    whole = label_images(*known, cancel=lambda: bool(asked.append(True)))
    assert asked
    np.testing.assert_array_equal(whole, label_images(*known))
