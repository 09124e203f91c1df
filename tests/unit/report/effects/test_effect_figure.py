"""The picture of an effect: a quarter of the largest torque, drawn against what drives it, on a motion whose rates are exact."""

import csv

import numpy as np
import pytest

from nnhydro.effects.catalogue import catalogue
from nnhydro.errors import ConfigError
from nnhydro.report.effects.effect_figure import RATE, demonstration_motion, draw, illustrate, picture


@pytest.mark.parametrize("id_", catalogue())
def test_a_picture_has_something_to_show(id_):
    assert "$" not in catalogue()[id_].name, "the title of a figure takes what stands between two of them for a formula"
    motion, without, with_it, joint = illustrate(catalogue()[id_])
    change = (with_it - without)[:, joint].abs().max()
    assert len(without) == len(with_it) == len(motion)
    assert bool(with_it.isfinite().all())
    share = float(change / without[:, joint].abs().max())
    assert share == pytest.approx(0.25) if id_ != "torque_saturation" else 0.1 < share < 0.25
    if id_ == "torque_saturation":
        assert bool((with_it.abs() <= without.abs() + 1e-9).all()), "a clipped torque is never larger, and keeps its sign"
        assert bool((with_it * without >= 0).all())


def test_the_motion_of_the_pictures_has_exact_rates_starts_from_rest_and_pauses():
    motion = demonstration_motion()
    q, qd, qdd = motion.q.numpy(), motion.qd.numpy(), motion.qdd.numpy()
    np.testing.assert_allclose(np.gradient(q, 1 / RATE, axis=0)[1:-1], qd[1:-1], atol=0.01)
    np.testing.assert_allclose(np.gradient(qd, 1 / RATE, axis=0)[1:-1], qdd[1:-1], atol=0.5)
    assert (qd[[0, -1]] == 0).all()
    assert ((qd == 0).mean(axis=0) > 0.1).all()
    assert (qd.min(axis=0) < -0.5).all()
    assert (qd.max(axis=0) > 0.5).all()


@pytest.mark.parametrize(("id_", "label"), [("coulomb_friction", "rate of joint 2 [rad/s]"), ("torque_drift", "time [s]")])
def test_the_difference_is_drawn_against_what_drives_it(id_, label):
    left, right = picture(catalogue()[id_]).axes
    before, after = (line.get_ydata() for line in left.lines)
    assert right.get_xlabel() == label
    np.testing.assert_allclose(right.lines[0].get_ydata(), after - before, atol=1e-12)


def test_a_picture_lies_there_with_its_data_and_a_place_that_cannot_be_written_is_named(tmp_path):
    effect = catalogue()["coulomb_friction"]
    path = draw(effect, tmp_path / "new" / "one.png")
    with path.with_suffix(".csv").open(encoding="utf-8") as file:
        assert {row["series"] for row in csv.DictReader(file)} >= {"with", "without"}
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match="cannot be written"):
        draw(effect, tmp_path / "file" / "one.png")
