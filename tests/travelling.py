"""Arms whose strips remember how far they have travelled: random motions, terms, and what the compiled kernel makes of them."""

from dataclasses import replace

import numpy as np
from rigs import states

from nnhydro.deployment.compiled.travel_loads import TravelLoads
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.travel.state_model import bspline_loads, state_loads, with_tau_s
from nnhydro.physics.travel.term import TravelTerm

EQUAL = 1e-11  # of the largest torque: the kernel sums ramps that cancel, the curve in torch adds up piece by piece


def motion(seed, links, rows, kind):
    """Random sines with pauses in one run: from rest, under way before, standing still, or steady rows."""
    rng = np.random.default_rng(seed)
    if kind == "steady":
        return states(links, rows, seed)
    t = np.cumsum(rng.uniform(0.005, 0.02, rows))
    phase = t[:, None] * rng.uniform(0.5, 4.0, links + 1) + (rng.uniform(0, 6, links + 1) if kind == "under way" else 0.0)
    x, v, acc = 1 - np.cos(phase), np.sin(phase), np.cos(phase)
    paused = (t % 1.7 > 1.2)[:, None] & (kind == "pauses")
    v, acc = np.where(paused, 0.0, v), np.where(paused, 0.0, acc)
    moves = 0.0 if kind == "still" else 1.0
    v, acc = moves * v, moves * acc
    return Motion(tensor(t), tensor(x[:, :links]), tensor(v[:, :links]), tensor(acc[:, :links]), tensor(v[:, links]), tensor(acc[:, links]))


def kernel_loads(travel, flow):
    """Force and moment (n, links) of the kernel, fed with the kinematics of torch, all rows as one block."""
    from nnhydro.physics.travel.kernel import strip_loads

    def with_first(x):
        return np.concatenate([x[:1], x])

    kinematics = np.stack([with_first(x.numpy()).T for x in (flow.A, flow.B, flow.M, flow.N, flow.phi)], axis=1)
    t, w = flow.motion.t.numpy(), (flow.A[:, :, None] * tensor(travel.x) + flow.B[:, :, None]).numpy()
    memory = travel.memory(t, w[0], lambda: np.abs(w).max(axis=0))
    out = np.empty((travel.arm.n_links, 2, len(t) + 1))
    strip_loads(with_first(t), np.ascontiguousarray(kinematics), travel.x, travel.arm.D, travel.constants, *travel.curves, *travel.rule,
                flow.motion.steady, memory, out)
    return out[:, 0, 1:].T, out[:, 1, 1:].T


def torch_torque(travel, flow):
    """Joint torques (n, joints) of the terms themselves."""
    return sum(term.torque(flow) for term in travel.terms)


def assert_equal(travel, flow):
    force, moment = (tensor(x) for x in kernel_loads(travel, flow))
    got, want = flow.normal_columns(force, moment).sum(-1), torch_torque(travel, flow)
    assert float((got - want).abs().max()) <= EQUAL * max(float(want.abs().max()), 1e-3)


def travelling(a, seed, options, bsplines=False):
    """Terms with random curves."""
    rng = np.random.default_rng(seed)
    loads = bspline_loads(a, 5, **options) if bsplines else state_loads(a, **options)
    loads = with_tau_s(loads, float(rng.uniform(2, 15)))
    terms = [term for term in loads.terms.values() if isinstance(term, TravelTerm)]
    drawn = [replace(term, **{f.name: tuple(rng.uniform(-1, 3, len(getattr(term, f.name)))) for f in term.linear_fields()})
             if hasattr(term, "linear_names") else term for term in terms]
    return TravelLoads(a, drawn)
