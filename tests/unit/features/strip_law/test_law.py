"""The law of the strips: its columns are its torque, its loads have the dimension of a force, and what has stopped is still pushed."""

from dataclasses import replace

import pytest
import torch
from rigs import arm, assert_close, run, states

from nnhydro.features.strip_law.law import (
    ACCELERATED,
    MEAN,
    MORISON,
    NEURONS,
    REMEMBERED,
    SURROUNDED,
    SWUNG,
    law_columns,
    law_torque,
    size,
    tiers,
    unit_loads,
)
from nnhydro.features.strip_law.neurons import COUNT, directions
from nnhydro.features.strip_law.state import StripView, sets_of, strip_states
from nnhydro.features.wake import STATES, STRIPS
from nnhydro.fitting.config import TrainingConfig
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.normal_drag import NormalDrag

LAW = TrainingConfig().law


def view(motion, links=2):
    flow = Flow(arm(links), motion)
    strips = StripView(flow)
    return (strips, *strip_states(strips, LAW))


@pytest.mark.parametrize("links", [1, 2, 3])
def test_the_torque_is_the_sum_of_its_columns(links):
    strips, z, of_three = view(run(links), links)
    columns = law_columns(strips, z, of_three)
    c = torch.randn(4, columns.shape[2], generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    assert_close(law_torque(strips, z, of_three, c, directions()), torch.einsum("njp,ep->enj", columns, c), rtol=1e-9, atol=1e-9)


def test_the_first_of_drag_and_of_inertia_are_morisons_by_strips():
    a, motion = arm(2), states(2)
    strips, z, of_three = view(motion)
    columns, place = law_columns(strips, z, of_three), tiers(sets_of(strips, LAW), of_three, law_columns(strips, z, of_three).shape[2])
    drag, inertia = columns[:, :, place == MEAN].unbind(2)
    flow = Flow(a, motion)
    assert_close(inertia, AddedMass((1.0, 1.0)).torque(flow), rtol=0.01, atol=0.01)
    assert float((drag - NormalDrag((1.0, 1.0)).torque(flow)).abs().max()) < 0.02 * float(drag.abs().max())


def test_every_coefficient_has_one_tier():
    strips, z, of_three = view(run(2))
    count, loads, k = law_columns(strips, z, of_three).shape[2], unit_loads(strips).shape[2], z.shape[2]
    place = tiers(sets_of(strips, LAW), of_three, count)
    assert count == MORISON * size(k, of_three) + (loads - MORISON) * (1 + k) + 2 * COUNT
    assert (place == NEURONS).sum() == 2 * COUNT
    assert (place == MEAN).sum() == MORISON
    assert sum(int((place == tier).sum()) for tier in (REMEMBERED, SWUNG, ACCELERATED)) == loads - MORISON
    assert sorted(set(place[place >= SURROUNDED].tolist())) == [SURROUNDED + number for number in range(len(LAW))]


def test_inertia_that_remembers_is_what_acceleration_alone_makes():
    strips, _, _ = view(replace(run(2), qdd=torch.zeros_like(run(2).qdd), du0=torch.zeros_like(run(2).du0)))
    faster = view(run(2))[0]
    place = tiers([], (), unit_loads(strips).shape[2])
    same = [bool(torch.equal(a, b)) for a, b in zip(unit_loads(strips).unbind(2), unit_loads(faster).unbind(2), strict=True)]
    assert all(same[i] for i in range(len(same)) if place[i] in (REMEMBERED, SWUNG))


def test_a_motion_twice_as_fast_has_four_times_the_loads_but_for_viscosity_and_history():
    motion = run(1)
    fast = replace(motion, t=motion.t / 2, qd=motion.qd * 2, qdd=motion.qdd * 4, u0=motion.u0 * 2, du0=motion.du0 * 4)
    slow_loads, fast_loads = (unit_loads(StripView(Flow(arm(1), m)))[50:] for m in (motion, fast))
    inviscid = 2 + (6 + 3 * 5 + 3 * 2) + (6 + 5)  # Morison, drag, inertia; then come history and viscosity
    assert_close(fast_loads[:, :, :inviscid], 4 * slow_loads[:, :, :inviscid], rtol=0.01, atol=1e-3 * float(fast_loads.abs().max()))


def test_a_link_that_has_stopped_in_its_wake_is_still_pushed():
    motion = states(1, 1)
    still = replace(motion, qd=0 * motion.qd, qdd=0 * motion.qdd, u0=0 * motion.u0, du0=0 * motion.du0)
    running = replace(still, wake=torch.full((STATES, 1, 1, STRIPS), 0.3, dtype=torch.float64))
    assert not unit_loads(StripView(Flow(arm(1), still))).any()
    assert bool(unit_loads(StripView(Flow(arm(1), running))).any())
