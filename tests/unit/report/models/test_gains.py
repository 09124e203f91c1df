"""Gains for people: the values at shares of the greatest speed, the sentence, and a peak of dry friction that hides nothing else."""

import csv

import numpy as np
import pytest
from campaigns import GIVEN, planted
from rigs import arm

from nnhydro.effects.hypotheses.coulomb_friction import CoulombFriction
from nnhydro.models.gains.sweeps import sweeps
from nnhydro.models.strip_theory import StripTheory
from nnhydro.report.figure_file import new_figure
from nnhydro.report.models.gains import PEAK, _limit, gain_figure, gain_rows, gain_verdict


@pytest.fixture(scope="module")
def made():
    """Sweeps of a two-link arm with quadratic drag."""
    a = arm(2)
    return sweeps(StripTheory(a, GIVEN, {}, "constant", planted(a)))


def test_the_damping_of_quadratic_drag_grows_in_step_with_the_speed(made):
    columns, rows = gain_rows(made)
    first = [row for row in rows if row[0] == "1"]
    assert [row[columns.index("speed [rad/s]")] for row in first] == ["0.00", "0.50", "1.00", "2.00"]
    at = [float(row[columns.index("damping, model [N m s/rad]")]) for row in first]
    assert at == pytest.approx([0.0, at[3] / 4, at[3] / 2, at[3]], abs=1e-3 * at[3])
    assert not any("damping, dry arm" in column for column in columns), "in air nothing damps"
    assert {row[0] for row in rows} == {"1", "2"}


def test_the_slope_of_dry_friction_at_rest_is_marked_in_the_table(made):
    a = arm(2)
    rubbing = StripTheory(a, GIVEN, {}, "rubbing", planted(a).plus("rub", CoulombFriction(joint=2, level=(0.2,), bending=(0.0,))))
    columns, rows = gain_rows(sweeps(rubbing))
    at = columns.index("damping, model [N m s/rad]")
    marked = [row[:2] for row in rows if row[at].endswith(" (slope of dry friction)")]
    assert marked == [["2", "0.00"]]
    assert not any("dry friction" in cell for row in gain_rows(made)[1] for cell in row)


def test_the_sentence_tells_the_row_at_half_the_speed(made):
    columns, rows = gain_rows(made)
    damping, inertia = (float(rows[2][columns.index(name)]) for name in ("damping, model [N m s/rad]", "inertia, model [kg m²]"))
    assert gain_verdict(made).startswith(
        f"At 1 rad/s, joint 1 has an effective damping of {damping:.3g} N m s/rad and an inertia of {inertia:.3g} kg m²; joint 2")


@pytest.mark.parametrize(("quantity", "top"), [("damping", PEAK * 1.08), ("inertia", 50 * 1.08)])
def test_a_peak_of_dry_friction_at_rest_is_cut_off_and_said(quantity, top):
    axes = new_figure(3, 2).subplots()
    _limit(axes, [np.r_[np.ones(100), 50.0]], quantity)
    assert axes.get_ylim() == pytest.approx((0, top))
    assert len(axes.texts) == (quantity == "damping")


def test_a_curve_of_nothing_has_limits_all_the_same():
    axes = new_figure(3, 2).subplots()
    _limit(axes, [np.zeros(5)], "damping")
    assert axes.get_ylim() == (0, 1)


def test_the_picture_holds_the_sweeps_and_no_damping_of_the_dry_arm(made, tmp_path):
    paths = gain_figure(made, "mine", tmp_path / "gains")
    with paths[-1].open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["panel"] for row in rows} == {str(k) for k in range(1, 7)}
    drawn = [float(row["y"]) for row in rows if (row["panel"], row["series"]) == ("1", "mine")]
    np.testing.assert_allclose(drawn, made[0].damping("model").numpy(), rtol=1e-8, atol=1e-12)
    assert "dry arm" not in {row["series"] for row in rows if "damping" in row["y_label"]}
    assert "dry arm" in {row["series"] for row in rows if "inertia" in row["y_label"]}
