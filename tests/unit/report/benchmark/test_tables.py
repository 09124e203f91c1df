"""The sheets of a benchmark: best first, the noise floor last, the worst recording first, and what each model knows of its error."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import campaign, planted
from rigs import arm
from standings import benchmark_of

from nnhydro.evaluation.interval_coverage import Coverage
from nnhydro.evaluation.protocols.protocol import DEFAULT
from nnhydro.report.benchmark.tables import PERFECT, benchmark_sheets, coverage_sheet, folds_sheet, models_sheet, recordings_sheet

ARM = arm(1)


@pytest.fixture
def result():
    """Two models; the better one, hybrid, is worst on the recording b."""
    recorded = (campaign(ARM, planted(ARM), count=1, seconds=0.5),)
    return benchmark_of(recorded, DEFAULT, floor=0.01, constant=(0.3, 0.2, 0.4), hybrid=(0.1, 0.3, 0.02))


def column(sheet, heading):
    """The raw values under a heading."""
    (found,) = [list(c.values) for c in sheet.columns if c.heading == heading]
    return found


def test_the_models_stand_best_first_and_a_perfect_one_last(result):
    sheet = models_sheet(result, result.document())
    assert column(sheet, "model") == ["hybrid", "constant", PERFECT]
    assert column(sheet, "error") == pytest.approx([0.14, 0.3, 0.01])
    assert column(sheet, "95 % interval")[2] is None
    assert sheet.title == "Held-out torque error: 3 recordings, each held out once in 2 folds"
    assert column(models_sheet(result, result.document(), perfect=False), "model") == ["hybrid", "constant"]
    assert column(models_sheet(replace(result, noise_floor=None), result.document()), "model") == ["hybrid", "constant"]


def test_the_worst_recording_of_the_best_model_stands_first(result):
    sheet = recordings_sheet(result, result.document())
    assert column(sheet, "recording") == ["b", "a", "c"]
    assert column(sheet, "hybrid") == pytest.approx([0.3, 0.1, 0.02])
    assert column(sheet, "constant") == pytest.approx([0.2, 0.3, 0.4])


def test_each_fold_has_a_column_and_is_shown_where_folds_differ_in_kind(result):
    sheet = folds_sheet(result)
    assert sheet.headings() == ["model", "first", "second"]
    assert column(sheet, "second") == pytest.approx([0.16, 0.3])
    assert sheet.title == "Error by what is held out"
    curve = replace(result, split=replace(result.split, curve=True))
    assert folds_sheet(curve).title == "Error against the number of recordings fitted"
    assert len(benchmark_sheets(result)) == 1
    assert len(benchmark_sheets(replace(result, protocol="leave-kind-out"))) == 2


def test_intervals_are_told_of_the_models_that_have_some(result):
    assert coverage_sheet(result, result.document()) is None
    result.standings["hybrid"].coverage = [Coverage(np.array([2.0, 3.0, 4.0]), 4, 2.0, 4.0)]
    result.standings["hybrid"].fitted_coverage = [Coverage(np.array([2.0, 3.0, 4.0]), 4, 1.0, 4.0)]
    sheet = coverage_sheet(result, result.document())
    assert column(sheet, "model") == ["hybrid"]
    assert [c.cells()[0] for c in sheet.columns if c.heading.startswith("of ")] == ["50%", "75%", "100%"]
    assert (column(sheet, "std"), column(sheet, "wider")) == ([0.5], [2.0])
    assert benchmark_sheets(result)[-1].title == sheet.title
