"""A card is whole, or its effect is refused with what is missing."""

import pytest

from nnhydro.effects.effect import LoadEffect, Signature, effect, parameter
from nnhydro.errors import ModelError


@pytest.mark.usefixtures("catalogue_as_it_was")
def test_a_shape_without_a_grid_is_refused():
    with pytest.raises(ModelError, match="not linear and has no grid"):
        effect(_shape_without_grid())


def _shape_without_grid():
    from dataclasses import dataclass

    @dataclass(frozen=True)
    class Odd(LoadEffect):
        id = "odd_one"
        family = "viscous"
        name = mechanism = equation = source = "x"
        signature = Signature(("qd",), "odd", "everywhere", "anything", ("viscous_friction",))
        acts = "arm"
        a: tuple = parameter("1", 0.0, (0.0, 1.0), "x", per="arm")
        b: tuple = parameter("1", 0.0, (0.0, 1.0), "x", per="arm", linear=False)

        def columns(self, flow):
            return flow.motion.qd[..., None]

    return Odd


@pytest.mark.usefixtures("catalogue_as_it_was")
@pytest.mark.parametrize(("attributes", "line"), [
    ({"mechanism": " "}, "mechanism is missing or empty"), ({"id": "Odd One"}, "must be a lower-case name"),
    ({"family": "noise"}, "family 'noise' is not one of"), ({"acts": "tank"}, "acts 'tank' is not one of"),
    ({"signature": None}, "signature is missing"),
    ({"signature": Signature((), "odd", "everywhere", "anything", ())}, "depends_on names nothing"),
    ({"signature": Signature(("qd",), "strange", "everywhere", "anything", ())}, "parity 'strange'"),
    ({"signature": Signature(("qd",), "odd", "", "anything", ())}, "signature.region is empty"),
    ({"signature": Signature(["qd"], "odd", "everywhere", "anything", ())}, "must be a tuple of words")])
def test_a_card_that_lacks_something_is_refused_with_what_is_missing(attributes, line):
    with pytest.raises(ModelError, match=line):
        effect(type("Odd", (_shape_without_grid(),), attributes))
