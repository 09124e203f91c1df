"""A sum of load terms: parameters in order, each where it belongs."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from rigs import arm, assert_close, run

from nnhydro.errors import ModelError
from nnhydro.models.baselines import BASELINES
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import term_kinds
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.physics.travel.state_model import state_loads

TERMS = term_kinds()


def water(loads):
    return Loads({name: term for name, term in loads.terms.items() if name != "rigid_body"})


TRUTH = water(state_loads(arm(1), tau_s=6.0))


def test_with_linear_puts_values_where_they_belong():
    changed = TRUTH.with_linear(np.arange(12.0))
    assert changed.terms["state_drag"] == replace(TRUTH.terms["state_drag"], **{f"d{i + 1}": (float(i),) for i in range(5)}, ds=(5.0,))


def test_a_sum_of_terms_says_which_carries_how_much_and_is_stored_whole():
    a = arm(2)
    flow = Flow(a, run(2))
    loads = Loads({})
    assert not loads.torque(flow).any()
    for kind, cls in TERMS.items():
        loads = loads.plus(kind, cls.at_start(a))
    assert_close(sum(loads.by_term(flow).values()), loads.torque(flow))
    assert Loads.parse(loads.document()) == loads
    with pytest.raises(ModelError, match="give this one another name"):
        loads.plus(next(iter(TERMS)), loads.terms[next(iter(TERMS))])


def test_a_name_stands_for_one_term_and_a_sum_is_not_changed():
    with pytest.raises(ModelError, match="already has a term called 'state_drag'"):
        TRUTH.plus("state_drag", ViscousTerm((0.1,)))
    more = TRUTH.plus("friction", ViscousTerm((0.1,)))
    assert "friction" in more.terms
    assert "friction" not in TRUTH.terms


def test_the_empty_sum_loads_no_arm():
    flow = Flow(arm(2), run(2))
    assert not Loads({}).torque(flow).any()
    assert not Loads({}).hub_force(flow).any()


def test_what_acts_at_a_joint_alone_needs_no_force_of_the_hub():
    flow = Flow(arm(2), run(2))
    assert Loads({"friction": ViscousTerm((0.1, 0.1))}).with_hub(flow) == {}
    assert Loads({"body": RigidBody.of_arm(arm(2))}).hub_force(flow).abs().max() > 0.1


def test_parameters_are_listed_in_the_order_of_the_columns():
    loads = Loads({"body": RigidBody.of_arm(arm(2)), "friction": ViscousTerm((0.1, 0.2))})
    names = [(name, label) for name, _, label, _, _ in loads.linear_parameters()]
    assert names[-2:] == [("friction", "coefficient[1]"), ("friction", "coefficient[2]")]
    columns = torch.cat([term.columns(Flow(arm(2), run(2))) for term in loads.linear().values()], dim=-1)
    assert columns.shape[-1] == len(names)


def start(a):
    return BASELINES["constant"].start(a)


def values(model_or_loads):
    loads = getattr(model_or_loads, "loads", model_or_loads)
    return np.concatenate([term.linear_values().numpy() for term in loads.linear().values()])


def test_a_sum_replaces_linear_parameters_alone_and_in_order():
    loads = start(arm(2)).plus("friction", CoulombTerm((0.1, 0.2), v0_rad_s=0.3))
    changed = loads.with_linear(values(loads) + 1.0)
    np.testing.assert_allclose(values(changed), values(loads) + 1.0)
    assert changed.terms["friction"].v0_rad_s == 0.3
    assert isinstance(changed.terms["added_mass"], AddedMass)
