"""What computes for a tab, and how another selection of images takes its place."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from test_work import OPTIONS, RESULT, STACK, Tab

from photolin.errors import OptionError
from photolin.load.exclude import exclude_images
from photolin.pipeline import analyze
from webapp.bench import Bench
from webapp.selections import Selections
from webapp.source import Source


@pytest.fixture
def tab() -> Tab:
    return Tab()


@pytest.fixture
def bench(tab: Tab) -> Iterator[Bench]:
    made = Bench(Selections(Source(STACK, RESULT, OPTIONS)), (), RESULT.thresholds, tab.desk())
    yield made
    made.close()


def test_without_an_image_it_linearizes_what_is_left_by_T_and_Ts_as_they_stand(
    bench: Bench, tab: Tab
) -> None:
    tab.state = replace(tab.state, T=0.033, Ts=0.017)
    bench.select((2,))
    assert bench.work.results == {}
    bench.work.ensure(tab.state)
    tab.wait()
    left = exclude_images(STACK, [2])
    expected = analyze(left, replace(OPTIONS, T=0.033, Ts=0.017))
    assert np.array_equal(bench.work.results["robust"].labels, expected.labels)
    assert tab.begun == []  # sliders stay where they are
    bench.select(())
    assert bench.work.results == {"robust": RESULT}


def test_before_the_first_result_thresholds_are_still_suggested(tab: Tab) -> None:
    free = replace(OPTIONS, T=None, Ts=None)
    made = Bench(Selections(Source(STACK, None, free)), (), tab.state.thresholds, tab.desk())
    made.select((2,))
    made.work.ensure(tab.state)
    tab.wait()
    assert tab.begun == [made.work.results["robust"].thresholds]
    made.close()


def test_what_ran_for_other_images_says_nothing_any_more(bench: Bench, tab: Tab) -> None:
    old = bench.work
    bench.suggest()
    bench.select((1,))
    assert old is not bench.work
    old.linearize()
    assert tab.refused == 1  # nothing is started any more
    bench.stop()
    assert tab.told == []
    assert tab.busy[-1] is False


def test_too_few_images_are_refused_and_all_stays(bench: Bench) -> None:
    work = bench.work
    with pytest.raises(OptionError, match="leaves 5 of 9 images"):
        bench.select((0, 1, 2, 3))
    assert bench.work is work
    assert bench.runs.excluded == ()
