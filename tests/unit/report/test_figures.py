"""Figures on disk: PNG and SVG of the same picture, what is drawn beside them as CSV; what the pages compute agrees with the data."""

import csv
import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from campaigns import GIVEN, campaign, planted, steady_table
from rigs import arm

import nnhydro
from nnhydro.diagnosis.findings.finding import Finding
from nnhydro.effects.catalogue import candidates, catalogue
from nnhydro.effects.effect import LoadEffect
from nnhydro.models.strip_theory import StripTheory
from nnhydro.report.benchmark.figures import reliability_figure
from nnhydro.report.diagnosis.figures import diagnosis_figures, laws_of, map_figure
from nnhydro.report.diagnosis.finding_law import law_of
from nnhydro.report.figure_file import MARKS, POINT, STYLES, new_figure, page_figure, save_figure
from nnhydro.report.torque_panels import MEASURED, panels, shaded_ends, thin, torque_figure, torque_file
from nnhydro.report.widgets.history import histories
from nnhydro.report.widgets.residual_map import residual_maps, shade
from nnhydro.report.widgets.trace import BASELINE, diagnosis_traces, spread, traces_of


def test_a_figure_lies_there_as_png_svg_and_exactly_what_it_draws(tmp_path):
    x = np.linspace(0, 1, 7)
    figure = new_figure(3, 2)
    axes = figure.subplots()
    axes.plot(x, x**2, label="a curve")
    axes.bar([1, 2], [0.3, 0.4], label="bars")
    axes.set(xlabel="time [s]", ylabel="torque [N m]")
    paths = save_figure(figure, tmp_path / "one")
    assert [p.name for p in paths] == ["one.png", "one.svg", "one.csv"]
    assert paths[0].read_bytes()[:4] == b"\x89PNG"
    assert ET.parse(paths[1]).getroot().tag.endswith("svg")
    assert "torque [N m]" in paths[1].read_text(), "text in the SVG stays text"
    rows = list(csv.DictReader(paths[2].read_text().splitlines()))
    curve = [(float(r["x"]), float(r["y"])) for r in rows if r["series"] == "a curve"]
    np.testing.assert_allclose(curve, np.column_stack([x, x**2]), rtol=1e-8)
    assert [float(r["y"]) for r in rows if r["series"] == "bars"] == [0.3, 0.4]
    assert {(r["x_label"], r["y_label"]) for r in rows} == {("time [s]", "torque [N m]")}
    again = save_figure(figure, tmp_path / "two")
    assert again[1].read_bytes() == paths[1].read_bytes(), "the same figure gives the same file"


def test_a_figure_that_cannot_be_drawn_leaves_the_old_files_and_nothing_else(tmp_path, monkeypatch):
    figure = new_figure(3, 2)
    figure.subplots().plot([0, 1], [0, 1])
    before = {path.name: path.read_bytes() for path in save_figure(figure, tmp_path / "one")}
    drawn = figure.savefig

    def fails(file, **how):
        drawn(file, **how)
        if how["format"] == "svg":
            raise KeyboardInterrupt

    monkeypatch.setattr(figure, "savefig", fails)
    figure.axes[0].plot([0, 1], [1, 0])
    with pytest.raises(KeyboardInterrupt):
        save_figure(figure, tmp_path / "one")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_page_shows_the_drawing_of_the_file_in_the_colours_of_its_theme_and_every_id_once():
    figure = new_figure(3, 2)
    axes = figure.subplots()
    axes.plot([0, 1], [0, 2], "o", color="#D55E00", label="a curve")
    axes.plot([0, 1], [1, 1], color="#111111")
    axes.set(xlabel="time & more [s]")
    one, two = page_figure(figure, 'the "first"'), page_figure(figure, "the second")
    root = ET.fromstring(one)
    assert root.attrib["aria-label"] == 'the "first"'
    assert "time & more [s]" in [text.text for text in root.iter() if text.tag.endswith("text")]
    assert "var(--c0)" in one
    assert not re.search("#d55e00|#111111|#000000|<style", one)
    ids = re.findall(r'\bid="([^"]+)"', one + two)
    assert len(ids) == len(set(ids)) > 0
    assert set(re.findall(r'(?:href="#|url\(#)([^")]+)', one + two)) <= set(ids)


def test_the_reliability_curve_is_drawn_from_the_shares_of_each_model(tmp_path):
    covered = {"hybrid": {"50": 0.48, "90": 0.93}, "network": {"50": 0.5, "90": 0.9}}
    paths = save_figure(reliability_figure(covered), tmp_path / "reliability")
    rows = list(csv.DictReader(paths[2].read_text().splitlines()))
    assert [(float(r["x"]), float(r["y"])) for r in rows if r["series"] == "hybrid"] == [(50, 48), (90, 93)]
    assert [(float(r["x"]), float(r["y"])) for r in rows if r["series"] == "honest"] == [(0, 0), (100, 100)]


def test_thinning_keeps_every_peak():
    y = np.zeros(10_000)
    y[[777, 5003]] = 1.0, -1.0
    x = np.arange(10_000.0)
    a, b = thin(x, y, 200)
    assert len(a) <= 200
    assert {(777.0, 1.0), (5003.0, -1.0)} <= set(zip(a, b, strict=True))
    assert (np.diff(a) > 0).all()


def poor_and_whole():
    """A campaign, its true model and one with half the drag."""
    a = arm()
    c = campaign(a, planted(a), count=3)
    whole = StripTheory(a, GIVEN, {}, "whole", planted(a))
    return c, whole, StripTheory(a, GIVEN, {}, "poor", planted(a, C_D=(0.45, 0.65)))


def all_traces(c, **models):
    return [t for name in c.names for t in traces_of(name, c.segments(name, GIVEN), models)]


def test_the_residual_map_adds_up_to_the_residual():
    c, whole, poor = poor_and_whole()
    traces = all_traces(c, whole=whole, poor=poor)
    maps = {m.key: m for m in residual_maps(traces, ["whole", "poor"])}
    for joint in (0, 1):
        truth = sum(float((t.residual("poor")[t.segment.keep, joint] ** 2).sum()) for t in traces)
        panel = maps[f"{joint + 1}|when|poor"]
        cells = [cell for row in panel.cells for cell in row if cell is not None]
        assert sum(cell.rms**2 * cell.rows for cell in cells) == pytest.approx(truth, rel=1e-9)
        assert sum(cell.rows for cell in cells) == sum(int(t.segment.keep.sum()) for t in traces)
        for row, name in zip(panel.cells, panel.rows, strict=True):
            assert all(cell.recordings == ((name, pytest.approx(1.0)),) for cell in row if cell is not None and cell.rms > 0)
        assert maps[f"{joint + 1}|when|whole"].largest < 1e-9


def test_a_cell_of_the_map_names_the_recordings_that_fill_it_in_order():
    c, _, poor = poor_and_whole()
    for m in residual_maps(all_traces(c, poor=poor), ["poor"]):
        for cell in (cell for row in m.cells for cell in row if cell is not None):
            shares = [share for _, share in cell.recordings]
            assert shares == sorted(shares, reverse=True)
            assert sum(shares) <= 1 + 1e-9
            assert cell.text.lstrip("+\N{MINUS SIGN}") == f"{cell.rms:.2g}"


def test_the_map_on_disk_holds_every_cell_of_the_map(tmp_path):
    c, whole, poor = poor_and_whole()
    maps = residual_maps(all_traces(c, whole=whole, poor=poor), ["poor", "whole"])
    paths = map_figure(maps, tmp_path / "map")
    assert [p.name for p in paths] == ["map.png", "map.svg", "map.csv"]
    rows = list(csv.DictReader(paths[2].read_text().splitlines()))
    shown = [m for m in maps if m.over == "angle and rate"]
    assert len(rows) == sum(cell is not None for m in shown for row in m.cells for cell in row)
    for m in shown:
        drawn = [float(r["value"]) for r in rows if (r["series"], r["x_label"]) == (m.model, m.across)]
        np.testing.assert_allclose(sorted(drawn), sorted(cell.rms for row in m.cells for cell in row if cell is not None), rtol=1e-8)


def rubbing(level=0.3, std=0.01):
    """A campaign whose second joint rubs, the model with that, the model without, and the finding."""
    a = arm()
    without = StripTheory(a, GIVEN, {}, "constant", planted(a))
    effect = candidates(catalogue()["coulomb_friction"], a)[1].with_linear(torch.tensor([level], dtype=torch.float64))
    true = replace(without, loads=without.loads.plus("coulomb_friction_2", effect))
    c = campaign(a, true.loads, count=3)
    rest = dict.fromkeys(("family", "equivalence_set", "confidence", "parameters", "rivals"))
    return c, without, true, Finding(law=effect, statement="Joint 2 rubs.", number=0, covariance=np.array([[std**2]]), **rest)


def test_the_law_of_a_finding_is_its_torque_with_the_interval_of_its_value():
    c, without, true, finding = rubbing()
    law = law_of(finding, true, diagnosis_traces(c, without, true), "corrected")
    assert (law.joint, law.driver) == (2, "rate of joint 2 [rad/s]")
    fast = np.abs(law.x) > 0.5
    np.testing.assert_allclose(law.law[fast], 0.3 * np.sign(law.x[fast]), atol=0.001)
    np.testing.assert_allclose(law.half[fast], 1.96 * 0.01, rtol=0.01)
    np.testing.assert_allclose(law.rest, law.law, atol=1e-9)


def test_what_the_law_leaves_is_seen_beside_it():
    c, without, _, finding = rubbing()
    weak = finding.law.with_linear(torch.tensor([0.2], dtype=torch.float64))
    model = replace(without, loads=without.loads.plus("coulomb_friction_2", weak))
    law = law_of(replace(finding, law=weak), model, diagnosis_traces(c, without, model), "corrected")
    fast = np.abs(law.x) > 0.5
    np.testing.assert_allclose(np.abs(law.law[fast]), 0.2, atol=0.001)
    np.testing.assert_allclose(np.abs(law.rest[fast]), 0.3, atol=0.001)


@pytest.mark.parametrize("id_", catalogue())
def test_every_effect_has_a_law_but_one_with_a_phase_or_a_time_of_its_own(id_):
    a = arm()
    base = StripTheory(a, GIVEN, {}, "constant", planted(a))
    (made, *_) = candidates(catalogue()[id_], a, (5.0, 2.0))
    effect = made.with_linear(torch.full_like(made.linear_values(), 0.01))
    if isinstance(effect, LoadEffect):
        model = replace(base, loads=base.loads.plus("found", effect))
    else:
        model = replace(base, instruments=(effect,))
    p = len(effect.linear_values())
    rest = dict.fromkeys(("family", "equivalence_set", "confidence", "parameters", "rivals"))
    finding = Finding(law=effect, statement="", number=0, covariance=1e-6 * np.eye(p), **rest)
    law = law_of(finding, model, diagnosis_traces(campaign(a, base.loads, count=2, seconds=2.0), base, model), "corrected")
    assert (law is None) == (effect.per_recording or effect.signature.depends_on == ("clock",))
    if law is not None:
        assert len(law.x) > 3
        assert np.isfinite([law.law, law.rest, law.half]).all()
        assert law.half.max() > 0


@pytest.mark.slow
def test_a_diagnosis_leaves_its_history_its_map_and_its_laws(tmp_path):
    c, without, true, finding = rubbing()
    a = c.arm
    c = nnhydro.Campaign.of(a, list(c.recordings()), (steady_table(a, planted(a)),))
    told = SimpleNamespace(findings=[finding], corrected=true, baseline=without)
    traces = diagnosis_traces(c, without, true)
    paths = diagnosis_figures(told, traces, residual_maps(traces, [BASELINE]), laws_of(told, traces), tmp_path)
    stems = ("torque_history", "torque_steady", "residual_map", "laws")
    assert sorted(p.name for p in paths) == sorted(f"{stem}.{kind}" for stem in stems for kind in ("png", "svg", "csv"))
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(p.name for p in paths)
    rows = list(csv.DictReader((tmp_path / "torque_history.csv").read_text().splitlines()))
    assert {"measured", "corrected (0.0 %)"} <= {r["series"] for r in rows}


def test_text_on_the_map_stays_readable_on_every_shade():
    assert [shade(v) for v in (0.0, 0.47, 0.5, 0.6, 1.0)] == ["", "", "mid", "hi", "hi"]


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


def with_wild_ends(trace, rows=20):
    """The trace with rows at both ends that are not compared, at which the models are far off."""
    keep, tau = trace.segment.keep.copy(), trace.models["poor"].copy()
    keep[:rows], keep[-rows:], tau[:rows] = False, False, 100.0
    return replace(trace, segment=replace(trace.segment, keep=keep), models={**trace.models, "poor": tau})


def texts_of(drawing):
    return [text.text for text in ET.fromstring(drawing).iter() if text.tag.endswith("text")]


def points_of(path):
    """The corners of a page's path: M x y, then steps."""
    found = []
    for part in path.get("d").split("M")[1:]:
        numbers = np.array(re.findall(r"-?[\d.]+", part), dtype=float).reshape(-1, 2)
        found.append(np.cumsum(numbers, axis=0))
    return found


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
    assert shown[0].get_ylim()[1] < 100, "rows that are not compared do not set the scale"


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


def test_curves_and_marks_can_be_told_apart_in_grey():
    c, whole, poor = poor_and_whole()
    trace = all_traces(c, whole=whole, poor=poor)[0]
    lines = torque_figure(trace, {"whole": 0, "poor": 1}).axes[0].lines
    assert len({(line.get_linestyle(), line.get_linewidth()) for line in lines}) == len(lines)
    assert lines[0].get_label() == MEASURED, "the models lie on top of it"
    assert len({str(style["linestyle"]) for style in STYLES}) == len({mark["marker"] for mark in MARKS}) == len(STYLES)


def test_a_panel_s_limits_hold_the_compared_rows_of_the_models_shown_first():
    c, whole, poor = poor_and_whole()
    trace = all_traces(c, whole=whole, poor=poor)[0]
    whole_only, both = (panels(trace, ["whole", "poor"], first) for first in (["whole"], []))
    for narrow, wide in zip(whole_only, both, strict=True):
        inside = np.concatenate([y[trace.segment.keep] for y in wide.curves.values()])
        assert wide.limits[0] < inside.min()
        assert wide.limits[1] > inside.max()
        assert np.ptp(narrow.limits) < np.ptp(wide.limits) or not narrow.residual
    of_another = panels(trace, ["whole", "poor"], ["no model of this picture"])
    assert [panel.limits for panel in of_another] == [panel.limits for panel in both], "where none of them is drawn, all count"


def test_many_recordings_are_thinned_evenly():
    names = [f"r{i}" for i in range(1000)]
    assert spread(names[:5]) == names[:5]
    chosen = spread(names, 50)
    assert len(chosen) == 50
    assert (chosen[0], chosen[-1]) == ("r0", "r999")
