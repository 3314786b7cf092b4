"""The oracle: what perfect knowledge of labels and lights gives."""

import numpy as np
import pytest

from photolin.evaluate import evaluate
from photolin.factors import Factor
from photolin.oracle import fit_oracle
from photolin.synthetic import render_scene

SCENE = render_scene("sphere_obstacles", size=(45, 60), bits=None)


def test_on_its_ideal_images_the_oracle_is_exact() -> None:
    truth = SCENE.truth
    linearized, known = fit_oracle(truth.ideal, truth)
    np.testing.assert_allclose(
        linearized[:, known], truth.ideal[:, truth.mask][:, known], atol=1e-5
    )


def test_it_answers_where_three_diffuse_observations_determine_a_pixel() -> None:
    truth = SCENE.truth
    _, known = fit_oracle(SCENE.stack.images, truth)
    diffuse = (truth.labels[:, truth.mask] == Factor.DIFFUSE).sum(axis=0)
    assert not known[diffuse < 3].any()
    assert known[diffuse >= 6].all()


def test_the_oracle_measured_against_itself_has_ratio_one() -> None:
    truth = SCENE.truth
    linearized, known = fit_oracle(SCENE.stack.images, truth)
    lights = truth.lights.astype(np.float64) * truth.power[:, None]
    bases = np.full((3, *truth.mask.shape), np.nan, np.float32)
    solved = np.linalg.lstsq(lights, linearized, rcond=None)[0]
    bases[:, truth.mask] = np.where(known, solved, np.nan)
    measured = evaluate(truth.labels, lights, bases, truth, SCENE.stack.images)
    assert measured.oracle_ratio == pytest.approx(1, rel=1e-3)
    assert np.isnan(evaluate(truth.labels, lights, bases, truth).oracle_ratio)
