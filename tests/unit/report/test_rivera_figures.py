"""The pictures of Rivera's identifier draw the study's errors in per cent and each gain against the analytic one."""

import csv
from types import SimpleNamespace

import numpy as np
import pytest

from nnhydro.report import figure_file
from nnhydro.report.rivera_figures import FIGURES, write_figures

T = np.linspace(0, 1, 6)
ANALYTIC = np.arange(24.0).reshape(6, 2, 2)
RESULT = SimpleNamespace(
    inputs={"dimensional": {"common": 0.2, "parallel": 0.3}, "usual": {"common": 0.1, "parallel": 0.15}},
    neurons={4: {"common": 0.4, "parallel": 0.5}, 64: {"common": 0.1, "parallel": 0.12}}, training={3: 0.5, 6: 0.25}, constant=0.08,
    gains={"qd": (2 * ANALYTIC, ANALYTIC), "qdd": (ANALYTIC, ANALYTIC)}, gain_error={"qd": 1.0, "qdd": 0.0},
    slenderness={0.5: 0.3, 2.0: 0.2}, held_out="run1", t=T, measured=np.column_stack([T, 2 * T]), network=np.column_stack([T, 3 * T]))


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """What each picture holds, {name: {(panel, series): points (n, 2)}}."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figure_file, "KINDS", ())  # the data alone
        paths = write_figures(RESULT, tmp_path_factory.mktemp("figures"))
    found = {}
    for path in paths:
        shown = found.setdefault(path.stem, {})
        with path.open(encoding="utf-8") as file:
            for row in csv.DictReader(file):
                shown.setdefault((int(row["panel"]), row["series"]), []).append((float(row["x"]), float(row["y"])))
    return {name: {key: np.array(points) for key, points in shown.items()} for name, shown in found.items()}


def test_every_question_has_a_picture_with_errors_in_per_cent(drawn):
    assert set(drawn) == set(FIGURES)
    assert drawn["inputs"][1, "common layers"][:, 1] == pytest.approx([20, 10])
    assert drawn["inputs"][1, "parallel layers"][:, 1] == pytest.approx([30, 15])
    np.testing.assert_allclose(drawn["neurons"][1, "parallel layers"], [[4, 50], [64, 12]])
    np.testing.assert_allclose(drawn["training_set"][1, "network"], [[3, 50], [6, 25]])
    np.testing.assert_allclose(drawn["slenderness"][1, "network"], [[0, 30], [1, 20]])
    for name in ("inputs", "neurons", "training_set"):
        assert drawn[name][1, "fitted constants"][:, 1] == pytest.approx([8, 8])


def test_each_gain_lies_over_the_analytic_one_of_its_joint_and_state(drawn):
    for j, i in np.ndindex(2, 2):
        for panel, symbol, factor in ((1, "\\dot q", 2), (2, "\\ddot q", 1)):
            points = drawn["gains"][panel, f"$\\partial\\tau_{j + 1}/\\partial {symbol}_{i + 1}$"]
            np.testing.assert_allclose(points, np.column_stack([ANALYTIC[:, j, i], factor * ANALYTIC[:, j, i]]))


def test_torques_lie_in_a_panel_a_joint(drawn):
    np.testing.assert_allclose(drawn["torques"][1, "measured"], np.column_stack([T, T]))
    np.testing.assert_allclose(drawn["torques"][2, "network"], np.column_stack([T, 3 * T]))
