"""Every accepted file arrives with the numbers it holds."""

import re
import struct
import zlib
from io import BytesIO
from pathlib import Path

import imagecodecs
import numpy as np
import pytest
import tifffile
from PIL import Image

from photolin.errors import InputError
from photolin.load.options import Channel
from photolin.load.pictures import PIXEL_LIMIT, Picture, read_picture
from photolin.load.transfer import decode_srgb, linear_plane, one_channel

RNG = np.random.default_rng(7)
GRAY8 = RNG.integers(0, 256, (5, 7), np.uint8)
GRAY16 = RNG.integers(0, 65536, (5, 7), np.uint16)
RGB8 = RNG.integers(0, 256, (5, 7, 3), np.uint8)
RGB16 = RNG.integers(0, 65536, (5, 7, 3), np.uint16)
FLOAT = RNG.random((5, 7, 3), np.float32)


def write(path: Path, pixels: np.ndarray) -> Path:
    """Write `pixels` without loss, where possible by another library than reads them."""
    kind = path.suffix
    if kind == ".png":
        path.write_bytes(imagecodecs.png_encode(pixels))
    elif kind in (".tif", ".tiff"):
        rgb = "rgb" if pixels.ndim == 3 else "minisblack"
        tifffile.imwrite(path, pixels, photometric=rgb)
    elif kind in (".pgm", ".ppm"):
        kind, (rows, columns) = "P5" if pixels.ndim == 2 else "P6", pixels.shape[:2]
        header = f"{kind}\n# made\n{columns} {rows}\n{np.iinfo(pixels.dtype).max}\n"
        path.write_bytes(header.encode() + pixels.astype(pixels.dtype.newbyteorder(">")).tobytes())
    else:
        Image.fromarray(pixels).save(path)
    return path


@pytest.mark.parametrize(
    ("name", "pixels"),
    [
        ("a.png", GRAY8),
        ("a.png", GRAY16),
        ("a.png", RGB8),
        ("a.png", RGB16),
        ("a.tif", GRAY8),
        ("a.tiff", GRAY16),
        ("a.tif", RGB16),
        ("a.tif", FLOAT),
        ("a.pgm", GRAY8),
        ("a.pgm", GRAY16),
        ("a.ppm", RGB8),
        ("a.ppm", RGB16),
        ("a.bmp", RGB8),
        ("a.tga", RGB8),
        ("a.tga", GRAY8),
    ],
)
def test_no_bit_is_lost(tmp_path: Path, name: str, pixels: np.ndarray) -> None:
    picture = read_picture(write(tmp_path / name, pixels))
    assert picture.pixels.dtype == pixels.dtype
    np.testing.assert_array_equal(picture.pixels, np.atleast_3d(pixels))
    assert picture.full == (1 if pixels.dtype == np.float32 else np.iinfo(pixels.dtype).max)
    assert picture.transfer == "linear"


def test_a_16_bit_rgb_png_holds_values_that_8_bits_cannot(tmp_path: Path) -> None:
    known = np.array([[[1, 256, 257], [65535, 32768, 12345]]], np.uint16)
    picture = read_picture(write(tmp_path / "a.png", known))
    np.testing.assert_array_equal(picture.pixels, known)
    np.testing.assert_array_equal(
        linear_plane(picture, 0, "linear"), (known[..., 0] / 65535).astype(np.float32)
    )


@pytest.mark.parametrize("pixels", [RGB8, RGB16, GRAY8, GRAY16])
def test_alpha_is_left_out(tmp_path: Path, pixels: np.ndarray) -> None:
    colour = np.atleast_3d(pixels)
    alpha = np.concatenate([colour, np.full((5, 7, 1), 9, pixels.dtype)], axis=2)
    picture = read_picture(write(tmp_path / "a.png", alpha))
    np.testing.assert_array_equal(picture.pixels, colour)


def test_a_palette_png_arrives_as_its_colours(tmp_path: Path) -> None:
    image = Image.new("P", (3, 1))
    image.putdata([2, 0, 1])
    image.putpalette([10, 20, 30, 40, 50, 60, 70, 80, 90])
    image.save(tmp_path / "a.png")
    picture = read_picture(tmp_path / "a.png")
    assert picture.pixels.tolist() == [[[70, 80, 90], [10, 20, 30], [40, 50, 60]]]


def test_a_bilevel_tiff_that_stores_white_as_0_is_turned(tmp_path: Path) -> None:
    bits = np.array([[True, False, False]])
    tifffile.imwrite(tmp_path / "a.tif", bits, photometric="miniswhite")
    picture = read_picture(tmp_path / "a.tif")
    assert (picture.pixels[..., 0].tolist(), picture.full) == ([[0, 1, 1]], 1)


def test_a_planar_tiff_and_a_palette_tiff_arrive_as_rgb(tmp_path: Path) -> None:
    tifffile.imwrite(
        tmp_path / "a.tif", np.moveaxis(RGB16, -1, 0), photometric="rgb", planarconfig="separate"
    )
    np.testing.assert_array_equal(read_picture(tmp_path / "a.tif").pixels, RGB16)
    colormap = RNG.integers(0, 65536, (3, 256), np.uint16)
    tifffile.imwrite(tmp_path / "b.tif", GRAY8, photometric="palette", colormap=colormap)
    np.testing.assert_array_equal(read_picture(tmp_path / "b.tif").pixels, colormap.T[GRAY8])


def test_a_pgm_says_its_own_full_scale_in_digits_or_bytes(tmp_path: Path) -> None:
    (tmp_path / "a.pgm").write_bytes(b"P5 2 1 4095\n" + struct.pack(">2H", 4095, 7))
    (tmp_path / "b.pgm").write_text("P2\n2 1\n4095\n4095 7\n")
    for name in ("a.pgm", "b.pgm"):
        picture = read_picture(tmp_path / name)
        assert (picture.pixels.ravel().tolist(), picture.full) == ([4095, 7], 4095)
        assert linear_plane(picture, 0, "linear").max() == 1


def test_a_jpeg_says_srgb_and_keeps_its_rows_whatever_its_rotation_tag(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.fromarray(np.full((8, 16, 3), 77, np.uint8)).save(tmp_path / "a.jpg", exif=exif)
    picture = read_picture(tmp_path / "a.jpg")
    assert picture.pixels.shape == (8, 16, 3)
    assert np.abs(picture.pixels.astype(int) - 77).max() <= 1
    assert picture.transfer == "srgb"


def tagged(pixels: np.ndarray, kind: bytes, content: bytes) -> bytes:
    data = imagecodecs.png_encode(pixels)
    chunk = struct.pack(">I", len(content)) + kind + content
    return bytes(data[:33] + chunk + struct.pack(">I", zlib.crc32(chunk[4:])) + data[33:])


@pytest.mark.parametrize(
    ("kind", "content", "transfer", "why"),
    [
        (b"sRGB", b"\0", "srgb", "16-bit PNG with an sRGB tag"),
        (b"gAMA", struct.pack(">I", 45455), "srgb", "16-bit PNG with a gamma tag of 0.45455"),
        (b"gAMA", struct.pack(">I", 100000), "linear", "16-bit PNG with a gamma tag of 1"),
        (b"tEXt", b"Title\0x", "linear", "16-bit PNG without an sRGB or gamma tag"),
    ],
)
def test_tags_of_a_png_decide_its_transfer(
    tmp_path: Path, kind: bytes, content: bytes, transfer: str, why: str
) -> None:
    (tmp_path / "a.png").write_bytes(tagged(GRAY16, kind, content))
    picture = read_picture(tmp_path / "a.png")
    assert (picture.transfer, picture.why) == (transfer, why)
    np.testing.assert_array_equal(picture.pixels[..., 0], GRAY16)


def test_the_profile_of_a_png_is_named(tmp_path: Path) -> None:
    profile = b"Linear RGB\0\0" + zlib.compress(b"x")
    (tmp_path / "a.png").write_bytes(tagged(GRAY8, b"iCCP", profile))
    picture = read_picture(tmp_path / "a.png")
    assert picture.transfer == "linear"
    assert picture.why == "8-bit PNG with the colour profile 'Linear RGB'"


def test_srgb_follows_the_curve_of_the_standard() -> None:
    v = np.linspace(0, 1, 10001)
    linear = decode_srgb(v)
    encoded = np.where(
        linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055
    )
    np.testing.assert_allclose(encoded, v, atol=1e-7)
    assert (linear[0], linear[-1]) == (0, 1)
    assert decode_srgb(np.array(0.5)) == pytest.approx(0.21404114)


def test_tables_and_floats_decode_alike() -> None:
    integers = Picture(RGB16, 65535, "srgb", "")
    floats = Picture(RGB16 / 65535, 1, "srgb", "")
    np.testing.assert_array_equal(
        linear_plane(integers, 1, "srgb"), linear_plane(floats, 1, "srgb")
    )


@pytest.mark.parametrize(
    ("channel", "expected"),
    [
        ("mean", 0.5),
        ("luminance", 0.2126 * 0.2 + 0.7152 * 0.4 + 0.0722 * 0.9),
        ("max", 0.9),
        ("r", 0.2),
        ("g", 0.4),
        ("b", 0.9),
    ],
)
def test_colour_becomes_one_channel_by_the_rule(channel: Channel, expected: float) -> None:
    picture = Picture(np.array([[[0.2, 0.4, 0.9]]]), 1, "linear", "")
    assert one_channel(picture, channel, "linear")[0, 0] == pytest.approx(expected)
    gray = Picture(np.array([[[0.3]]]), 1, "linear", "")
    assert one_channel(gray, channel, "linear")[0, 0] == np.float32(0.3)


def test_dark_and_power_act_on_each_channel_before_they_are_joined() -> None:
    picture = Picture(np.array([[[0.2, 0.4, 0.9]]]), 1, "linear", "")
    dark = [np.array([[v]], np.float32) for v in (0.1, 0.1, 0.5)]
    power = np.array([0.5, 1, 4])
    assert one_channel(picture, "max", "linear", dark, power)[0, 0] == pytest.approx(0.3)
    assert one_channel(picture, "mean", "linear", dark, power)[0, 0] == pytest.approx(0.2)


def png_header(rows: int, columns: int) -> bytes:
    content = b"IHDR" + struct.pack(">IIBBBBB", columns, rows, 16, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + struct.pack(">I", 13)
        + content
        + struct.pack(">I", zlib.crc32(content))
    )


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.png", png_header(60000, 50000)),
        ("a.pgm", b"P5 50000 60000 255\n"),
    ],
)
def test_a_huge_claim_is_refused_from_the_header(tmp_path: Path, name: str, data: bytes) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=r"a\.\w+: claims 60000 x 50000 pixels; 1 to 200 million"):
        read_picture(tmp_path / name)
    assert PIXEL_LIMIT == 200_000_000


def test_a_huge_tga_is_refused_before_memory_is_taken(tmp_path: Path) -> None:
    header = b"\0\0\2" + bytes(9) + struct.pack("<HHBB", 50000, 60000, 24, 0)
    (tmp_path / "a.tga").write_bytes(header)
    with pytest.raises(InputError, match=r"a\.tga: is truncated or not a TGA image"):
        read_picture(tmp_path / "a.tga")


@pytest.mark.parametrize("kind", ["png", "tif", "jpg", "tga", "bmp", "pgm", "ppm"])
@pytest.mark.parametrize("share", [0, 0.05, 0.6])
def test_a_truncated_file_is_refused_with_its_name(tmp_path: Path, kind: str, share: float) -> None:
    pixels = RNG.integers(0, 256, (64, 64) if kind == "pgm" else (64, 64, 3), np.uint8)
    data = write(tmp_path / f"whole.{kind}", pixels).read_bytes()
    broken = tmp_path / f"broken.{kind}"
    broken.write_bytes(data[: int(len(data) * share)])
    with pytest.raises(
        InputError, match=rf"broken\.{kind}: is truncated or not a {kind.upper()}"
    ) as told:
        read_picture(broken)
    assert not re.search("pillow|plugin|uri", str(told.value))


@pytest.mark.parametrize("kind", ["png", "tif", "jpg", "tga", "bmp", "pgm"])
def test_text_in_an_image_file_is_refused_with_its_name(tmp_path: Path, kind: str) -> None:
    (tmp_path / f"a.{kind}").write_text("This is no image at all, it is a line of text. " * 9)
    with pytest.raises(InputError, match=rf"a\.{kind}: is truncated or not") as told:
        read_picture(tmp_path / f"a.{kind}")
    assert not re.search("pillow|plugin|uri", str(told.value))


@pytest.mark.parametrize("full", [0, 65536])
def test_a_pgm_with_an_impossible_full_scale_is_refused(tmp_path: Path, full: int) -> None:
    (tmp_path / "a.pgm").write_bytes(b"P5\n2 2\n%d\n" % full + b"1234" * 2)
    with pytest.raises(InputError, match=rf"a\.pgm: .*full scale of {full}; 1 to 65535"):
        read_picture(tmp_path / "a.pgm")


def test_other_files_are_refused_with_what_is_accepted(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a\.gif: is no image file; accepted are \.png, \.tif"):
        read_picture(tmp_path / "a.gif")
    with pytest.raises(InputError, match=r"a\.png: cannot be read \(No such file"):
        read_picture(tmp_path / "a.png")
    buffer = BytesIO()
    Image.fromarray(RGB8).save(buffer, "JPEG")
    (tmp_path / "b.png").write_bytes(buffer.getvalue())
    with pytest.raises(InputError, match="not a PNG image"):
        read_picture(tmp_path / "b.png")
