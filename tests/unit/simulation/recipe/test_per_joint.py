"""Numbers that a recipe gives once for all joints, or once a joint."""

import pytest

from nnhydro.errors import ConfigError
from nnhydro.recordings.readers.validation import Settings, validate
from nnhydro.simulation.recipe.per_joint import PerJoint, PerJointMagnitude, one_each, spread


class Given(Settings):
    """Keys of both kinds."""

    bias: PerJoint = (0.0,)
    noise: PerJointMagnitude = (0.0,)


def test_one_number_serves_all_joints_and_as_many_as_joints_serve_each():
    assert spread((0.5,), 3, "x").tolist() == [0.5] * 3
    assert spread((0.5, 1.0), 2, "x").tolist() == [0.5, 1.0]
    assert one_each((0.5, 1.0), 2, "x").tolist() == [0.5, 1.0]


def test_any_other_count_is_refused_with_what_was_asked():
    with pytest.raises(ConfigError, match=r"sensors.bias: 2 numbers for an arm of 3 joint\(s\): give one, or one per joint"):
        spread((1.0, 2.0), 3, "sensors.bias")
    with pytest.raises(ConfigError, match=r"give one per joint$"):
        one_each((1.0,), 2, "q_rad")


def test_a_bare_number_is_a_list_of_one():
    made = validate(Given, {"bias": -0.1, "noise": [0.2, 0.3]}, "recipe", ConfigError)
    assert (made.bias, made.noise) == ((-0.1,), (0.2, 0.3))


@pytest.mark.parametrize("document", [{"noise": -0.1}, {"bias": []}, {"bias": 1e7}, {"bias": True}])
def test_what_is_no_number_of_a_rig_is_refused(document):
    with pytest.raises(ConfigError, match="recipe"):
        validate(Given, document, "recipe", ConfigError)
