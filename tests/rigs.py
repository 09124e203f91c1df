"""Arms and motions that the tests share, and how closely their claims must hold."""

from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LoadTerm
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.arm import Arm

CLOSE = {"rtol": 1e-11, "atol": 1e-11}  # exact formulas on torques of 0.1 to 100 N m: a few hundred roundings of float64
AUTOGRAD = {"rtol": 1e-9, "atol": 1e-9}  # second derivatives of energies lose two digits more

LINKS = (
    {"length_m": 0.55, "diameter_m": 0.07, "mass_kg": 1.1, "com_m": 0.27, "inertia_kg_m2": 0.026},
    {"length_m": 0.45, "diameter_m": 0.06, "mass_kg": 1.4, "com_m": 0.22, "inertia_kg_m2": 0.024},
    {"length_m": 0.30, "diameter_m": 0.05, "mass_kg": 0.7, "com_m": 0.16, "inertia_kg_m2": 0.006},
)
HOSTILE = 'x */ int hidden(void) { return 1; } /* y --> <include file="z"/> <!-- \x1b[2J'  # a name that comes from a file of others


def arm(links: int = 2, density: float = 1000.0, **keys: Any) -> Arm:
    """Return an arm with 1, 2 or 3 unlike links; `keys` are those of arm.yaml."""
    return Arm.model_validate({"fluid": {"density_kg_m3": density}, "links": LINKS[:links], **keys})


def scaled(a: Arm, k: float) -> Arm:
    """Return the geometrically similar arm, `k` times as large and of the same materials."""
    powers = {"length_m": 1, "diameter_m": 1, "com_m": 1, "mass_kg": 3, "inertia_kg_m2": 5}
    links = [{key: value * k ** powers.get(key, 0) for key, value in link.items()} for link in LINKS[:a.n_links]]
    return Arm.model_validate({**a.document(), "links": links})


def states(links: int, rows: int = 50, seed: int = 1, u0: float = 0.8) -> Motion:
    """Return unrelated random states: rates around 2 rad/s, accelerations around 5 rad/s^2, carriage speed around `u0` m/s."""
    rng = np.random.default_rng(seed)
    q, qd, qdd = rng.uniform(-3, 3, (rows, links)), 2 * rng.standard_normal((rows, links)), 5 * rng.standard_normal((rows, links))
    return Motion.at(q, qd, qdd, u0 * rng.standard_normal(rows), u0 * rng.standard_normal(rows))


def run(links: int, rows: int = 60, seed: int = 1) -> Motion:
    """Return one run in time order, 6 s from rest: two sines a joint and a sine of the carriage, with exact derivatives."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 6.0, rows)
    a, w = rng.uniform(0.2, 0.8, (2, links + 1)), rng.uniform(1.0, 3.0, (2, links + 1))
    phase = w * t[:, None, None]  # (rows, 2, links + 1)
    x, v, acc = ((a * f).sum(1) for f in (1 - np.cos(phase), w * np.sin(phase), w**2 * np.cos(phase)))
    q, qd, qdd = (tensor(y[:, :links]) for y in (x, v, acc))
    return Motion(tensor(t), q, qd, qdd, tensor(v[:, links]), tensor(acc[:, links]))


def at_rest(links: int, rows: int = 20, seed: int = 1) -> Motion:
    """Return random postures in which nothing moves."""
    return Motion.at(np.random.default_rng(seed).uniform(-3, 3, (rows, links)), 0.0, 0.0)


def without_acceleration(motion: Motion) -> Motion:
    """Return `motion` with every acceleration 0."""
    return replace(motion, qdd=torch.zeros_like(motion.qdd), du0=torch.zeros_like(motion.du0))


def hub_at_rest(motion: Motion) -> Motion:
    """Return `motion` with a carriage that stands still."""
    return replace(motion, u0=torch.zeros_like(motion.u0), du0=torch.zeros_like(motion.du0))


def mirrored_about_Y(m: Motion) -> Motion:
    """Return the motion seen in a mirror along the direction of tow."""
    q = -m.q
    q[:, 0] = torch.pi - m.q[:, 0]
    return replace(m, q=q, qd=-m.qd, qdd=-m.qdd)


def mirrored_about_X(m: Motion) -> Motion:
    """Return the motion seen in a mirror across the direction of tow."""
    return replace(m, q=-m.q, qd=-m.qd, qdd=-m.qdd, u0=-m.u0, du0=-m.du0)


def half_turned(m: Motion) -> Motion:
    """Return the motion turned by half a turn in its plane."""
    q = m.q.clone()
    q[:, 0] += torch.pi
    return replace(m, q=q, u0=-m.u0, du0=-m.du0)


def torque(term: LoadTerm, a: Arm, motion: Motion) -> Tensor:
    """Return the torque (n, joints) of `term`."""
    return term.torque(Flow(a, motion))


def assert_close(got: Tensor, want: Tensor, rtol: float = CLOSE["rtol"], atol: float = CLOSE["atol"]) -> None:
    """Assert that two tensors agree; the default tolerance is that of exact formulas."""
    torch.testing.assert_close(got, want, rtol=rtol, atol=atol)
