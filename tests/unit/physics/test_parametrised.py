"""Parameters that are declared once."""

from dataclasses import dataclass

import pytest
import torch
from rigs import arm

from nnhydro.errors import ConfigError, ModelError
from nnhydro.physics.load_term import term_kinds, term_of
from nnhydro.physics.parametrised import ParametricTerm, parameter

TERMS = term_kinds()


def test_parameters_that_are_no_numbers_are_refused():
    kind, cls = next((kind, cls) for kind, cls in TERMS.items() if cls.parameters())
    document = cls.at_start(arm(2)).document()
    name = cls.parameters()[0].name
    with pytest.raises(ModelError, match="not a list of numbers"):
        term_of({**document, "kind": kind, "parameters": {**document["parameters"], name: ["much", "more"]}})


@dataclass(frozen=True)
class Made(ParametricTerm):
    kind = "made"
    size: tuple = parameter("m", 2.0, (0.0, 5.0), "size")
    shape: tuple = parameter("1", 0.5, (0.0, 1.0), "shape", per="arm", linear=False)
    gap: tuple = parameter("rad", 0.1, (-1.0, 1.0), "gap", per="other joint")
    label: str = "x"


def test_a_parameter_has_a_value_a_link_one_for_the_arm_or_a_joint_but_one():
    made = Made.at_start(arm(3))
    assert (made.size, made.shape, made.gap) == ((2.0,) * 3, (0.5,), (0.1,) * 2)
    assert made.linear_names() == ("size[1]", "size[2]", "size[3]", "gap[1]", "gap[2]")
    assert made.linear_units() == ("m",) * 3 + ("rad",) * 2
    assert made.linear_bounds()[-1] == (-1.0, 1.0)


def test_linear_values_are_put_back_in_their_order():
    made = Made.at_start(arm(2)).with_linear(torch.tensor([1.0, 3.0, 0.7]))
    assert (made.size, made.shape, made.gap) == ((1.0, 3.0), (0.5,), pytest.approx((0.7,)))
    assert made.linear_values().tolist() == pytest.approx([1.0, 3.0, 0.7])


def test_options_are_no_numbers_to_fit():
    assert [field.name for field in Made.options()] == ["label"]
    assert Made.at_start(arm(1), label="y").document() == {
        "kind": "made", "parameters": {"size": [2.0], "shape": [0.5], "gap": []}, "options": {"label": "y"}}


def test_a_parameter_of_something_else_is_refused():
    with pytest.raises(ConfigError, match="parameter is per 'tank'"):
        parameter("m", 0.0, (0.0, 1.0), "x", per="tank")
