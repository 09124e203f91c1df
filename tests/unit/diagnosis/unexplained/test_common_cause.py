"""What remains at two joints has one cause where it moves them together, and neither noise nor errors of the angles do."""

import numpy as np
import pytest
from problems import design, law, search

from nnhydro.diagnosis.constants import MATERIAL
from nnhydro.diagnosis.unexplained.common_cause import common_cause

LAWS = (law("a"), law("b"))
ROWS = 60


def remaining(common, size=0.05, by_angles=0.0, groups=8):
    """A search on rows in which noise of `size` at both joints is common to them in the share `common` of its amplitude."""
    of = design(3, groups=groups, rows=ROWS, noise=0.0)
    rng = np.random.default_rng(11)
    shared, own = rng.standard_normal((len(of.y), 1)), rng.standard_normal(of.y.shape)
    of.y[:] = of.y + size * (common * shared + np.sqrt(1 - common**2) * own)
    of.input_variance = np.full(of.y.shape, by_angles)
    return search(of, LAWS, rng.standard_normal((*of.y.shape, 2)), level=size**2)


def found_in(one):
    return common_cause(one, one.score(()))


def test_noise_of_each_sensor_has_no_common_cause():
    assert found_in(remaining(0.0)) is None


def test_a_common_cause_is_told_with_the_joints_and_their_correlation():
    found = found_in(remaining(0.9))
    assert found.joints == (1, 2)
    assert found.correlation == pytest.approx(0.9**2, abs=0.1)
    assert "moves joints 1 and 2 together" in found.sentence
    assert found.document() == {"joints": [1, 2], "correlation": round(found.correlation, 4)}


def test_what_moves_joints_in_opposite_ways_or_in_ways_that_differ_between_recordings_is_common_too():
    one = remaining(0.9)
    of = one.view.library.design
    of.y[:, 1] *= np.where(of.problem.group_of % 2 == 0, -1.0, 1.0)
    turned = search(of, LAWS, np.random.default_rng(1).standard_normal((*of.y.shape, 2)), level=0.05**2)
    assert found_in(turned).joints == (1, 2)


def test_errors_of_the_angles_move_joints_together_and_are_no_cause():
    assert found_in(remaining(0.9, by_angles=0.5 * 0.05**2)) is None
    assert found_in(remaining(0.9, by_angles=0.01 * 0.05**2)) is not None


def test_what_is_small_beside_the_torque_is_not_told():
    one = remaining(0.9)
    scale = one.view.library.design.scale
    assert found_in(one) is not None
    one.view.library.design.scale = 0.05 / (0.5 * MATERIAL) * np.ones_like(scale)
    assert found_in(one) is None


def test_one_joint_has_nothing_in_common_with_another_and_a_free_arm_moves_as_one():
    alone = design(3, groups=8, rows=ROWS, joints=1)
    assert found_in(search(alone, LAWS, np.random.default_rng(1).standard_normal((*alone.y.shape, 2)))) is None
    one = remaining(0.9)
    one.view.library.design.undriven = True
    assert found_in(one) is None
