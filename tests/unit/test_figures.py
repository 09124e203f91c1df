"""Figures on disk: PNG and SVG of the same picture, what is drawn beside them as CSV; what the pages compute agrees with the data."""

import csv
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from campaigns import GIVEN, campaign, planted, steady_table
from rigs import arm

import nnhydro
from nnhydro.models.strip_theory import StripTheory
from nnhydro.report.figure_file import new_figure, save_figure
from nnhydro.report.page.history import history
from nnhydro.report.page.residual_map import residual_maps, shade
from nnhydro.report.page.svg import FINE, Scale, path, round_step, thinned
from nnhydro.report.page.trace import spread, traces_of


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


def test_a_path_holds_the_curve_to_half_a_pixel():
    x, y = np.linspace(0, 900, 301), 70 * np.sin(np.linspace(0, 20, 301))
    numbers = np.array(path(x, y).replace("M", "").replace("l", " ").replace("-", " -").split(), dtype=int).reshape(-1, 2)
    points = np.cumsum(numbers, axis=0) / FINE
    assert np.abs(points - np.column_stack([x, y])).max() <= 0.5 / FINE + 1e-9


def test_thinning_keeps_every_peak():
    y = np.zeros(10_000)
    y[[777, 5003]] = 1.0, -1.0
    x = np.arange(10_000.0)
    a, b = thinned(x, y, 200)
    assert len(a) <= 200
    assert {(777.0, 1.0), (5003.0, -1.0)} <= set(zip(a, b, strict=True))
    assert (np.diff(a) > 0).all()


@pytest.mark.parametrize(("span", "about", "step"), [(10, 5, 2), (1, 4, 0.5), (7, 5, 2), (0.03, 3, 0.01), (1e6, 10, 1e5)])
def test_ticks_are_round_numbers(span, about, step):
    assert round_step(span, about) == pytest.approx(step)
    scale = Scale(-0.01 * span, span, 100, 0)
    assert scale(scale.ticks(about)[0]) == pytest.approx(100, abs=2)
    assert len(scale.ticks(about)) <= about + 2


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
        one = maps[f"{joint + 1}|when|poor"]
        cells = [cell for row in one.cells for cell in row if cell is not None]
        assert sum(cell.rms**2 * cell.rows for cell in cells) == pytest.approx(truth, rel=1e-9)
        assert sum(cell.rows for cell in cells) == sum(int(t.segment.keep.sum()) for t in traces)
        for row, name in zip(one.cells, one.rows, strict=True):
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


def test_text_on_the_map_stays_readable_on_every_shade():
    assert [shade(v) for v in (0.0, 0.47, 0.5, 0.6, 1.0)] == ["", "", "mid", "hi", "hi"]


def test_a_steady_table_is_drawn_against_what_it_varies_and_nothing_else():
    a = arm()
    table = steady_table(a, planted(a))
    c = nnhydro.Campaign.of(a, [], (table,))
    (trace,) = traces_of("tows", c.steady_segments(), {"m": StripTheory(a, GIVEN, {}, "m", planted(a))})
    labels = [h.label for h in history(trace, {"m": 0}, 100, ["m"])]
    assert labels == ["tows against towing speed", "tows against angle of joint 1", "tows against angle of joint 2"]
    assert trace.error("m") < 1e-9


def test_many_recordings_are_thinned_evenly():
    names = [f"r{i}" for i in range(1000)]
    assert spread(names[:5]) == names[:5]
    chosen = spread(names, 50)
    assert len(chosen) == 50
    assert (chosen[0], chosen[-1]) == ("r0", "r999")
