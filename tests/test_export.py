"""Results and exports: what is written is what was computed, whole or not at all."""

import hashlib
import io
import json
import os
import zipfile
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image

from photolin.analysis import Analysis, Confidence, Options
from photolin.errors import InputError, OptionError, OutputError
from photolin.export import (
    export_files,
    is_result,
    label_png,
    linearized_tiff,
    load_result,
    load_result_source,
    load_result_stack,
    mask_png,
    result_files,
    result_npz,
    safe_name,
    save_result,
    write_files,
    zip_files,
)
from photolin.factors import OUTSIDE, PALETTE, Factor, Thresholds, classify
from photolin.load import LoadOptions

K, H, W = 7, 5, 4


@pytest.fixture
def analysis() -> Analysis:
    rng = np.random.default_rng(3)
    mask = np.ones((H, W), bool)
    mask[0, :2] = False
    bases = rng.normal(0.3, 0.4, (3, H, W)).astype(np.float32) * mask
    coefficients = np.vstack([np.eye(3), rng.normal(0.4, 0.3, (K - 3, 3))])
    linearized = np.tensordot(coefficients, bases, 1)
    images = np.clip(linearized + rng.normal(0, 0.2, linearized.shape), 0, 1)
    thresholds = Thresholds(0.31, 0.07)
    return Analysis(
        options=Options(method="statistical", T=0.31, seed=9, base_images=(0, 1, 2)),
        thresholds=thresholds,
        base_images=(0, 1, 2),
        coefficients=coefficients,
        linearized_bases=bases,
        labels=np.where(mask, classify(images, linearized, thresholds), OUTSIDE).astype(np.uint8),
        mask=mask,
        names=(*(f"img{k}.png" for k in range(K - 2)), "../Größe 1.png", "img 6"),
        seconds={"bases": 0.25, "total": 1 / 3},
        title="vase",
        confidence=Confidence(
            **{name: rng.integers(0, K, (H, W)).astype("u2") for name in ("lit", "diffuse")},
            margin=rng.integers(0, 2**16, (H, W)).astype(np.uint16),
            spread=rng.random((H, W), np.float32),
            **{name: rng.random(K) for name in ("support", "residual", "gain", "saturated")},
        ),
        lights=rng.normal(size=(K, 3)),
        files=(("a/img0.png", "00ff"), ("a/caf\udce9.png", "11ee")),
        notes=("transfer: linear",),
        warnings=("image 3 is dim",),
    )


def equal(a: object, b: object) -> bool:
    """Two analyses, or what they hold."""
    if isinstance(a, Analysis | Confidence):
        return type(a) is type(b) and all(
            equal(vars(a)[f.name], vars(b)[f.name]) for f in fields(a)
        )
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return np.array_equal(a, b) and a.dtype == b.dtype
    return a == b


@pytest.fixture
def saved(analysis: Analysis, tmp_path: Path) -> Path:
    save_result(analysis, tmp_path / "out", command="photolin run a out")
    return tmp_path / "out"


def test_save_then_load_is_identity(analysis: Analysis, saved: Path) -> None:
    assert equal(load_result(saved), analysis)
    assert equal(load_result(saved / "result.npz"), analysis)


def test_save_then_load_is_identity_without_lights_and_given_options(
    analysis: Analysis, tmp_path: Path
) -> None:
    plain = replace(analysis, lights=None, options=Options(), files=(), notes=(), warnings=())
    save_result(plain, tmp_path)
    assert equal(load_result(tmp_path), plain)


def test_results_without_confidence_load_with_none(analysis: Analysis, tmp_path: Path) -> None:
    """As version 0.1 wrote them."""
    plain = replace(analysis, confidence=None)
    save_result(plain, tmp_path)
    with np.load(tmp_path / "result.npz") as arrays:
        assert not {"lit", "spread", "gain"} & set(arrays)
    assert load_result(tmp_path).confidence is None
    assert equal(load_result(tmp_path), plain)
    assert not equal(load_result(tmp_path), analysis)


def test_a_loaded_confidence_is_read_only(saved: Path) -> None:
    confidence = load_result(saved).confidence
    assert confidence is not None
    for array in vars(confidence).values():
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_the_report_says_what_each_image_is_worth(analysis: Analysis, saved: Path) -> None:
    images = json.loads((saved / "report.json").read_text())["images"]
    c = analysis.confidence
    assert c is not None
    for name, values in (
        *(("possible", c.support), ("residual", c.residual)),
        *(("gain", c.gain), ("saturated", c.saturated)),
    ):
        assert [image[name] for image in images] == values.tolist()


def test_saving_what_was_loaded_gives_the_same_bytes(saved: Path, tmp_path: Path) -> None:
    save_result(load_result(saved), tmp_path / "again", command="photolin run a out")
    for name in ("result.npz", "report.json"):
        assert (tmp_path / "again" / name).read_bytes() == (saved / name).read_bytes()


def test_result_npz_does_not_depend_on_the_clock(
    analysis: Analysis, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = result_npz(analysis)
    monkeypatch.setattr("time.time", lambda: 2e9)
    monkeypatch.setattr("time.localtime", lambda *_: (2033, 5, 18, 3, 33, 20, 2, 138, 0))
    assert result_npz(analysis) == first


def test_result_npz_holds_the_promised_arrays(analysis: Analysis, saved: Path) -> None:
    with np.load(saved / "result.npz") as arrays:
        found = {name: (str(arrays[name].dtype), arrays[name].shape) for name in arrays}
        assert arrays["T"] == 0.31
        assert arrays["Ts"] == 0.07
    assert found == {
        "labels": ("uint8", (K, H, W)),
        "coefficients": ("float64", (K, 3)),
        "base_images": ("int64", (3,)),
        "linearized_bases": ("float32", (3, H, W)),
        "mask": ("bool", (H, W)),
        "determined": ("bool", (H, W)),
        "T": ("float64", ()),
        "Ts": ("float64", ()),
        "lights": ("float64", (K, 3)),
        **dict.fromkeys(("lit", "diffuse", "margin"), ("uint16", (H, W))),
        "spread": ("float32", (H, W)),
        **dict.fromkeys(("support", "residual", "gain", "saturated"), ("float64", (K,))),
    }


def test_the_report_counts_labels_and_support_inside_the_mask(
    analysis: Analysis, saved: Path
) -> None:
    report = json.loads((saved / "report.json").read_text())
    P = int(analysis.mask.sum())
    for k, image in enumerate(report["images"]):
        assert sum(image["counts"].values()) == P
        assert image["counts"]["cast shadow"] == (analysis.labels[k] == Factor.CAST).sum()
        good = sum(image["counts"][c] for c in ("diffuse", "attached shadow", "cast shadow"))
        assert image["support"] == pytest.approx(good / P)  # Eq. (5), by hand
    mean = np.mean([image["support"] for image in report["images"]])
    assert report["support"]["mean"] == pytest.approx(mean)  # Eq. (6) sums the same table
    share = np.isin(analysis.labels, (1, 3, 4)).mean(axis=0)[analysis.mask]
    for q in (5, 25, 50, 75, 95):
        assert report["support"][f"p{q:02d}"] == pytest.approx(np.percentile(share, q))
    assert report["support"]["pixels"] == P
    assert report["command"] == "photolin run a out"
    assert report["seed"] == 9
    assert report["warnings"] == ["image 3 is dim"]
    assert report["seconds"]["total"] == 1 / 3
    assert report["files"][0] == {"path": "a/img0.png", "sha256": "00ff"}


def test_a_result_is_told_from_a_stack(saved: Path, tmp_path: Path) -> None:
    np.savez(tmp_path / "stack.npz", images=np.zeros((6, 4, 4)))
    assert is_result(saved)
    assert is_result(saved / "result.npz")
    assert not is_result(tmp_path / "stack.npz")
    assert not is_result(tmp_path)
    assert not is_result(tmp_path / "missing")


def test_a_label_png_holds_codes_colours_and_transparency(analysis: Analysis) -> None:
    image = Image.open(io.BytesIO(label_png(analysis.labels[4])))
    assert image.mode == "P"
    assert np.array_equal(np.asarray(image), analysis.labels[4])
    colours = np.asarray(image.convert("RGBA"))
    for factor, rgb in PALETTE.items():
        assert (colours[analysis.labels[4] == factor] == (*rgb, 255)).all()
    assert (colours[~analysis.mask, 3] == 0).all()


def test_masks_of_one_image_cover_each_pixel_once(analysis: Analysis) -> None:
    masks = [np.asarray(Image.open(io.BytesIO(mask_png(analysis.labels[4], f)))) for f in Factor]
    assert {int(v) for m in masks for v in np.unique(m)} <= {0, 255}
    assert np.array_equal(np.sum(masks, axis=0, dtype=int), 255 * analysis.mask)


def test_a_linearized_tiff_keeps_every_signed_value(analysis: Analysis) -> None:
    data = linearized_tiff(analysis, [4, 6])
    pages = tifffile.imread(io.BytesIO(data))
    assert pages.dtype == np.float32
    assert np.array_equal(pages, [analysis.linearized(4), analysis.linearized(6)])
    assert pages.min() < 0
    with tifffile.TiffFile(io.BytesIO(data)) as tiff:
        assert "linearized image 6 (img 6)" in tiff.pages[1].tags["ImageDescription"].value


@pytest.mark.parametrize(
    ("contents", "count"), [("labels", K), ("masks", 5 * K), ("linearized", 1)]
)
def test_exports_of_all_images_have_safe_unique_names(
    analysis: Analysis, contents, count: int
) -> None:
    files = export_files(analysis, contents)
    assert len(files) == count
    assert not any(set(name) & set('/\\:"') for name in files)


def test_names_of_files_keep_the_letters_of_all_alphabets(analysis: Analysis) -> None:
    names = list(export_files(analysis, "labels", [K - 2, K - 1]))
    assert names == [f"labels_{K - 2:03d}_Größe 1.png", f"labels_{K - 1:03d}_img 6.png"]


@pytest.mark.parametrize(
    ("name", "safe"),
    [
        ("Größe 像 (2) #1.a", "Größe 像 (2) #1.a"),
        ('a<b>c:d"e/f\\g|h?i*j\0k\x7f', "a_b_c_d_e_f_g_h_i_j_k_"),
        ("\udcff", "_"),
        ("..", ""),
        (". hidden. ", "hidden"),
        ("o\u0308", "ö"),
        ("像" * 100, "像" * 40),
    ],
)
def test_a_name_loses_only_what_file_systems_reject(name: str, safe: str, tmp_path: Path) -> None:
    assert safe_name(name) == safe
    (tmp_path / f"labels_{safe}.png").write_bytes(b"")


@pytest.mark.parametrize(
    ("name", "written"),
    [("004.png", "004"), ("4.tif", "004"), ("0005.png", "004_0005"), ("a4.png", "004_a4")],
)
def test_a_number_that_is_the_name_is_written_once(
    analysis: Analysis, name: str, written: str
) -> None:
    named = replace(analysis, names=(*analysis.names[:4], name, *analysis.names[5:]))
    assert list(export_files(named, "labels", [4])) == [f"labels_{written}.png"]


def test_exports_of_one_image_name_it(analysis: Analysis) -> None:
    assert list(export_files(analysis, "labels", [2])) == ["labels_002_img2.png"]
    assert list(export_files(analysis, "linearized", [2])) == ["linearized_002_img2.tif"]
    masks = export_files(analysis, "masks", [2])
    assert "mask_002_img2_A_attached_shadow.png" in masks


@pytest.mark.parametrize("k", [-1, K])
def test_an_image_that_is_not_there_is_refused(analysis: Analysis, k: int) -> None:
    with pytest.raises(OptionError, match=f"image is {k}; accepted is 0 to {K - 1}"):
        export_files(analysis, "labels", [k])


def test_a_zip_holds_the_files_and_no_clock(analysis: Analysis) -> None:
    files = export_files(analysis, "labels")
    data = zip_files(files)
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert {name: archive.read(name) for name in archive.namelist()} == files
        assert {entry.date_time[0] for entry in archive.infolist()} == {1980}


def test_saving_again_replaces_and_leaves_nothing_else(analysis: Analysis, saved: Path) -> None:
    other = replace(analysis, title="other")
    save_result(other, saved)
    assert load_result(saved).title == "other"
    assert sorted(p.name for p in saved.iterdir()) == ["report.json", "result.npz"]


@pytest.mark.parametrize(
    "interruption", [KeyboardInterrupt, OSError(28, "No space left on device")]
)
def test_an_interrupted_write_leaves_the_old_file_and_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, interruption: BaseException
) -> None:
    target = tmp_path / "result.npz"
    target.write_bytes(b"old")
    real = Path.write_bytes

    def half(path: Path, data: bytes) -> int:
        real(path, data[:2])
        raise interruption

    monkeypatch.setattr(Path, "write_bytes", half)
    with pytest.raises((KeyboardInterrupt, OutputError)):
        write_files(tmp_path, {target.name: b"new and longer"})
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_disk_that_fills_up_between_two_files_leaves_the_earlier_result(
    analysis: Analysis, saved: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        if "report.json" in path.name:
            raise OSError(28, "No space left on device")
        return real(path, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OutputError, match=r"report\.json: cannot be written \(No space left"):
        save_result(replace(analysis, thresholds=Thresholds(0.5, 0)), saved)
    assert equal(load_result(saved), analysis)
    assert sorted(p.name for p in saved.iterdir()) == ["report.json", "result.npz"]


def test_a_folder_in_the_place_of_a_file_keeps_all_from_being_written(
    analysis: Analysis, tmp_path: Path
) -> None:
    (tmp_path / "report.json").mkdir()
    with pytest.raises(OutputError, match=r"report\.json: cannot be written \(Is a directory\)"):
        save_result(analysis, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["report.json"]


@pytest.mark.parametrize("target", ["out", "gone"])
def test_an_output_that_is_a_link_to_nothing_is_refused(
    analysis: Analysis, tmp_path: Path, target: str
) -> None:
    (tmp_path / "out").symlink_to(tmp_path / target)
    for folder in (tmp_path / "out", tmp_path / "out" / "deeper"):
        with pytest.raises(OutputError, match=r"out: is a link to nothing; a folder, .* accepted"):
            save_result(analysis, folder)


def test_a_reader_of_the_old_file_never_sees_a_mix(tmp_path: Path) -> None:
    target = tmp_path / "result.npz"
    target.write_bytes(b"old")
    with target.open("rb", buffering=0) as reader:
        write_files(tmp_path, {target.name: b"new and longer"})
        assert reader.read() == b"old"
    assert target.read_bytes() == b"new and longer"


def test_an_output_that_is_a_file_is_refused(analysis: Analysis, tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    for folder in (tmp_path / "out", tmp_path / "out" / "deeper"):
        with pytest.raises(OutputError, match=r"out: is a file; a folder, .* is accepted"):
            save_result(analysis, folder)
    assert (tmp_path / "out").read_text() == "mine"


def test_a_full_or_read_only_disk_is_said_in_words(analysis: Analysis) -> None:
    with pytest.raises(OutputError, match=r"/proc/out.*cannot be written .*is accepted"):
        save_result(analysis, "/proc/out")


def test_a_missing_result_is_refused_with_its_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"report\.json: cannot be read .*photolin run"):
        load_result(tmp_path)


def test_a_result_without_its_report_is_refused(saved: Path) -> None:
    (saved / "report.json").unlink()
    with pytest.raises(InputError, match=r"report\.json: cannot be read .*is accepted"):
        load_result(saved)


def test_a_report_of_another_result_is_refused(analysis: Analysis, saved: Path) -> None:
    other = replace(analysis, thresholds=Thresholds(0.5, 0))
    (saved / "result.npz").write_bytes(result_npz(other))
    with pytest.raises(InputError, match=r"result\.npz: .*report\.json describes another"):
        load_result(saved)


def test_a_truncated_result_is_refused_wherever_it_ends(saved: Path) -> None:
    data = (saved / "result.npz").read_bytes()
    for end in range(0, len(data), 97):
        (saved / "result.npz").write_bytes(data[:end])
        with pytest.raises(InputError, match=r"result\.npz: was cut short"):
            load_result(saved)


def test_a_damaged_result_never_raises_anything_else(saved: Path) -> None:
    data = (saved / "result.npz").read_bytes()
    for place in range(0, len(data), 53):
        (saved / "result.npz").write_bytes(data[:place] + b"\xff\x00\xff" + data[place + 3 :])
        with pytest.raises(InputError, match=r"result\.npz: was cut short"):
            load_result(saved)


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "{}", "null", '{"options": 3}', '"x"', "\ufeff\x00"], ids=repr
)
def test_a_foreign_report_is_refused(saved: Path, text: str) -> None:
    (saved / "report.json").write_text(text)
    with pytest.raises(InputError, match=r"(report\.json: is not a|result\.npz: was cut)"):
        load_result(saved)


class Bomb:
    """Leaves a mark where its pickle is loaded."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[object, ...]:
        return (Path.touch, (self.mark,))


def test_a_result_runs_no_code_when_it_is_read(saved: Path, tmp_path: Path) -> None:
    with np.load(saved / "result.npz") as archive:
        arrays = dict(archive)
    bomb = np.array([Bomb(tmp_path / "mark")], object)
    np.savez(saved / "result.npz", allow_pickle=True, **arrays | {"lights": bomb})
    digest = hashlib.sha256((saved / "result.npz").read_bytes()).hexdigest()
    report = json.loads((saved / "report.json").read_text()) | {"result_sha256": digest}
    (saved / "report.json").write_text(json.dumps(report))
    with pytest.raises(InputError, match=r"result\.npz: is not a result of photolin"):
        load_result(saved)
    assert not (tmp_path / "mark").exists()


RIGHT = [("title", "\ud800"), ("files", []), ("notes", [])]
KEYS = ["options", "images", "files", "seconds", "title", "notes"]
VALUES: list[object] = [None, 3, {"T": "high"}, [3], [], "\ud800"]


@pytest.mark.parametrize(
    ("key", "value"), [(k, v) for k in KEYS for v in VALUES if (k, v) not in RIGHT]
)
def test_a_report_with_a_wrong_entry_is_refused(saved: Path, key: str, value: object) -> None:
    report = json.loads((saved / "report.json").read_text())
    (saved / "report.json").write_text(json.dumps(report | {key: value}))
    with pytest.raises(InputError, match=r"report\.json: is not a result of photolin"):
        load_result(saved)


def test_an_archive_of_other_arrays_is_refused(saved: Path) -> None:
    with np.load(saved / "result.npz") as archive:
        good = dict(archive)
    bad = [
        {name: a for name, a in good.items() if name != "mask"},
        good | {"labels": good["labels"].astype(np.int32)},
        good | {"labels": good["labels"][:-1]},
        good | {"coefficients": good["coefficients"][:, :2]},
        good | {"mask": ~good["mask"]},
        good | {"labels": np.where(np.arange(K)[:, None, None] == 1, 0, good["labels"])},
        good | {"base_images": np.array([0, 1, K])},
        good | {"base_images": np.array([0, 1, 1])},
        good | {"linearized_bases": np.array([None, {}], object)},
        good | {"lit": good["lit"].astype(np.int64)},
        good | {"spread": good["spread"].T},
        good | {"gain": good["gain"][1:]},
        {name: a for name, a in good.items() if name != "margin"},
    ]
    for arrays in bad:
        np.savez(saved / "result.npz", **arrays)
        digest = hashlib.sha256((saved / "result.npz").read_bytes()).hexdigest()
        report = json.loads((saved / "report.json").read_text()) | {"result_sha256": digest}
        (saved / "report.json").write_text(json.dumps(report))
        with pytest.raises(InputError, match=r"result\.npz: is not a result of photolin"):
            load_result(saved)


@pytest.mark.parametrize("entry", [{"stack": 3}, {"load": {"roi": []}}, {"load": {"x": 1}}])
def test_a_report_that_does_not_say_how_its_images_were_read_is_refused(
    saved: Path, entry: dict[str, object]
) -> None:
    report = json.loads((saved / "report.json").read_text()) | {"stack": str(saved)}
    (saved / "report.json").write_text(json.dumps(report | entry))
    with pytest.raises(InputError, match=r"report\.json: is not a result of photolin"):
        load_result_stack(saved)


def test_a_result_whose_images_moved_names_the_way_out(analysis: Analysis, tmp_path: Path) -> None:
    save_result(analysis, tmp_path, stack_path=tmp_path / "gone")
    with pytest.raises(InputError, match=r"gone is missing\); name them with --stack"):
        load_result_stack(tmp_path)


def test_the_files_of_a_result_are_what_is_saved(analysis: Analysis, tmp_path: Path) -> None:
    options = LoadOptions(channel="max", roi=(0, 4, 1, 5), mask=tmp_path / "mask.png")
    save_result(analysis, tmp_path, stack_path=tmp_path / "images", load_options=options)
    files = result_files(analysis, stack_path=tmp_path / "images", load_options=options)
    assert files == {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert load_result_source(tmp_path) == (tmp_path / "images", options)


def test_partial_files_of_others_are_left_alone(analysis: Analysis, tmp_path: Path) -> None:
    other = tmp_path / f".result.npz.{os.getpid() + 1}.partial"
    other.write_bytes(b"theirs")
    save_result(analysis, tmp_path)
    assert other.read_bytes() == b"theirs"
