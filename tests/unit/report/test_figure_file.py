"""Figures on disk: PNG and SVG of the same picture, what is drawn beside them as CSV; a page shows the same drawing."""

import csv
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from nnhydro.report.figure_file import new_figure, page_figure, save_figure


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
