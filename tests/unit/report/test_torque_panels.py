"""Torque against time: no peak is lost, ends that nothing compares are shaded, curves differ in grey, limits hold what is drawn."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_traces import all_traces, poor_and_whole

from nnhydro.report.figure_file import MARKS, STYLES
from nnhydro.report.torque_panels import MEASURED, panels, shaded_ends, thin, torque_figure, torque_file


def test_thinning_keeps_every_peak():
    y = np.zeros(10_000)
    y[[777, 5003]] = 1.0, -1.0
    x = np.arange(10_000.0)
    a, b = thin(x, y, 200)
    assert len(a) <= 200
    assert {(777.0, 1.0), (5003.0, -1.0)} <= set(zip(a, b, strict=True))
    assert (np.diff(a) > 0).all()


def with_wild_ends(trace, rows=20):
    """The trace with rows at both ends that are not compared, at which the models are far off."""
    keep, tau = trace.segment.keep.copy(), trace.models["poor"].copy()
    keep[:rows], keep[-rows:], tau[:rows] = False, False, 100.0
    return replace(trace, segment=replace(trace.segment, keep=keep), models={**trace.models, "poor": tau})


def test_the_picture_of_a_recording_has_labels_with_units_limits_and_shaded_ends():
    c, whole, poor = poor_and_whole()
    trace = with_wild_ends(all_traces(c, whole=whole, poor=poor)[0])
    figure = torque_file(trace, {"whole": "whole (0 %)", "poor": "poor (50 %)"}, "one")
    *shown, behind = figure.axes
    labels = ["torque 1 [N m]", "residual 1 [N m]", "torque 2 [N m]", "residual 2 [N m]"]
    assert [ax.get_ylabel().replace("\n", " ") for ax in shown] == labels
    assert behind.get_xlabel() == "time [s]"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["measured", "whole (0 %)", "poor (50 %)"]
    assert figure.get_suptitle() == "one"
    for ax, panel in zip(shown, panels(trace, ["whole", "poor"]), strict=True):
        assert ax.get_ylim() == panel.limits
        lines = [line for line in ax.lines if not line.get_label().startswith("_")]
        assert [line.get_label().split(" (")[0] for line in lines] == list(panel.curves)
        for line, curve in zip(lines, panel.curves.values(), strict=True):
            np.testing.assert_array_equal(line.get_xydata(), np.column_stack([trace.segment.t, curve]))
    t, compared = trace.segment.t, trace.segment.t[trace.segment.keep]
    ends = [(t[0], compared[0]), (compared[-1], t[-1])]
    assert shaded_ends(trace.segment) == ends, "the rows before and after those compared"
    assert [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in behind.patches] == [pytest.approx(end) for end in ends]
    assert shown[0].get_ylim()[1] > 100, "no curve leaves its frame, shaded or not"


def test_curves_and_marks_can_be_told_apart_in_grey():
    c, whole, poor = poor_and_whole()
    trace = all_traces(c, whole=whole, poor=poor)[0]
    lines = torque_figure(trace, {"whole": 0, "poor": 1}).axes[0].lines
    assert len({(line.get_linestyle(), line.get_linewidth()) for line in lines}) == len(lines)
    assert lines[0].get_label() == MEASURED, "the models lie on top of it"
    assert len({str(style["linestyle"]) for style in STYLES}) == len({mark["marker"] for mark in MARKS}) == len(STYLES)


def test_a_panel_s_limits_hold_all_rows_of_the_models_shown_first():
    c, whole, poor = poor_and_whole()
    trace = all_traces(c, whole=whole, poor=poor)[0]
    whole_only, both = (panels(trace, ["whole", "poor"], first) for first in (["whole"], []))
    for narrow, wide in zip(whole_only, both, strict=True):
        inside = np.concatenate(list(wide.curves.values()))
        assert wide.limits[0] < inside.min()
        assert wide.limits[1] > inside.max()
        assert np.ptp(narrow.limits) < np.ptp(wide.limits) or not narrow.residual
    of_another = panels(trace, ["whole", "poor"], ["no model of this picture"])
    assert [panel.limits for panel in of_another] == [panel.limits for panel in both], "where none of them is drawn, all count"
