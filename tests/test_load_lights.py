"""Files of lights."""

from pathlib import Path

import numpy as np
import pytest

from photolin.errors import DegenerateError, InputError
from photolin.export.lights import lights_lp
from photolin.load.lights import read_lights

NAMES = tuple(f"img{k}.png" for k in range(1, 7))
LIGHTS = np.array(
    [[0, 0, 1], [0.6, 0, 0.8], [0, 0.6, 0.8], [-0.6, 0, 0.8], [0, -0.6, 0.8], [1, 1, 2]], float
)


def lines(prefix: tuple[str, ...] = ("",) * 6) -> list[str]:
    return [f"{p} {x} {y} {z}".strip() for p, (x, y, z) in zip(prefix, LIGHTS, strict=True)]


@pytest.mark.parametrize(
    "text",
    [
        "\n".join(lines()),
        "6\n" + "\n".join(lines()) + "\n\n",
        "# x y z\n\n  6\r\n" + "\r\n".join(lines()),
        "\ufeff" + "\n".join(line.replace(" ", "\t") for line in lines()),
    ],
)
def test_lines_of_three_numbers_are_read_with_their_length(tmp_path: Path, text: str) -> None:
    path = tmp_path / "lights.txt"
    path.write_text(text, encoding="utf-8", newline="")
    np.testing.assert_array_equal(read_lights(path, NAMES), LIGHTS)


def test_an_lp_file_is_matched_by_name_and_scaled_to_length_1(tmp_path: Path) -> None:
    prefix = tuple(f"C:\\my shots\\{name.upper()}" for name in NAMES)
    shuffled = [lines(prefix)[k] for k in (5, 0, 3, 1, 4, 2)]
    path = tmp_path / "a.lp"
    path.write_text("6\n" + "\n".join(shuffled))
    lights = read_lights(path, NAMES)
    np.testing.assert_allclose(lights, LIGHTS / np.linalg.norm(LIGHTS, axis=1, keepdims=True))


@pytest.mark.parametrize("names", [("",) * 6, ("a.png", "A.png", "b.png", "c.png", "d.png", "")])
def test_names_that_tell_no_images_apart_leave_lines_in_order(tmp_path: Path, names) -> None:
    path = tmp_path / "a.txt"
    for prefix in (("",) * 6, names):
        path.write_text("\n".join(lines(prefix)))
        np.testing.assert_array_equal(read_lights(path, names), LIGHTS)


def test_an_lp_file_with_other_names_is_taken_in_order(tmp_path: Path) -> None:
    path = tmp_path / "a.lp"
    path.write_text("6\n" + "\n".join(lines(tuple("abcdef"))))
    np.testing.assert_allclose(read_lights(path, NAMES)[1], [0.6, 0, 0.8])


def test_names_with_another_ending_are_matched_too(tmp_path: Path) -> None:
    names = tuple(f"img_{k}.png" for k in (1, 2, 3, 10, 11, 12))
    as_text_is_sorted = [lines(tuple(f"img_{k}.jpg" for k in (1, 2, 3, 10, 11, 12)))[k]
                         for k in (0, 3, 4, 5, 1, 2)]  # fmt: skip
    path = tmp_path / "a.txt"
    path.write_text("\n".join(as_text_is_sorted))
    np.testing.assert_array_equal(read_lights(path, names), LIGHTS)


def test_lines_numbered_like_the_images_are_matched_by_number(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("\n".join(reversed(lines(tuple("123456")))))
    np.testing.assert_array_equal(read_lights(path, tuple(f"{k}.tif" for k in range(1, 7))), LIGHTS)


def test_names_of_some_images_tell_whether_lines_are_in_order(tmp_path: Path) -> None:
    named = lines(("imgg1.png", *NAMES[1:]))
    path = tmp_path / "a.txt"
    path.write_text("\n".join(named))
    np.testing.assert_array_equal(read_lights(path, NAMES), LIGHTS)
    for other in (reversed(named), [*named[2:], *named[:2]], named[1:]):
        path.write_text("\n".join(other))
        with pytest.raises(InputError, match=r"a\.txt: names 5 of 6 .* order, and not img1\.png"):
            read_lights(path, NAMES)


@pytest.mark.parametrize(
    "names",
    [
        ("# a.png", "a  b.png", "c.png", "n 0.5 0.6 0.7.png", "1.5", "x"),
        ("a/b.png", "a\\b.png", "a\nb.png", "d", "e", "f"),
        ("6", "7", "8", "9", "10", "11"),
        ("img.1", "img.2", "img.3", "img.4", "img.5", "img.6"),
    ],
)
def test_lists_that_photolin_wrote_are_read_whatever_the_names(tmp_path: Path, names) -> None:
    path = tmp_path / "lights.lp"
    path.write_bytes(lights_lp(LIGHTS, names))
    unit = LIGHTS / np.linalg.norm(LIGHTS, axis=1, keepdims=True)
    np.testing.assert_allclose(read_lights(path, names), unit, atol=1e-9)


def test_an_image_named_twice_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.lp"
    path.write_text("\n".join([*lines(NAMES), "img3.png 0 0 1"]))
    with pytest.raises(InputError, match=r"a\.lp: names img3\.png twice"):
        read_lights(path, NAMES)


@pytest.mark.parametrize(
    ("more", "before"), [("1.25", False), ("1 0.5 0.25", False), ("0.5", True)]
)
def test_more_than_three_numbers_are_not_taken_for_a_name(
    tmp_path: Path, more: str, before: bool
) -> None:
    path = tmp_path / "a.txt"
    path.write_text("\n".join(f"{more} {x}" if before else f"{x} {more}" for x in lines()))
    with pytest.raises(InputError, match=r"a\.txt, light \d: has [46] numbers; x y z"):
        read_lights(path, NAMES)


@pytest.mark.parametrize("array", [LIGHTS, LIGHTS.T])
def test_an_array_may_lie_either_way(tmp_path: Path, array: np.ndarray) -> None:
    np.save(tmp_path / "l.npy", array)
    np.testing.assert_array_equal(read_lights(tmp_path / "l.npy", NAMES), LIGHTS)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("\n".join(lines()[:5]), "lights.txt: 5 lights for 6 images; one line of x y z"),
        ("7\n" + "\n".join(lines()), "announces 7 lights and lists 6"),
        ("6\n" + "\n".join(lines()).replace("0.6", "0,6"), r"lights.txt, line 3: '0,6 0.0 0.8' is"),
        ("\n".join([*lines()[:5], "1 2"]), "line 6: '1 2' is not three numbers"),
        ("\n".join([*lines()[:5], "nan 0 1"]), "line 6: 'nan 0 1' is not three numbers"),
        ("\n".join([*lines()[:5], "0 0 0"]), "lights.txt: a light is zero or not finite"),
        ("", "lights.txt: holds no lines of three numbers"),
    ],
)
def test_a_line_that_cannot_be_used_is_named(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "lights.txt").write_text(text)
    with pytest.raises(InputError, match=words):
        read_lights(tmp_path / "lights.txt", NAMES)


def test_lights_in_one_plane_are_refused(tmp_path: Path) -> None:
    (tmp_path / "lights.txt").write_text("\n".join(f"0 {k} 1" for k in range(6)))
    with pytest.raises(DegenerateError, match=r"lights\.txt: the lights lie in one plane"):
        read_lights(tmp_path / "lights.txt", NAMES)


def test_files_that_hold_no_lights_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_bytes(b"\xff\xfe\x00\x81")
    np.save(tmp_path / "a.npy", np.array([{}], object), allow_pickle=True)
    np.save(tmp_path / "b.npy", np.array(1.0))
    np.save(tmp_path / "d.npy", np.ones((6, 3), complex))
    (tmp_path / "e.npy").write_bytes(b"PK\x03\x04 no archive")
    whole = bytearray((tmp_path / "d.npy").read_bytes())
    (tmp_path / "f.npy").write_bytes(whole.replace(b"(6, 3), }         ", b"(600000000000, 3)}"))
    for name, words in (
        ("a.txt", "is not text"),
        ("a.npy", "is not a plain array file"),
        ("b.npy", "1 lights of 1 numbers for 6 images"),
        ("d.npy", "holds no numbers"),
        ("c.txt", "cannot be read"),
        ("c.npy", "is not a plain array file"),
        ("e.npy", "is not a plain array file"),
        ("f.npy", "is not a plain array file"),
    ):
        with pytest.raises(InputError, match=f"{name}: {words}"):
            read_lights(tmp_path / name, NAMES)
