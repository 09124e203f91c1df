"""The pictures of McLain & Rock's reproduction draw its numbers in per cent, with the signs of the paper."""

import csv
from types import SimpleNamespace

import numpy as np
import pytest

from nnhydro.evaluation.mclain.reproduce import TRAVELS, PaperSlew
from nnhydro.physics.coefficients import aspect_ratio
from nnhydro.report import figure_file
from nnhydro.report.mclain_figures import LABELS, MEASURED, QUOTED, errors, profile, segments, slenderness, slews


@pytest.fixture
def drawn(tmp_path, monkeypatch):
    """A way to draw: what the picture holds, {(panel, series): points (n, 2)}."""
    monkeypatch.setattr(figure_file, "KINDS", ())  # the data alone

    def draw(picture, **result):
        (path,) = picture(SimpleNamespace(**result), tmp_path / "one")
        found = {}
        with path.open(encoding="utf-8") as file:
            for row in csv.DictReader(file):
                found.setdefault((int(row["panel"]), row["series"]), []).append((float(row["x"]), float(row["y"])))
        return {key: np.array(points) for key, points in found.items()}

    return draw


def test_slews_show_the_torque_of_the_water_on_the_arm_opposite_to_the_load(drawn):
    t = np.linspace(0, 2, 5)
    made = [PaperSlew(degrees, t, degrees * t, {name: k + degrees * t for k, name in enumerate(LABELS)}) for degrees in (30.0, 60.0, 90.0)]
    shown = drawn(slews, slews=made)
    for panel, slew in enumerate(made, 1):
        np.testing.assert_allclose(shown[panel, MEASURED], np.column_stack([t, -slew.measured]))
        for name, label in LABELS.items():
            np.testing.assert_allclose(shown[panel, label][:, 1], -slew.models[name])


def test_errors_are_bars_in_per_cent_a_pair_a_model(drawn):
    shown = drawn(errors, errors={"textbook": 0.5, "fitted constants": 0.4}, errors_measured={"textbook": 0.55, "fitted constants": 0.43})
    bars = [points[:, 1].tolist() for (_, series), points in shown.items() if series]
    assert bars == [pytest.approx([50, 40]), pytest.approx([55, 43])]


def test_segments_and_slenderness_lie_where_the_study_found_them(drawn):
    shown = drawn(segments, segments={1: (0.3, 0.35), 4: (0.01, 0.12)})
    np.testing.assert_allclose(shown[1, "segmentation alone"], [[1, 30], [4, 1]])
    np.testing.assert_allclose(next(p for (_, name), p in shown.items() if name.startswith("with")), [[1, 35], [4, 12]])
    shown = drawn(slenderness, slenderness={2.0: (1.0, 0.6), 40.0: (1.0, 1.1)})
    np.testing.assert_allclose(shown[1, "curves alone: know no span"][:, 1], [1, 1])
    np.testing.assert_allclose(shown[1, "Wieselsberger 1922, two free ends, towed"], aspect_ratio.C_D[:-1])


def test_the_profile_is_zero_at_the_best_travel_scale(drawn):
    grid = np.array([2.0, 6.0, 10.0])
    fit = SimpleNamespace(tau_s=(6.0,), search=SimpleNamespace(grid=(grid,), profile=np.array([4.0, 1.0, 1.21]), energy=1.0))
    shown = drawn(profile, fit=fit, groups=(fit,))
    np.testing.assert_allclose(shown[1, "twelve slews"], np.column_stack([grid, [100, 0, 10]]), atol=1e-9)


def test_the_quoted_numbers_lie_on_the_axis_of_travels():
    for s, values in QUOTED.values():
        assert len(s) == len(values)
        assert s == tuple(sorted(s))
        assert TRAVELS[0] <= min(s) < max(s) <= TRAVELS[-1]
