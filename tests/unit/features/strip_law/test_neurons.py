"""Neurons of the strips: odd and even in the mirror, silent at rest, of one shape whatever the speed, bounded beyond what was trained."""

from dataclasses import replace

import pytest
import torch
from rigs import arm, assert_close, mirrored_about_Y, run, states

from nnhydro.features.strip_law.law import law_torque, unit_loads
from nnhydro.features.strip_law.neurons import COUNT, STATES, directions, neuron_loads
from nnhydro.features.strip_law.state import StripView, strip_states
from nnhydro.features.wake import STATES as CARRIED
from nnhydro.features.wake import STRIPS
from nnhydro.physics.flow import Flow


def loads(motion, links=1):
    s, drag, inertia = neuron_loads(StripView(Flow(arm(links), motion)), directions())
    return drag * s, inertia * s**2


@pytest.mark.parametrize("links", [1, 2, 3])
def test_loads_change_sign_in_the_mirror(links):
    for own, image in zip(loads(run(links), links), loads(mirrored_about_Y(run(links)), links), strict=True):
        assert_close(image, -own)


def test_water_at_rest_loads_nothing_and_a_wake_pushes_what_has_stopped():
    motion = states(1, 1)
    still = replace(motion, qd=0 * motion.qd, qdd=0 * motion.qdd, u0=0 * motion.u0, du0=0 * motion.du0)
    running = replace(still, wake=torch.full((CARRIED, 1, 1, STRIPS), 0.3, dtype=torch.float64))
    assert not any(x.any() for x in loads(still))
    assert bool(loads(running)[0].any())


def test_a_motion_twice_as_fast_has_four_times_the_loads():
    motion = run(1)
    fast = replace(motion, t=motion.t / 2, qd=motion.qd * 2, qdd=motion.qdd * 4, u0=motion.u0 * 2, du0=motion.du0 * 4)
    for slow, quick in zip(loads(motion), loads(fast), strict=True):
        assert_close(quick[50:], 4 * slow[50:], rtol=0.02, atol=2e-3 * float(quick.abs().max()))


def test_neurons_saturate_so_that_no_motion_makes_more_of_them_than_pressure_and_added_mass():
    motion = states(2, 200)
    wild = replace(motion, qd=30 * motion.qd, qdd=900 * motion.qdd)
    s, _, _ = neuron_loads(StripView(Flow(arm(2), wild)), directions())
    assert float(s.abs().max()) <= 1


def test_directions_are_the_same_every_time_and_orthogonal_by_turns():
    N = directions()
    assert N.shape == (COUNT, STATES)
    for block in N[:COUNT // STATES * STATES].reshape(-1, STATES, STATES):
        gram = block @ block.T
        assert float((gram - torch.diag(torch.diagonal(gram))).abs().max()) < 1e-12 * float(gram.max())


def test_neurons_follow_a_law_that_is_no_product_of_motion_and_memory():
    """What one memory does to another, where the products know each memory beside the strip's own speed alone."""
    wake = torch.randn(CARRIED, 400, 1, STRIPS, generator=torch.Generator().manual_seed(3), dtype=torch.float64)
    strips = StripView(Flow(arm(1), replace(states(1, 400), wake=wake)))
    slip = strips.travelled[0] - strips.travelled[4]
    wanted = (slip.abs() * slip).ravel()
    s, drag, _ = neuron_loads(strips, directions())

    def left(columns):
        A = columns.transpose(2, 3).flatten(0, 2)
        half = len(A) // 2
        unit = A[:half].pow(2).mean(dim=0).sqrt().clamp(min=1e-12)
        fitted = torch.linalg.lstsq(torch.cat([A[:half] / unit, 1e-1 * torch.eye(A.shape[1])]),
                                    torch.cat([wanted[:half], torch.zeros(A.shape[1])])[:, None]).solution
        return float((A[half:] / unit @ fitted - wanted[half:, None]).abs().sum() / wanted[half:].abs().sum())

    products = unit_loads(strips)
    assert left(torch.cat([products, drag * s], dim=2)) < 0.8 * left(products)


def test_a_model_of_other_directions_uses_its_own():
    strips = StripView(Flow(arm(2), run(2)))
    z, of_three = strip_states(strips, ())
    c = torch.randn(2, unit_loads(strips).shape[2] + 2 * COUNT, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    assert bool((law_torque(strips, z, of_three, c, directions()) != law_torque(strips, z, of_three, c, directions().flip(0))).any())
