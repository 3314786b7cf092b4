"""The long work of a tab, without a tab."""

import io
import threading
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
import pytest
import tifffile

from photolin.analysis import Analysis, Options
from photolin.errors import Cancelled, DegenerateError, InputError, OptionError
from photolin.export import load_result, load_shape, write_files
from photolin.export.maps import normals_png
from photolin.export.surface import surface_files
from photolin.factors import Thresholds
from photolin.load import load_stack
from photolin.pipeline import analyze
from photolin.shape.known import Known
from photolin.shape.recover import Shape, recover_shape
from photolin.shape.resolve import resolve_ambiguity
from photolin.synthetic import render_scene
from webapp import work as module
from webapp.desk import Desk
from webapp.runs import Runs
from webapp.source import Source
from webapp.state import ViewState
from webapp.work import EMPTY, Work, cancelling

SCENE = render_scene("sphere_obstacles", size=(48, 64), images=9)
STACK = replace(SCENE.stack, lights=SCENE.truth.lights * SCENE.truth.power[:, None])
OPTIONS = Options(T=0.05, Ts=0.02, samples=50)
RESULT = analyze(STACK, OPTIONS)


@dataclass
class Tab:
    """What a tab was told."""

    state: ViewState = field(default_factory=ViewState)
    begun: list[Thresholds] = field(default_factory=list)
    moved: list[Thresholds] = field(default_factory=list)
    busy: list[bool] = field(default_factory=list)
    stages: list[str] = field(default_factory=list)
    sent: dict[str, bytes] = field(default_factory=dict)
    shaped: int = 0
    told: list[Exception] = field(default_factory=list)
    refused: int = 0
    rested: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))

    def desk(self) -> Desk:
        return Desk(
            read=lambda: self.state,
            begin=self.begun.append,
            move=self.moved.append,
            busy=self.busy.append,
            progress=lambda stage, _: self.stages.append(stage),
            send=self.sent.__setitem__,
            shaped=self._shape,
            tell=self.told.append,
            refuse=self._refuse,
            changed=self.rested.release,
        )

    def _shape(self) -> None:
        self.shaped += 1

    def _refuse(self) -> None:
        self.refused += 1

    def wait(self) -> None:
        assert self.rested.acquire(timeout=20), "the work did not end"


@pytest.fixture
def tab() -> Tab:
    return Tab()


@pytest.fixture
def work(tab: Tab) -> Iterator[Work]:
    made = Work(Runs(STACK, OPTIONS, RESULT), Source(STACK), RESULT.thresholds, tab.desk())
    yield made
    made.close()


def test_a_shape_is_kept_with_the_result_it_is_of(work: Work, tab: Tab) -> None:
    assert work.recovered is None
    work.recover(Known(), given_lights=True, px_mm=0.5)
    tab.wait()
    assert tab.told == []
    assert tab.shaped == 1
    assert tab.busy == [True, False]
    assert work.recovered is not None
    assert work.recovered.analysis is RESULT
    assert work.recovered.shape.unit == "mm"
    expected = resolve_ambiguity(RESULT)
    assert expected.kind == "lights"
    assert np.array_equal(work.recovered.shape.resolved.matrix, expected.matrix)


def test_the_lights_of_the_stack_are_used_only_when_asked_for(work: Work, tab: Tab) -> None:
    work.recover(Known(), given_lights=False, px_mm=None)
    tab.wait()
    assert work.recovered is not None
    assert work.recovered.shape.resolved.kind == "integrability"


def test_a_shape_while_a_preview_is_shown_is_of_a_run_by_its_thresholds(
    work: Work, tab: Tab
) -> None:
    tab.state = replace(tab.state, T=0.031)
    work.recover(Known(), given_lights=True, px_mm=None)
    tab.wait()
    assert work.recovered is not None
    assert work.recovered.analysis.thresholds == Thresholds(0.031, 0.02)
    assert work.results["robust"] is work.recovered.analysis


def test_without_following_a_shape_is_of_the_result_on_screen(work: Work, tab: Tab) -> None:
    tab.state = replace(tab.state, T=0.031, live=False)
    work.recover(Known(), given_lights=True, px_mm=None)
    tab.wait()
    assert work.recovered is not None
    assert work.recovered.analysis is RESULT


def test_what_does_not_work_is_told_and_the_earlier_shape_kept(work: Work, tab: Tab) -> None:
    work.recover(Known(), given_lights=True, px_mm=None)
    tab.wait()
    earlier = work.recovered
    work.recover(Known((24.0, 32.0, 20.0), ((24, 32), (20, 30))), given_lights=False, px_mm=None)
    tab.wait()
    (error,) = tab.told
    assert isinstance(error, InputError)
    assert "2 points of known normal; at least 4 are needed" in str(error)
    assert work.recovered is earlier
    assert tab.busy[-1] is False


def test_a_cancelled_shape_says_what_is_there(
    work: Work, tab: Tab, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, ended = threading.Event(), threading.Event()

    def hold(*_: object, cancel: object, **__: object) -> None:
        begun.set()
        assert ended.wait(10)
        assert callable(cancel)
        assert cancel()
        raise Cancelled("depth was cancelled")

    monkeypatch.setattr(module, "recover_shape", hold)
    work.recover(Known(), given_lights=True, px_mm=None)
    assert begun.wait(10)
    work.suggest()
    assert tab.refused == 1
    work.stop()
    ended.set()
    tab.wait()
    assert [str(error) for error in tab.told] == ["shape cancelled; there is none"]
    assert (work.recovered, tab.shaped) == (None, 0)


def test_files_of_a_shape_are_those_of_the_command_line(work: Work, tab: Tab) -> None:
    work.recover(Known(), given_lights=True, px_mm=None)
    tab.wait()
    work.download("shape", everything=False, notes="")
    tab.wait()
    assert tab.told == []
    (name,) = tab.sent
    assert name == "sphere_obstacles_shape.zip"
    assert work.recovered is not None
    expected = surface_files(work.recovered.shape, work.recovered.analysis)
    found = unpack(tab.sent[name])
    assert set(found) == {*expected, "result.npz", "report.json"}
    assert "normals_opengl.png" in found
    assert {"normals.tif", "albedo.tif", "depth.tif", "mesh.ply", "lights.lp"} <= set(found)
    assert found["depth.tif"] == expected["depth.tif"]
    assert found["lights.lp"] == expected["lights.lp"]


def test_the_result_in_the_files_of_a_shape_opens_with_it(
    work: Work, tab: Tab, tmp_path: Path
) -> None:
    work.recover(Known(), given_lights=True, px_mm=0.5)
    tab.wait()
    work.download("shape", everything=False, notes="")
    tab.wait()
    write_files(tmp_path, unpack(tab.sent["sphere_obstacles_shape.zip"]))
    assert np.array_equal(load_result(tmp_path).labels, RESULT.labels)
    found = load_shape(tmp_path)
    assert found is not None
    assert work.recovered is not None
    assert np.array_equal(found.normals, work.recovered.shape.normals, equal_nan=True)
    assert found.px_mm == 0.5


def test_normals_for_directx_are_named_so(work: Work, tab: Tab) -> None:
    work.recover(Known(), given_lights=True, px_mm=None)
    tab.wait()
    assert work.recovered is not None
    work.download("shape", everything=False, notes="", convention="directx")
    tab.wait()
    found = unpack(tab.sent["sphere_obstacles_shape.zip"])
    assert found["normals_directx.png"] == normals_png(work.recovered.shape.normals, "directx")
    assert "normals_opengl.png" not in found


def test_files_of_a_shape_have_the_colour_of_the_stack_s_files(tab: Tab, tmp_path: Path) -> None:
    source, result = colour_source(tmp_path)
    work = Work(Runs(source.stack, OPTIONS, result), source, result.thresholds, tab.desk())
    work.recover(Known(), given_lights=False, px_mm=None)
    tab.wait()
    work.download("shape", everything=False, notes="")
    tab.wait()
    assert tab.told == []
    (data,) = tab.sent.values()
    albedo = tifffile.imread(io.BytesIO(unpack(data)["albedo.tif"]))
    assert albedo.shape == (48, 64, 3)
    lit = np.isfinite(albedo).all(axis=2) & (albedo[..., 0] > 0.05)
    assert np.median(albedo[lit][:, 1] / albedo[lit][:, 0]) == pytest.approx(0.5, rel=1e-3)


def colour_source(folder: Path) -> tuple[Source, Analysis]:
    """A stack that is half as green as it is red, and its result."""
    for k, image in enumerate(STACK.images):
        planes = [np.round(share * image * 65535) for share in (1, 0.5, 0.25)]
        pixels = np.stack(planes, axis=-1).astype(np.uint16)
        (folder / f"{k}.png").write_bytes(imagecodecs.png_encode(pixels))
    source = Source(load_stack(folder), path=folder)
    return source, analyze(source.stack, OPTIONS)


def unpack(data: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_a_shape_that_came_with_the_result_is_there_at_once(work: Work, tab: Tab) -> None:
    work.recover(Known(), given_lights=True, px_mm=None)
    tab.wait()
    assert work.recovered is not None
    source = Source(STACK, RESULT, shape=work.recovered.shape)
    again = Work(Runs(STACK, OPTIONS, RESULT), source, RESULT.thresholds, tab.desk())
    assert again.recovered is not None
    assert again.recovered.shape is source.shape
    assert again.recovered.analysis is RESULT
    fewer = Work(Runs(STACK, OPTIONS), source, RESULT.thresholds, tab.desk())
    assert fewer.recovered is None


def test_what_is_asked_for_while_a_shape_is_recovered_follows_it_and_only_the_latest(
    work: Work, tab: Tab, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, ended, scales = threading.Semaphore(0), threading.Semaphore(0), []

    def hold(*arguments: Any, px_mm: float, **options: Any) -> Shape:
        scales.append(px_mm)
        begun.release()
        assert ended.acquire(timeout=10)
        return recover_shape(*arguments, px_mm=px_mm, **options)

    monkeypatch.setattr(module, "recover_shape", hold)
    for px_mm in (1.0, 2.0, 3.0):
        work.recover(Known(), given_lights=True, px_mm=px_mm)
        if px_mm == 1:
            assert begun.acquire(timeout=10)
    assert tab.refused == 0
    ended.release()
    tab.wait()
    work.ensure(tab.state)  # as a tab does whenever something is to be drawn
    assert begun.acquire(timeout=10)
    ended.release()
    tab.wait()
    work.ensure(tab.state)
    assert scales == [1.0, 3.0]
    assert work.recovered is not None
    assert work.recovered.shape.px_mm == 3.0


def test_cancelling_forgets_what_waits_too(
    work: Work, tab: Tab, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, ended = threading.Event(), threading.Event()

    def hold(*_: object, **__: object) -> None:
        begun.set()
        assert ended.wait(10)
        raise Cancelled("depth was cancelled")

    monkeypatch.setattr(module, "recover_shape", hold)
    work.recover(Known(), given_lights=True, px_mm=None)
    assert begun.wait(10)
    work.recover(Known(), given_lights=True, px_mm=None)
    work.stop()
    ended.set()
    tab.wait()
    work.ensure(tab.state)
    assert tab.busy == [True, False]


def test_files_of_a_shape_that_is_not_there_are_refused_with_the_way_to_it(
    work: Work, tab: Tab
) -> None:
    work.download("shape", everything=True, notes="")
    tab.wait()
    assert tab.sent == {}
    (error,) = tab.told
    assert isinstance(error, OptionError)
    assert str(error) == "there is no shape yet; recover one in the tab Shape (key: N)"


def test_without_a_result_there_is_nothing_to_recover_from(tab: Tab) -> None:
    work = Work(Runs(STACK, OPTIONS), Source(STACK), RESULT.thresholds, tab.desk())
    work.recover(Known(), given_lights=True, px_mm=None)
    tab.wait()
    assert [str(e) for e in tab.told] == ["there is no result yet; linearize first"]


def test_the_first_result_moves_sliders_that_nobody_has_touched(tab: Tab) -> None:
    tab.state = ViewState(T=0.07, Ts=0.03)
    work = Work(Runs(STACK, OPTIONS), Source(STACK), Thresholds(0.07, 0.03), tab.desk())
    work.ensure(tab.state)
    tab.wait()
    assert tab.begun == [work.results["robust"].thresholds]
    work.ensure(tab.state)
    work.linearize()
    tab.wait()
    assert work.results["robust"].thresholds == Thresholds(0.07, 0.03)
    assert len(tab.begun) == 1
    assert tab.moved == []


def test_a_method_that_failed_is_tried_again_once_thresholds_are_suggested(
    work: Work, tab: Tab, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Options] = []

    def fail(options: Options, *_: object) -> Analysis:
        asked.append(options)
        raise DegenerateError("T is too small")

    monkeypatch.setattr(work._runs, "run", fail)
    state = replace(tab.state, method="classification")
    work.ensure(state)
    tab.wait()
    assert len(asked) == len(tab.told) == 1
    work.ensure(state)
    work.suggest()
    tab.wait()
    assert len(tab.moved) == len(asked) == 1  # not tried again unasked
    work.ensure(state)
    tab.wait()
    assert len(asked) == 2


def test_a_cancelled_stage_is_told_as_what_the_user_began() -> None:
    expected = f"^linearization cancelled; {EMPTY}$"
    with pytest.raises(Cancelled, match=expected), cancelling("linearization", EMPTY):
        raise Cancelled("coefficients was cancelled")


class Slow(dict[str, object]):
    """While it is copied, something else happens."""

    def __init__(self, meanwhile: threading.Thread) -> None:
        self._meanwhile = meanwhile

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def keys(self):  # type: ignore[override]
        self._meanwhile.start()
        self._meanwhile.join(0.2)
        return super().keys()


def test_results_that_arrive_at_once_are_all_kept(work: Work, monkeypatch) -> None:
    other = threading.Thread(target=lambda: work.deliver("statistical", RESULT))
    monkeypatch.setattr(work, "_results", Slow(other))
    work.deliver("classification", RESULT)
    other.join(5)
    assert set(work.results) == {"classification", "statistical"}


@pytest.mark.parametrize("what", ["recover", "suggest"])
def test_what_ends_after_others_have_taken_over_moves_nothing(
    work: Work, tab: Tab, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    def close_and_go_on(*asked: object, **named: object) -> object:
        work.close()  # its last look at whether to stop is over
        return None

    monkeypatch.setattr(module, "recover_shape", close_and_go_on)
    monkeypatch.setattr(Runs, "suggest", close_and_go_on)
    if what == "suggest":
        work.suggest()
    else:
        work.recover(Known(), given_lights=True, px_mm=None)
    tab.wait()
    assert (tab.moved, tab.shaped, tab.told) == ([], 0, [])


@pytest.mark.parametrize("kind", ["labels", "shape"])
def test_files_that_do_not_come_as_others_have_taken_over_are_told_of(
    work: Work, tab: Tab, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    def close_and_go_on(*asked: object) -> tuple[str, bytes]:
        work.close()
        return "name", b"data"

    work.recover(Known(), given_lights=True, px_mm=None)
    tab.wait()
    monkeypatch.setattr(module, "make_download", close_and_go_on)
    monkeypatch.setattr(module, "make_shape_download", close_and_go_on)
    work.download(kind, everything=True, notes="")
    tab.wait()
    (error,) = tab.told
    assert str(error) == "export cancelled, as other images are left out; nothing was saved"
    assert tab.sent == {}
