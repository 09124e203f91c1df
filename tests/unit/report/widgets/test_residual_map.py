"""The residual map adds up to the residual, and each cell names the recordings that fill it."""

import pytest
from drawn_traces import all_traces, poor_and_whole

from nnhydro.report.widgets.residual_map import residual_maps, shade


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


def test_text_on_the_map_stays_readable_on_every_shade():
    assert [shade(v) for v in (0.0, 0.47, 0.5, 0.6, 1.0)] == ["", "", "mid", "hi", "hi"]
