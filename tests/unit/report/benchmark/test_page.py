"""What the page of a benchmark orders and colours: the worst recording first, the darkest cell where the error is largest."""

import pytest
from standings import benchmark_of

from nnhydro.report.benchmark.page import _by_recording, _models_mapped


def table(**errors):
    """The rows of the table of recordings, {recording: [(model, error, place on the colour scale)]}."""
    result = benchmark_of(**errors)
    rows = _by_recording(result, result.document()["models"])
    assert all(picture == unit for unit, picture, _ in rows)
    return {unit: cells for unit, _, cells in rows}


def test_the_recording_that_the_best_model_predicts_worst_stands_first():
    assert list(table(constant=(0.3, 0.2, 0.4), hybrid=(0.1, 0.3, 0.02))) == ["b", "a", "c"]


def test_colours_end_at_the_largest_error_but_never_above_the_whole_torque():
    made = table(constant=(0.4, 0.2, 0.2), hybrid=(0.1, 0.3, 0.02))
    assert made["a"] == [("hybrid", pytest.approx(0.1), pytest.approx(0.25)), ("constant", pytest.approx(0.4), 1.0)]
    beyond = table(constant=(7.0, 0.2, 0.2), hybrid=0.5)
    assert [place for _, _, place in beyond["a"]] == [0.5, 1.0]
    assert [place for cells in table(constant=0.0).values() for _, _, place in cells] == [0.0, 0.0, 0.0]


def test_the_residual_is_mapped_of_the_best_and_of_the_best_physics():
    assert _models_mapped(benchmark_of(hybrid=0.1, network=0.2, constant=0.3, rigid=0.4)) == ["hybrid", "constant"]
    assert _models_mapped(benchmark_of(hybrid=0.5, constant=0.3, rigid=0.4)) == ["constant"]
    assert _models_mapped(benchmark_of(hybrid=0.5)) == ["hybrid"]
