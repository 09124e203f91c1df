"""Units and words of a joint that slides take the place of those of one that turns."""

import pytest

from nnhydro.conventions import column, joint_text, with_units


@pytest.mark.parametrize(("turning", "straight"), [
    ("N m s/rad", "N s/m"), ("N m/rad", "N/m"), ("N m", "N"), ("kg m^2", "kg"), ("rad/s^2", "m/s^2"), ("rad/s", "m/s"),
    ("tau1_Nm", "tau1_N"),
    ("along the direction 0.5 rad from +X", "along the direction 0.5 rad from +X"), ("from -0.2 rad to +X", "from -0.2 m to +X"),
    ("towards 0.5 rad (95 %: 0.1 to 2.0) from +X", "towards 0.5 rad (95 %: 0.1 to 2.0) from +X"), ("dq1_rad_s", "dq1_m_s"),
    ("the torque of joint 1, 3 N m, at 0.5 rad/s", "the force of joint 1, 3 N, at 0.5 m/s"), ("m/s", "m/s")])
def test_a_sentence_about_a_linear_axis_is_in_its_own_units(turning, straight):
    assert joint_text(turning, sliding=True) == straight
    assert joint_text(turning, sliding=False) == turning


@pytest.mark.parametrize(("channel", "joint", "sliding", "name"), [
    ("qd", 2, False, "dq2_rad_s"), ("tau_sim", 1, False, "tau1_sim_Nm"), ("tau", 1, True, "tau1_N"), ("qdd", 1, True, "ddq1_m_s2"),
    ("u0", None, True, "u0_m_s"), ("base_yaw", None, True, "base_yaw_rad_s")])
def test_a_column_is_named_by_channel_joint_and_unit(channel, joint, sliding, name):
    assert column(channel, joint, sliding) == name


def test_a_channel_of_each_joint_needs_its_number_and_one_of_the_base_has_none():
    with pytest.raises(ValueError, match="channel q is one per joint"):
        column("q")
    with pytest.raises(ValueError, match="channel u0 is not one per joint"):
        column("u0", 1)


def test_units_in_brackets_of_a_page_are_those_of_a_joint_that_slides():
    assert with_units("torque [N m], rate [rad/s], text N m", sliding=True) == "torque [N], rate [m/s], text N m"
    assert with_units("torque [N m]", sliding=False) == "torque [N m]"
