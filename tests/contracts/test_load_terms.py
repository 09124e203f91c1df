"""What every load term must do, whoever wrote it; none is named here."""

import inspect
import json
from dataclasses import replace
from math import isfinite

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from rigs import arm, assert_close, at_rest, hub_at_rest, run, states, torque, without_acceleration

from nnhydro.errors import ModelError
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import PER, LinearTerm, term_kinds, term_of
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import Base, Motion, Water, tensor

TERMS = term_kinds()
KINDS = pytest.mark.parametrize("kind", TERMS)
LINEAR = pytest.mark.parametrize("kind", [kind for kind, cls in TERMS.items() if issubclass(cls, LinearTerm)])
LINKS = pytest.mark.parametrize("links", [1, 2, 3])


def varied(term):
    """The term with unlike values on unlike links, within their bounds."""
    def spread(f):
        low, high = f.metadata["bounds"]
        return tuple(min(max(v * (1 + 0.3 * i), low), high) for i, v in enumerate(getattr(term, f.name)))

    return replace(term, **{f.name: spread(f) for f in term.parameters()})


def rows(motion, n):
    return replace(motion, **{name: getattr(motion, name)[:n] for name in ("t", "q", "qd", "qdd", "u0", "du0")})


def is_zero(term, a, motion):
    return float(torque(term, a, motion).abs().max()) == 0.0


@KINDS
@LINKS
def test_the_stored_document_gives_the_same_term_back(kind, links):
    term = varied(TERMS[kind].at_start(arm(links)))
    assert term_of(term.document()) == term
    assert term_of(json.loads(json.dumps(term.document()))) == term


@KINDS
def test_a_document_with_a_strange_parameter_is_refused(kind):
    document = TERMS[kind].at_start(arm(2)).document()
    with pytest.raises(ModelError, match=kind):
        term_of({**document, "parameters": {**document["parameters"], "no_such_thing": [1.0]}})


@KINDS
@LINKS
@pytest.mark.parametrize("n", [0, 1, 5])
@pytest.mark.parametrize("make", [states, run])
def test_the_torque_has_a_row_a_sample_and_a_column_a_joint(kind, links, n, make):
    a = arm(links)
    tau = torque(TERMS[kind].at_start(a), a, rows(make(links), n))
    assert tau.shape == (n, links)
    assert tau.dtype == torch.float64


@KINDS
def test_a_term_loads_an_arm_that_moves_or_water_that_does(kind):
    a, motion = arm(2), run(2)
    swell = Water(torch.stack([motion.t, motion.t], 1), torch.ones(len(motion), 2, dtype=torch.float64))
    assert not is_zero(TERMS[kind].at_start(a), a, replace(motion, current=swell))


numbers = st.sampled_from([0.0, 1e-300, -1e-12, 1e-6, 0.5, -2.0, 1e3, -1e4])


@KINDS
@given(data=st.data())
def test_the_torque_is_finite_for_any_motion(kind, data):
    links = data.draw(st.integers(1, 3))
    a = arm(links)
    q, qd, qdd = (data.draw(st.lists(st.tuples(*[numbers] * links), min_size=3, max_size=3)) for _ in range(3))
    u0, du0 = (data.draw(st.lists(numbers, min_size=3, max_size=3)) for _ in range(2))
    motion = Motion.at(q, qd, qdd, u0, du0)
    for steady in (True, False):
        assert torch.isfinite(torque(TERMS[kind].at_start(a), a, replace(motion, steady=steady))).all()


@LINEAR
@LINKS
def test_columns_times_values_are_the_torque(kind, links):
    a = arm(links)
    flow, term = Flow(a, run(links)), varied(TERMS[kind].at_start(a))
    columns, values = term.columns(flow), term.linear_values()
    assert columns.shape == (60, links, len(values))
    assert_close((columns * values).sum(-1), term.torque(flow))


@LINEAR
@LINKS
def test_a_columns_is_the_torque_of_one_unit_of_its_parameter(kind, links):
    a = arm(links)
    flow, term = Flow(a, run(links)), varied(TERMS[kind].at_start(a))
    columns = term.columns(flow)
    for p, unit in enumerate(torch.eye(columns.shape[-1], dtype=torch.float64)):
        assert_close(term.with_linear(unit).torque(flow), columns[..., p])


@LINEAR
@LINKS
def test_linear_values_can_be_taken_out_changed_and_put_back(kind, links):
    term = varied(TERMS[kind].at_start(arm(links)))
    assert term.with_linear(term.linear_values()) == term
    doubled = term.with_linear(2 * term.linear_values())
    assert_close(doubled.linear_values(), 2 * term.linear_values())
    names = term.linear_names()
    assert len(set(names)) == len(names) == len(term.linear_values()) == len(term.linear_bounds()) == len(term.linear_units())


@KINDS
def test_every_parameter_says_what_it_is(kind):
    for f in TERMS[kind].parameters():
        card = f.metadata
        low, high = card["bounds"]
        assert low <= card["start"] <= high, f"{kind}.{f.name}: start {card['start']} lies outside its bounds {card['bounds']}"
        assert all(map(isfinite, (low, high, card["start"]))), f"{kind}.{f.name}: bounds and start must be finite"
        assert card["unit"].strip(), f"{kind}.{f.name}: no unit; write '1' for a pure number"
        assert card["meaning"].strip(), f"{kind}.{f.name}: no meaning"
        assert card["per"] in PER


@KINDS
def test_the_file_of_a_term_is_short_and_names_its_source(kind):
    module = inspect.getmodule(TERMS[kind])
    assert module is not None
    assert "Source:" in (module.__doc__ or ""), f"{module.__name__}: the docstring names no source"
    lines = len(inspect.getsource(module).splitlines())
    assert lines < 300, f"{module.__name__} has {lines} lines: one cause, one screen"


def of_the_water(kind):
    """Is there no such load without water?"""
    return is_zero(TERMS[kind].at_start(arm(2)), arm(2, density=0.0), run(2))


def dissipative(kind):
    """Does the load ignore accelerations, and vanish where nothing moves?"""
    a, motion = arm(2), hub_at_rest(run(2))
    term = TERMS[kind].at_start(a)
    return is_zero(term, a, at_rest(2)) and torch.equal(torque(term, a, motion), torque(term, a, without_acceleration(motion)))


@pytest.mark.parametrize("kind", list(filter(of_the_water, TERMS)))
@LINKS
def test_a_load_of_the_water_is_nothing_at_rest_and_proportional_to_density(kind, links):
    term, motion = TERMS[kind].at_start(arm(links)), run(links)
    assert is_zero(term, arm(links), at_rest(links))
    assert_close(torque(term, arm(links, density=2000.0), motion), 2 * torque(term, arm(links), motion))


def remembers(kind):
    """Does the load depend on the motion before?"""
    a, motion = arm(2), run(2)
    term = TERMS[kind].at_start(a)
    cut = replace(motion, **{name: getattr(motion, name)[20:] for name in ("t", "q", "qd", "qdd", "u0", "du0")})
    return not torch.allclose(torque(term, a, motion)[20:], torque(term, a, cut))


@pytest.mark.parametrize("kind", [kind for kind in TERMS if dissipative(kind) and not remembers(kind)])
@LINKS
@pytest.mark.parametrize("make", [states, run])
def test_a_dissipative_load_never_adds_energy(kind, links, make):
    a, motion = arm(links), hub_at_rest(make(links, seed=51))
    power = (torque(TERMS[kind].at_start(a), a, motion) * motion.qd).sum(-1)
    assert (power >= -1e-12).all()  # what the drives supply is lost


@pytest.mark.parametrize("kind", [kind for kind in TERMS if dissipative(kind) and remembers(kind)])
@LINKS
def test_a_dissipative_load_with_a_memory_takes_energy_over_a_run_from_rest(kind, links):
    a = arm(links)
    for seed in range(51, 56):
        motion = hub_at_rest(run(links, seed=seed))
        assert torch.trapezoid((torque(TERMS[kind].at_start(a), a, motion) * motion.qd).sum(-1), motion.t) > 0


def test_some_loads_are_of_the_water_and_some_dissipate():
    assert sum(map(of_the_water, TERMS)) >= 4
    assert sum(map(dissipative, TERMS)) >= 6


def test_the_rigs_of_these_tests_move_and_start_from_rest():
    motion = run(3)
    assert not motion.qd[0].any()
    assert_close((motion.q[2:] - motion.q[:-2]) / (motion.t[2:] - motion.t[:-2])[:, None], motion.qd[1:-1], atol=0.03)
    assert float(motion.u0[0]) == float(tensor(0.0))


@KINDS
@LINKS
@pytest.mark.parametrize("surrounded", [False, True])
def test_the_torque_at_several_flows_is_that_at_each_whatever_order_their_rows_stand_in(kind, links, surrounded):
    """A term says itself whether it loads each row alone; flows with and without a base or water of their own stand in one."""
    a = arm(links)
    motion = run(links, 40)
    swaying = Base(*(0.1 * torch.sin(motion.t + phase) for phase in range(5)))
    flow = Flow(a, replace(motion, base=swaying) if surrounded else motion)
    slow, fast = (torch.full((40, 2), v, dtype=torch.float64) for v in (0.05, 0.3))
    flows = [flow, flow.in_water(slow, fast), Flow(a, replace(motion, q=motion.q + 0.1, qd=1.1 * motion.qd)),
             flow.in_water(torch.stack([slow] * links, dim=1), fast)]
    loads = Loads({kind: varied(TERMS[kind].at_start(a)), "body": RigidBody.of_arm(a)} if kind != "rigid_body" else
                  {kind: varied(TERMS[kind].at_start(a))})
    for at_once, each in zip(loads.torques(flows), flows, strict=True):
        assert_close(at_once, loads.torque(each.again()))
    if TERMS[kind].row_by_row:
        turned = torch.arange(39, -1, -1)
        assert_close(torque(loads.terms[kind], a, motion.rows(turned)), torque(loads.terms[kind], a, motion)[turned])
