"""What is known of a scene, from files as people write them: laws, truth, every misuse."""

from pathlib import Path

import numpy as np
import pytest

from photolin.errors import InputError, OptionError
from photolin.shape.known import Known, lights_in_text, points_in_text, read_known

NAMES = ("a 1.png", "B2.png", "c.png", "d.png", "e.png")
POINTS = "1 2 0 0 1\n30 4 0.6 0 0.8\n"
EXPECTED = Known(points=((1, 2), (30, 4)), normals=((0, 0, 1), (0.6, 0, 0.8)))


def write(folder: Path, text: str | bytes, name: str = "given.txt") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


# Laws: one table, however it is written


@pytest.mark.parametrize(
    "text",
    [
        POINTS,
        POINTS.replace(" ", "\t"),
        POINTS.replace(" ", ","),
        POINTS.replace(" ", ", "),
        POINTS.replace(" ", ";"),
        POINTS.replace("\n", "\r\n"),
        POINTS.replace("\n", "\r"),
        POINTS.rstrip("\n"),
        "\ufeff" + POINTS,
        "row column x y z\n" + POINTS,
        "row,column,x,y,z\r\n" + POINTS.replace(" ", ",").replace("\n", ",\r\n"),
        "# by hand\n\n" + POINTS.replace("\n", "  # clicked\n\n"),
        POINTS.replace("30", "30.0").replace("0.6", "6e-1"),
    ],
    ids=repr,
)
def test_points_are_the_same_however_their_table_is_written(text: str, tmp_path: Path) -> None:
    assert read_known(NAMES, write(tmp_path, text)) == EXPECTED


def test_the_order_of_points_is_kept(tmp_path: Path) -> None:
    swapped = "".join(reversed(POINTS.splitlines(keepends=True)))
    known = read_known(NAMES, write(tmp_path, swapped))
    assert known.points == EXPECTED.points[::-1]
    assert known.normals == EXPECTED.normals[::-1]


# Truth


def test_nothing_given_is_nothing_known() -> None:
    assert read_known(NAMES) == Known()


def test_a_sphere_is_known_with_or_without_points_on_it(tmp_path: Path) -> None:
    sphere = (10.5, 20.0, 7.0)
    assert read_known(NAMES, sphere=sphere) == Known(sphere)
    given = read_known(NAMES, write(tmp_path, "row column\n1 2\n3 4\n"), sphere)
    assert given == Known(sphere, ((1, 2), (3, 4)))


def test_lights_are_of_the_images_they_name_in_any_order(tmp_path: Path) -> None:
    text = "d.png 0 0 1\nC:\\shots\\A 1.PNG 0.6 0 0.8\n/home/b2.png 0 1 0\n"
    known = read_known(NAMES, lights=write(tmp_path, text))
    assert known.images == (3, 0, 1)
    assert known.lights == ((0, 0, 1), (0.6, 0, 0.8), (0, 1, 0))
    assert not known.powers


@pytest.mark.parametrize(
    ("text", "name", "powers"),
    [
        ("a 1.png 0 0 1\nc.png 0.6 0 0.8\n", "l.txt", False),
        ("a 1.png 0 0 1\nc.png 0.6 0 0.8004\n", "l.txt", False),  # four digits
        ("a 1.png 0 0 1\nc.png 0.9 0 1.2\n", "l.txt", True),
        ("2\na 1.png 0 0 1\nc.png 90 0 120\n", "l.lp", False),  # positions
    ],
)
def test_lengths_are_powers_unless_all_are_one_or_positions(
    text: str, name: str, powers: bool, tmp_path: Path
) -> None:
    assert read_known(NAMES, lights=write(tmp_path, text, name)).powers == powers


# Hostile


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "holds no points"),
        ("# nothing\n\n", "holds no points"),
        ("row column x y z\n", "holds no points"),
        ("1 2 0 0\n", "line 1: '1 2 0 0' is no point"),
        ("1 2 0 0 1\n1 2 0 0 1 9\n", "line 2: '1 2 0 0 1 9' is no point"),
        ("1 2 0 0 1\n\n1 2 up 0 1\n", "line 3: '1 2 up 0 1' is no point"),
        ("row 2 0 0 1\n", "line 1: 'row 2 0 0 1' is no point"),
        ("a header\nand another\n1 2 0 0 1\n", "line 2: 'and another' is no point"),
        ("1 2 0 0 nan\n", "line 1: '1 2 0 0 nan' is no point"),
        ("1 2 0 0 inf\n", "line 1: '1 2 0 0 inf' is no point"),
        ("1,5 2,0 0,1 0,1 0,9\n", "line 1: '1 5 2 0 0 1 0 1 0 9' is no point"),
        ("1 2 0 0 1\n3 4\n", "line 2: some points have normals, others none"),
        ("1.5 2 0 0 1\n", "line 1: row and column are not whole"),
        ("1 2e9 0 0 1\n", "line 1: row and column are not whole"),
        (b"\xff\xfe1\x002\x00", "is not text"),
    ],
)
def test_a_table_that_is_none_is_refused_with_its_line(text, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"given\.txt") as caught:
        read_known(NAMES, write(tmp_path, text))
    assert words in str(caught.value)
    assert "lines of row column x y z, or of row column with the option sphere" in str(caught.value)


def test_a_long_line_is_shown_in_part(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_known(NAMES, write(tmp_path, "1 " * 5000))
    assert len(str(caught.value)) < 400


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    for option in ({"points": tmp_path / "gone"}, {"lights": tmp_path / "gone"}):
        with pytest.raises(InputError, match=r"gone: cannot be read \(No such file"):
            read_known(NAMES, **option)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("z.png 0 0 1\n", "'z.png' is no image of the stack; names such as a 1.png"),
        ("0 0 1\n", "'a line without a name' is no image of the stack"),
        ("c.png 0 zero 1\n", "line 1: 'c.png 0 zero 1' is not three numbers"),
        ("3\nc.png 0 0 1\n", "announces 3 lights and lists 1"),
    ],
)
def test_lights_of_no_image_are_refused(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words):
        read_known(NAMES, lights=write(tmp_path, text))


def test_what_does_not_go_together_is_refused(tmp_path: Path) -> None:
    points, pixels = write(tmp_path, POINTS), write(tmp_path, "1 2\n", "pixels.txt")
    lights = write(tmp_path, "c.png 0 0 1\n", "lights.txt")
    sphere = (1.0, 2.0, 3.0)
    both = "lights and points or a sphere are known; one of them is accepted"
    for given, words in (
        ({"sphere": sphere, "lights": lights}, both),
        ({"points": points, "lights": lights}, both),
        ({"points": pixels, "lights": lights}, both),
        ({"points": points, "sphere": sphere}, "points have normals and a sphere; one of them"),
        ({"points": pixels}, "points without normals; accepted with the sphere they lie on"),
    ):
        with pytest.raises(OptionError, match=words):
            read_known(NAMES, **given)
    for fields, words in (
        ({"points": ((1, 2),), "normals": ((0, 0, 1),) * 2}, "1 points and 2 normals; one normal"),
        ({"images": (1, 2), "lights": ((0, 0, 1),)}, "2 images and 1 lights of them; equal"),
    ):
        with pytest.raises(OptionError, match=words):
            Known(**fields)


def test_numbers_are_plain_python_so_that_equal_knowledge_is_equal(tmp_path: Path) -> None:
    known = read_known(NAMES, write(tmp_path, POINTS))
    assert {type(value) for point in known.points for value in point} == {int}
    assert not any(isinstance(value, np.generic) for n in known.normals for value in n)


# Text that is no file


def test_text_is_read_as_the_file_that_holds_it(tmp_path: Path) -> None:
    assert points_in_text(POINTS, "the list") == EXPECTED
    bare, sphere = "1 2\n30 4\n", (10.0, 20.0, 30.0)
    assert points_in_text(bare, "the list", sphere) == read_known(
        NAMES, write(tmp_path, bare), sphere
    )
    lights = "c.png 0 0 2\nA 1.png 0 1 1\nd.png 1 0 1"
    known = lights_in_text(lights, NAMES, "the list")
    assert known == read_known(NAMES, lights=write(tmp_path, lights))
    assert known.powers
    positions = lights_in_text(lights, NAMES, "the list", positions=True)
    assert positions == read_known(NAMES, lights=write(tmp_path, lights, "given.lp"))
    assert not positions.powers


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the list: holds no lines of three numbers"),
        ("c.png 0 0", "the list, line 1: 'c.png 0 0' is not three numbers"),
        (
            "c.png 0 0 1\nz.png 0 0 1",
            "the list: 'z.png' is no image of the stack; names such as a 1",
        ),
        ("0 0 1", "the list: 'a line without a name' is no image"),
    ],
)
def test_lights_in_text_that_cannot_be_used_are_told_with_their_place(
    text: str, words: str
) -> None:
    with pytest.raises(InputError) as caught:
        lights_in_text(text, NAMES, "the list")
    assert words in str(caught.value)
