"""Curves of a page lie where its script reads them, and keep their gaps."""

import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
from campaigns import GIVEN, planted, steady_table
from drawn_traces import all_traces, poor_and_whole
from rigs import arm

import nnhydro
from nnhydro.models.strip_theory import StripTheory
from nnhydro.report.figure_file import POINT
from nnhydro.report.torque_panels import panels
from nnhydro.report.widgets.history import histories
from nnhydro.report.widgets.trace import traces_of


def test_a_steady_table_is_drawn_against_what_it_varies_and_nothing_else():
    a = arm()
    table = steady_table(a, planted(a))
    c = nnhydro.Campaign.of(a, [], (table,))
    (trace,) = traces_of("tows", c.steady_segments(), {"m": StripTheory(a, GIVEN, {}, "m", planted(a))})
    drawn = histories([trace], {"m": 0}, ["m"])
    assert [h.label for h in drawn] == ["tows against towing speed", "tows against angle of joint 1", "tows against angle of joint 2"]
    assert trace.error("m") < 1e-9
    for picture, name in zip(drawn, ("towing speed [m/s]", "angle of joint 1 [rad]", "angle of joint 2 [rad]"), strict=True):
        marks = [len(list(group.iter("use"))) for group in ET.fromstring(picture.drawing).iter("g") if group.get("data-curve")]
        assert marks == [len(trace.segment)] * 6, "a mark a run: measured and modelled torque and the residual, of each joint"
        assert name in texts_of(picture.drawing)
        assert {"measured", "m"} <= set(texts_of(picture.drawing)), "the legend says which mark is whose"


def texts_of(drawing):
    return [text.text for text in ET.fromstring(drawing).iter() if text.tag.endswith("text")]


def points_of(path):
    """The corners of a page's path: M x y, then steps."""
    found = []
    for part in path.get("d").split("M")[1:]:
        numbers = np.array(re.findall(r"-?[\d.]+", part), dtype=float).reshape(-1, 2)
        found.append(np.cumsum(numbers, axis=0))
    return found


def test_a_page_s_script_finds_each_curve_its_panel_and_the_scales():
    c, whole, poor = poor_and_whole()
    traces = all_traces(c, whole=whole, poor=poor)
    drawn = histories(traces, {"whole": 0, "poor": 1}, ["whole", "poor"])
    assert [picture.recording for picture in drawn] == [trace.recording for trace in traces]
    for picture, trace in zip(drawn, traces, strict=True):  # all but the first were drawn into the frame of the first
        root, shown = ET.fromstring(picture.drawing), panels(trace, ["whole", "poor"])
        scales = json.loads(root.get("data-panels"))
        curves = {(int(g.get("data-curve")), g.get("data-series")): g for g in root.iter("g") if g.get("data-curve")}
        assert set(curves) == {(k, name) for k, panel in enumerate(shown) for name in panel.curves}
        for k, (panel, (label, left, right, start, stop, bottom, top, low, high)) in enumerate(zip(shown, scales, strict=True)):
            assert label == panel.label
            np.testing.assert_allclose([low, high, start, stop], [*panel.limits, trace.segment.t[0], trace.segment.t[-1]], rtol=1e-4)
            for name, curve in panel.curves.items():
                (points,) = points_of(next(iter(curves[k, name].iter("path"))))
                wanted = np.column_stack([left + (trace.segment.t - start) / (stop - start) * (right - left),
                                          bottom - (curve - low) / (high - low) * (bottom - top)])
                assert max(distance(point, points) for point in wanted) < 2 / POINT


def distance(point, line):
    """Of a point from a line of corners."""
    first, step = line[:-1], np.diff(line, axis=0)
    along = np.clip(((point - first) * step).sum(axis=1) / np.maximum((step**2).sum(axis=1), 1e-12), 0, 1)
    return np.hypot(*(point - first - along[:, None] * step).T).min()


def test_a_gap_in_a_curve_stays_a_gap():
    c, whole, poor = poor_and_whole()
    trace = all_traces(c, whole=whole, poor=poor)[0]
    broken = trace.models["poor"].copy()
    broken[100:120] = np.nan
    (picture,) = histories([replace(trace, models={**trace.models, "poor": broken})], {"whole": 0, "poor": 1}, ["whole", "poor"])
    for group in (g for g in ET.fromstring(picture.drawing).iter("g") if g.get("data-curve")):
        assert len(points_of(next(iter(group.iter("path"))))) == (2 if group.get("data-series") == "poor" else 1)
