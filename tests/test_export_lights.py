"""Lights in files: what is read back is what was written."""

from pathlib import Path

import numpy as np
import pytest

from photolin.errors import DegenerateError, InputError
from photolin.export import write_files
from photolin.export.lights import lights_diligent, lights_lp
from photolin.load.lights import read_lights, read_table

K = 8
LIGHTS = np.random.default_rng(0).normal((0, 0, 2), size=(K, 3))
POWERS = np.linalg.norm(LIGHTS, axis=1, keepdims=True)
NAMES = tuple(f"Größe {k} a.png" for k in range(K))


def test_lp_files_come_back_in_any_order_of_the_images(tmp_path: Path) -> None:
    write_files(tmp_path, {"lights.lp": lights_lp(LIGHTS, NAMES)})
    first, second, *_ = (tmp_path / "lights.lp").read_text("utf-8").splitlines()
    assert first == str(K)
    assert second.startswith("Größe 0 a.png ")
    np.testing.assert_allclose(
        read_lights(tmp_path / "lights.lp", NAMES), LIGHTS / POWERS, atol=1e-9
    )
    np.testing.assert_allclose(
        read_lights(tmp_path / "lights.lp", NAMES[::-1]), (LIGHTS / POWERS)[::-1], atol=1e-9
    )


def test_names_never_break_a_line(tmp_path: Path) -> None:
    names = ("a\nb", "# c", "", "  ", "\u2028", "7", "x\r", "1 2 3")
    (tmp_path / "lights.lp").write_bytes(lights_lp(LIGHTS, names))
    np.testing.assert_allclose(
        read_lights(tmp_path / "lights.lp", names), LIGHTS / POWERS, atol=1e-9
    )


def test_diligent_files_come_back_as_directions_and_powers(tmp_path: Path) -> None:
    write_files(tmp_path, lights_diligent(LIGHTS))
    np.testing.assert_allclose(
        read_lights(tmp_path / "light_directions.txt", NAMES), LIGHTS / POWERS, atol=1e-9
    )
    _, powers = read_table(tmp_path / "light_intensities.txt")
    np.testing.assert_allclose(powers, POWERS.repeat(3, axis=1), rtol=1e-9)
    colours = np.random.default_rng(1).uniform(0.5, 2, (K, 3))
    write_files(tmp_path, lights_diligent(LIGHTS, colours))
    np.testing.assert_allclose(
        read_table(tmp_path / "light_intensities.txt")[1], colours, rtol=1e-9
    )


def test_what_are_no_lights_is_refused() -> None:
    with pytest.raises(InputError, match="8 lights for 7 images"):
        lights_lp(LIGHTS, NAMES[1:])
    flat = LIGHTS * (1, 1, 0)
    for call in (lambda: lights_lp(flat, NAMES), lambda: lights_diligent(flat)):
        with pytest.raises(DegenerateError, match="lie in one plane"):
            call()
    with pytest.raises(InputError, match="a light is zero or not finite"):
        lights_diligent(LIGHTS * np.eye(K)[0][:, None])
    for wrong in (np.ones((K, 1)), np.zeros((K, 3)), np.full((K, 3), np.nan)):
        with pytest.raises(InputError, match="numbers above 0 of shape"):
            lights_diligent(LIGHTS, wrong)
