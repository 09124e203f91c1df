"""The pictures of a diagnosis hold every cell of its map, and its history and its laws."""

import csv
from types import SimpleNamespace

import numpy as np
import pytest
from campaigns import planted, steady_table
from drawn_traces import all_traces, poor_and_whole, rubbing

import nnhydro
from nnhydro.report.diagnosis import figures
from nnhydro.report.diagnosis.figures import diagnosis_figures, laws_of, map_figure
from nnhydro.report.widgets.residual_map import residual_maps
from nnhydro.report.widgets.trace import BASELINE, diagnosis_traces


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


def test_the_map_names_states_and_scales_in_words_and_no_label_is_cut(monkeypatch):
    drawn = []
    monkeypatch.setattr(figures, "save_figure", lambda figure, stem: drawn.append(figure) or [])
    c, whole, poor = poor_and_whole()
    map_figure(residual_maps(all_traces(c, whole=whole, poor=poor), ["poor", "whole"]), "map")
    (figure,) = drawn
    figure.draw_without_rendering()
    labels = {(ax.get_xlabel(), ax.get_ylabel()) for ax in figure.axes}
    assert ("angle of joint 1 [rad]", "rate of joint 1 [rad/s]") in labels
    bars = [ax for ax in figure.axes if "rms residual" in ax.get_ylabel()]
    assert [ax.get_ylabel() for ax in bars] == [f"rms residual of joint {joint} [N m], on its own scale" for joint in (1, 2)]
    edges = [ax.yaxis.label.get_window_extent() for ax in bars]
    assert all(box.x1 < figure.bbox.x1 and box.y0 > figure.bbox.y0 and box.y1 < figure.bbox.y1 for box in edges)
    assert edges[0].y0 > edges[1].y1, "labels of two rows stay apart"


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
