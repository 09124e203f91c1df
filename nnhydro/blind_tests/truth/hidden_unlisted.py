"""Causes that are on no list, and baselines whose form is slightly wrong: what a diagnosis must not give a wrong name.

    unlisted:hum        a tone at fixed frequency in time, phase by chance            unlisted:kick   blows at random moments of some runs
    unlisted:cable_slap a decaying knock whenever the joint passes an angle upwards   unlisted:warm_seal  b exp(-s/s0) dq, s way turned
    unlisted:slosh      water in the link: a resonator driven by the joint's acceleration
    base_form:exponent  |w|^0.9 w                     base_form:span   C_D (1 +- 0.1 (2x/L - 1))
    base_form:tip_loss  C_D falls by 15 % over the last two D             base_form:added_mass_span  C_M (1 +- 0.1 (2x/L - 1))
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from nnhydro.blind_tests.truth.flow import LinkFlow
from nnhydro.blind_tests.truth.registry import draw_joint, hides
from nnhydro.blind_tests.truth.world import Array, Cause, Draft, Generator, TrueArm, TrueRun, on_joint


def _at_joint(name: str, joint: int, law: str, torque: Callable[[TrueRun, Array], Array], chance: bool = False, near: tuple[str, ...] = (),
              size: float = 1.0) -> Cause:
    def load(run: TrueRun, tau: Array) -> Array:
        """Return the extra joint torques (n, joints) N m: `size` times `torque` at the joint."""
        return size * on_joint(torque(run, tau), joint, tau.shape[1])
    return Cause(f"unlisted:{name}", joint, "unlisted", law, {"size": (size, "N m")}, load=load, chance=chance, near=near)


@hides("unlisted:hum", no_belt=True)
def hum(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a tone."""
    joint, f = draw_joint(rng, arm), float(rng.uniform(2.0, 4.0))

    def torque(run: TrueRun, tau: Array) -> Array:
        """Return the torque (n,) N m of unit size: sin(2 pi f t + phase), the phase drawn anew in every run."""
        return np.sin(2 * np.pi * f * run.t + np.random.default_rng([run.seed, 17]).uniform(0, 2 * np.pi))
    return Draft(lambda a: _at_joint("hum", joint, "a tone at fixed frequency", torque, True, size=a), 1e-4, 2.0)


@hides("unlisted:kick", no_belt=True)
def kick(rng: Generator, arm: TrueArm) -> Draft:
    """Draw blows."""
    joint = draw_joint(rng, arm)

    def torque(run: TrueRun, tau: Array) -> Array:
        """Return the torque (n,) N m of unit size: two blows of 0.12 s, in six runs of ten."""
        chance = np.random.default_rng([run.seed, 19])
        sizes, moments = chance.normal(0, 1.5, 2), chance.uniform(0, run.t[-1], 2)
        blows = [s * np.exp(-(((run.t - at) / 0.12) ** 2)) for s, at in zip(sizes, moments, strict=True)]
        return np.sum(blows, axis=0) if chance.random() < 0.6 else np.zeros(len(run.t))
    return Draft(lambda a: _at_joint("kick", joint, "blows at random moments", torque, True, size=a), 1e-3, 6.0)


@hides("unlisted:cable_slap", no_belt=True)
def cable_slap(rng: Generator, arm: TrueArm) -> Draft:
    """Draw the angle at which a cable knocks."""
    joint, at = draw_joint(rng, arm), float(rng.uniform(-0.5, 0.5))

    def torque(run: TrueRun, tau: Array) -> Array:
        """Return the torque (n,) N m of unit size: exp(-s/0.25) cos(2 pi 2.2 s), s seconds after the joint has passed `at` upwards."""
        q = run.q[:, joint - 1]
        passed = np.zeros(len(q))
        passed[1:] = (q[1:] >= at) & (q[:-1] < at)
        s = np.arange(0.0, 1.2, run.dt)
        return np.convolve(passed, np.exp(-s / 0.25) * np.cos(2 * np.pi * 2.2 * s))[: len(q)]
    return Draft(lambda a: _at_joint("cable_slap", joint, "a knock when the joint passes an angle", torque, size=a), 1e-3, 6.0)


@hides("unlisted:warm_seal", no_belt=True)
def warm_seal(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a seal that warms up in every run."""
    joint, way = draw_joint(rng, arm), float(rng.uniform(1.5, 4.0))

    def torque(run: TrueRun, tau: Array) -> Array:
        """Return the torque (n,) N m of unit size: dq exp(-angle turned since the start / way)."""
        v = run.qd[:, joint - 1]
        return v * np.exp(-np.cumsum(np.abs(v)) * run.dt / way)
    return Draft(lambda a: _at_joint("warm_seal", joint, "viscous friction that fades as the seal warms", torque,
                                     near=("viscous_friction", "coulomb_friction"), size=a), 1e-3, 4.0)


@hides("unlisted:slosh", no_belt=True)
def slosh(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a resonator."""
    joint, omega, zeta = draw_joint(rng, arm), 2 * np.pi * float(rng.uniform(0.7, 1.6)), 0.04

    def torque(run: TrueRun, tau: Array) -> Array:
        """Return the torque (n,) N m of unit size: y'' + 2 zeta omega y' + omega^2 y = omega^2 ddq."""
        p = np.exp((-zeta + 1j * np.sqrt(1 - zeta**2)) * omega * run.dt)
        y: Array = lfilter([0.0, omega**2 * run.dt**2], [1.0, -2 * p.real, abs(p) ** 2], run.qdd[:, joint - 1])
        return y
    return Draft(lambda a: _at_joint("slosh", joint, "water sloshing in a link", torque, size=a), 1e-4, 2.0)


def _form(name: str, near: tuple[str, ...], change: Callable[[LinkFlow, float], LinkFlow], size: float) -> Draft:
    def make(a: float) -> Cause:
        """Return the cause whose size is `a`."""
        return Cause(f"base_form:{name}", None, "base_form", name, {"size": (a, "1")}, lambda flow: change(flow, a), order=1, near=near)
    return Draft(make, size, size)


@hides("base_form:exponent")
def exponent(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a drag that grows with a power other than two."""
    return _form("exponent", ("drag_form", "reynolds_drag"),
                 lambda flow, a: flow.times((np.abs(flow.w) / 0.5 + 1e-3) ** -a), float(rng.uniform(0.05, 0.12)))


@hides("base_form:span")
def span(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a C_D that varies by 10 % along the span."""
    return _form("span", ("drag_form",), lambda flow, a: flow.times(1 + a * (2 * flow.x / flow.link.length - 1)),
                 float(rng.choice([-1, 1]) * rng.uniform(0.06, 0.12)))


@hides("base_form:tip_loss")
def tip_loss(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a free end that loses drag."""
    return _form("tip_loss", ("drag_form", "tip_drag"),
                 lambda flow, a: flow.times(1 - a * np.exp((flow.x - flow.link.length) / (2 * flow.link.diameter))),
                 float(rng.uniform(0.1, 0.2)))


@hides("base_form:added_mass_span")
def added_mass_span(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a C_M that varies by 10 % along the span."""
    return _form("added_mass_span", ("drag_form",),
                 lambda flow, a: replace(flow, C_M=flow.C_M * (1 + a * (2 * flow.x / flow.link.length - 1))),
                 float(rng.choice([-1, 1]) * rng.uniform(0.06, 0.12)))
