"""The pictures of a benchmark hold the numbers of its document."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from standings import SPLIT, benchmark_of

from nnhydro.evaluation.interval_coverage import Coverage
from nnhydro.report.benchmark.figures import (
    coverage_shares,
    error_figure,
    learning_curves,
    reliability_figure,
    shown_models,
    typical_recordings,
)
from nnhydro.report.figure_file import save_figure


def test_the_reliability_curve_is_drawn_from_the_shares_of_each_model(tmp_path):
    covered = {"hybrid": {"50": 0.48, "90": 0.93}, "network": {"50": 0.5, "90": 0.9}}
    paths = save_figure(reliability_figure(covered), tmp_path / "reliability")
    rows = list(csv.DictReader(paths[2].read_text().splitlines()))
    assert [(float(r["x"]), float(r["y"])) for r in rows if r["series"] == "hybrid"] == [(50, 48), (90, 93)]
    assert [(float(r["x"]), float(r["y"])) for r in rows if r["series"] == "honest"] == [(0, 0), (100, 100)]


def test_the_worst_the_median_and_the_best_recording_are_drawn_each_once():
    assert typical_recordings(benchmark_of(constant=(0.1, 0.4, 0.2)), "constant") == {"worst": "b", "median": "c", "best": "a"}
    single = replace(SPLIT, units=(SPLIT.units[0], *(replace(unit, steady=True) for unit in SPLIT.units[1:])))
    assert typical_recordings(benchmark_of(split=single, constant=0.1), "constant") == {"worst": "a"}


def test_at_most_three_models_have_a_line_the_best_physics_among_them():
    assert shown_models(benchmark_of(hybrid=0.1, network=0.2, constant=0.3, rigid=0.4)) == ["hybrid", "constant", "network"]
    assert shown_models(benchmark_of(hybrid=0.4, constant=0.1, rigid=0.2, network=0.3)) == ["constant", "rigid", "network"]


def test_errors_and_the_noise_floor_lie_at_their_per_cent():
    (axes,) = error_figure(benchmark_of(floor=0.01, constant=0.3, hybrid=0.1)).axes
    dots = [line.get_xydata()[0].tolist() for line in axes.lines if line.get_marker() == "o"]
    assert dots == [pytest.approx([30, 0]), pytest.approx([10, 1])], "the best on top"
    assert [text.get_text() for text in axes.get_yticklabels()] == ["constant", "hybrid"]
    assert axes.lines[-1].get_xdata() == pytest.approx([1, 1])


def test_the_learning_curve_has_the_error_of_each_fold_over_what_it_fits():
    (axes,) = learning_curves(benchmark_of(floor=0.01, constant=(0.3, 0.1, 0.3))).axes
    assert axes.lines[0].get_xydata().tolist() == [pytest.approx([2, 30]), pytest.approx([1, 20])]
    assert axes.lines[1].get_ydata() == pytest.approx([1, 1])


def test_shares_are_drawn_of_the_models_that_have_intervals():
    result = benchmark_of(constant=0.3, hybrid=0.1)
    result.standings["hybrid"].coverage = [Coverage(np.array([2.0, 3.0, 4.0]), 4, 2.0, 4.0)]
    assert list(coverage_shares(result)) == ["hybrid"]
    assert list(coverage_shares(result)["hybrid"].values()) == [0.5, 0.75, 1.0]
