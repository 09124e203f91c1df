"""Traces of recordings, those that a page shows, and steady tables put together."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import GIVEN, campaign, planted, steady_table
from drawn_traces import all_traces, poor_and_whole
from rigs import arm
from standings import benchmark_of

import nnhydro
from nnhydro.evaluation.benchmark_result import Standing
from nnhydro.evaluation.protocols.protocol import Fold, Split
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.splitting import units
from nnhydro.report.widgets.trace import (
    BASELINE,
    CORRECTED,
    Trace,
    benchmark_traces,
    bin_edges,
    by_change,
    diagnosis_traces,
    spread,
    traces_of,
    with_whole_tables,
)


def test_many_recordings_are_thinned_evenly():
    names = [f"r{i}" for i in range(1000)]
    assert spread(names[:5]) == names[:5]
    chosen = spread(names, 50)
    assert len(chosen) == 50
    assert (chosen[0], chosen[-1]) == ("r0", "r999")


def test_the_error_is_of_the_compared_rows_and_what_is_left_is_measured_minus_modelled():
    c, whole, poor = poor_and_whole()
    trace = all_traces(c, whole=whole, poor=poor)[0]
    assert trace.error("whole") < 1e-9
    np.testing.assert_array_equal(trace.residual("poor"), trace.tau - trace.models["poor"])
    keep, tau = trace.segment.keep.copy(), trace.models["whole"].copy()
    keep[:9], tau[:9] = False, 1e3
    off = replace(trace, segment=replace(trace.segment, keep=keep), models={"whole": tau})
    assert off.error("whole") < 1e-9, "rows that are not compared do not count"


def test_of_a_machine_that_nothing_drives_the_residual_is_told_in_newton_metres():
    c, whole, poor = poor_and_whole()
    trace = all_traces(c, whole=whole, poor=poor)[0]
    assert trace.error_text("poor") == f"{100 * trace.error('poor'):.1f} %"
    free = replace(trace, segment=replace(trace.segment, tau=0 * trace.tau), models={"whole": np.full_like(trace.tau, -0.25)})
    assert free.error_text("whole") == "0.25 N m"
    axis = replace(free, segment=replace(free.segment, sliding=True))
    assert axis.error_text("whole") == "0.25 N"


def test_a_segment_without_torques_or_compared_rows_has_no_trace():
    c, whole, _ = poor_and_whole()
    (segment,) = c.segments(c.names[0], GIVEN)
    kept_none = replace(segment, keep=np.zeros_like(segment.keep))
    assert traces_of("one", [replace(segment, tau=None), kept_none], {"whole": whole}) == []


def test_the_change_to_a_simulation_outside_is_shown_with_that_simulation():
    c, whole, poor = poor_and_whole()
    change = CorrectedSimulation(c.arm, GIVEN, {}, None, poor, whole)
    (segment,) = c.segments(c.names[0], GIVEN)
    outside = all_traces(c, poor=poor)[0].models["poor"]
    (trace,) = traces_of("one", [replace(segment, tau_sim=outside)], {"changed": change})
    assert trace.error("changed") < 1e-9


def test_bunches_of_a_steady_table_are_put_together_and_stand_last():
    a = arm()
    model = {"m": StripTheory(a, GIVEN, {}, "m", planted(a))}
    table, c = steady_table(a, planted(a)), campaign(a, planted(a), count=1)
    (whole,) = traces_of("tows", nnhydro.Campaign.of(a, [], (table,)).steady_segments(), model)
    halves = [Trace(f"tows#{k}", of_rows(whole.segment, rows), {"m": whole.models["m"][rows]})
              for k, rows in enumerate((slice(0, 15), slice(15, None)))]
    moving = traces_of("run0", c.segments("run0", GIVEN), model)
    first, joined = with_whole_tables([*halves, *moving])
    assert (first.recording, joined.recording) == ("run0", "tows")
    np.testing.assert_array_equal(joined.tau, whole.tau)
    np.testing.assert_array_equal(joined.models["m"], whole.models["m"])


def of_rows(segment, rows):
    """Some rows of a steady segment."""
    names = ("t", "q", "qd", "qdd", "u0", "du0", "tau", "keep")
    return replace(segment, **{name: getattr(segment, name)[rows] for name in names})


def test_what_the_correction_helps_most_stands_first():
    c, whole, poor = poor_and_whole()
    c = nnhydro.Campaign.of(c.arm, list(c.recordings()), (steady_table(c.arm, planted(c.arm)),))
    traces = by_change(diagnosis_traces(c, poor, whole))
    gains = [trace.error(BASELINE) - trace.error(CORRECTED) for trace in traces[:-1]]
    assert gains == sorted(gains, reverse=True)
    assert gains[-1] > 0
    assert [trace.recording for trace in traces][-1] == "tows"


def test_edges_of_bins_leave_out_the_far_ends_and_never_meet():
    edges = bin_edges(np.r_[np.linspace(0, 1, 1001), 500.0], 10, 0.01)
    assert len(edges) == 11
    assert (edges[0], edges[-1]) == pytest.approx((0.01, 0.99), abs=2e-3)
    assert (np.diff(bin_edges(np.full(9, 3.0), 4, 0.0)) > 0).all()


def test_a_recording_that_is_held_out_twice_is_shown_by_the_last_fold_s_model():
    c, whole, poor = poor_and_whole()
    held_out = tuple(units(c, GIVEN))
    twice = Split(held_out, (Fold("first", (1, 2), (0,)), Fold("second", (1,), (0, 2))))
    result = replace(benchmark_of(split=twice), standings={"m": Standing("m", [{}, {}], 0.0, [poor, whole])})
    assert [trace.error("m") < 1e-9 for trace in benchmark_traces(result, [held_out[0].name])] == [True]
