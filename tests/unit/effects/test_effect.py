"""What a hypothesis is: the order of several, and columns that are exact for large values."""

import pytest
import torch
from hypotheses import made, view
from rigs import arm, assert_close, run

from nnhydro.effects.effect import REGISTER, at_joint, of_joint, with_effects
from nnhydro.effects.effect import effect as register
from nnhydro.effects.sensor_view import SensorView
from nnhydro.errors import ModelError
from nnhydro.models.baselines import baseline
from nnhydro.physics.flow import Flow


def test_effects_of_the_sensor_come_after_those_of_the_angle_whatever_the_order_given():
    a, motion = arm(2), run(2)
    offset, gain, bias = (made("encoder_offset", a, 1, offset=(0.1,)), made("torque_gain", a, 1, error=(0.2,)),
                          made("torque_bias", a, 1, offset=(0.3,)))
    seen = view(a, motion)
    tau = with_effects(seen, (bias, gain, offset)).tau
    assert_close(tau[:, 0], 1.2 * offset.apply(seen)[:, 0] + 0.3)
    assert_close(with_effects(seen, ()).tau, seen.tau)


def test_a_secant_times_its_values_is_exactly_what_a_large_instrument_effect_changes():
    a = arm(2)
    model = baseline("constant").start(a)
    seen = SensorView.of(model, Flow(a, run(2, 200)))
    water = REGISTER["ambient_current"].at_start(a).linear_names()
    for effect in (made("sensor_timing", a, lag=(0.03,), low_pass=(0.5,)), made("joint_elasticity", a, joint=1, compliance=(2e-3,)),
                   REGISTER["ambient_current"].at_start(a).with_linear(torch.full((len(water),), 0.2, dtype=torch.float64))):
        assert_close(effect.secant(seen) @ effect.linear_values(), effect.apply(seen) - seen.tau)
    nothing = made("sensor_timing", a, lag=(0.0,), low_pass=(0.0,))
    assert_close(nothing.secant(seen), nothing.columns(seen))


@pytest.mark.parametrize(("id_", "joint", "line"), [("torque_bias", 0, "the joint it acts on, counted from 1"),
                                                    ("ambient_current", 1, "0: it loads the whole arm")])
def test_an_effect_stands_at_a_joint_or_loads_the_whole_arm(id_, joint, line):
    with pytest.raises(ModelError, match=line):
        REGISTER[id_].at_start(arm(2), joint=joint)


def test_a_load_at_a_joint_is_felt_there_alone():
    load = torch.arange(6.0, dtype=torch.float64).reshape(3, 2)
    columns = at_joint(load, 2, 3)
    assert columns.shape == (3, 3, 2)
    assert torch.equal(columns[:, 1], load)
    assert not columns[:, [0, 2]].any()
    with pytest.raises(ModelError, match="joint 4: this arm has 3"):
        at_joint(load, 4, 3)
    per_joint = torch.arange(12.0, dtype=torch.float64).reshape(3, 2, 2)
    assert torch.equal(of_joint(per_joint, 2), per_joint[..., 1:])


def test_an_id_belongs_to_one_effect():
    other = type("Other", (REGISTER["torque_bias"],), {"__module__": "elsewhere"})
    with pytest.raises(ModelError, match="the id 'torque_bias' is taken"):
        register(other)


def test_a_finding_is_said_with_its_interval_or_with_the_text_in_its_place():
    bias = made("torque_bias", arm(2), 1, offset=(0.3,))
    assert "0.30 +- 0.10 N m" in bias.statement({"offset": (0.2, 0.4)})
    assert "unknown" in bias.statement(instead={"offset": "unknown"})


@pytest.mark.parametrize(("X", "Y", "way"), [(0.0, 0.2, "along +Y."), (0.0, -0.2, "along -Y."), (0.2, 0.0, "along +X."),
                                             (-0.2, 0.0, "along -X."), (0.1, 0.2, "from +X.")])
def test_a_current_of_which_one_component_shows_is_told_along_that_axis(X, Y, way):
    current = made("ambient_current", arm(1), current_X=(X,), current_Y=(Y,))
    assert way in current.statement()
