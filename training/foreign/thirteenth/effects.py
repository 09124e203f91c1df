"""Hidden effects: how one acts, and those of joints, sensors and a load at the tip."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from machines import Arm, Array
from mechanics import Flow, Strips, point, strips, water_torques
from motions import Motion
from responses import lag, presliding


@dataclass
class Effect:
    """One hidden effect: apply(arm, motion, torque) returns the torque with it."""

    name: str
    joint: int | None
    apply: Callable[[Arm, Motion, Array], Array]
    accept: list[str] = field(default_factory=list)
    part: bool = False


def on_reading(name: str, joint: int, law: Callable[[Motion, Array], Array], **more: Any) -> Effect:
    """An effect of one torque channel, computed from all torques."""
    def apply(_: Arm, mo: Motion, tau: Array) -> Array:
        out = tau.copy()
        out[joint - 1] = law(mo, tau)
        return out
    return Effect(name, joint, apply, **more)


def on_joint(name: str, joint: int, law: Callable[[Motion], Array], **more: Any) -> Effect:
    """An effect that adds a torque at one joint."""
    return on_reading(name, joint, lambda mo, tau: tau[joint - 1] + law(mo), **more)


def on_strips(name: str, law: Callable[[Arm, Motion, int, Strips], Array]) -> Effect:
    """An effect that adds a normal load per length to the links."""
    def apply(machine: Arm, mo: Motion, tau: Array) -> Array:
        for i in range(machine.links):
            s = strips(machine, mo, i)
            tau = tau + s.torque(law(machine, mo, i, s))
        return tau
    return Effect(name, None, apply)


def on_tip(name: str, force: Callable[[Array, Motion], Array], **more: Any) -> Effect:
    """An effect of a force at the tip that the drives must supply, from the tip's velocity."""
    def apply(machine: Arm, mo: Motion, tau: Array) -> Array:
        _, _, jac = point(machine, mo, machine.links - 1, machine.length[-1])
        velocity = mo.hub + np.einsum("djt,jt->dt", jac, mo.dq)
        return tau + np.einsum("djt,dt->jt", jac, force(velocity, mo))
    return Effect(name, None, apply, **more)


def in_flow(name: str, flow: Flow, since: float = 0.0) -> Effect:
    """An effect of water that moves, in all recordings from a time of day on."""
    def apply(machine: Arm, mo: Motion, tau: Array) -> Array:
        return tau + water_torques(machine, mo, flow=flow) - water_torques(machine, mo) if mo.clock >= since else tau
    return Effect(name, None, apply, part=since > 0)


def stribeck(joint: int, sliding: float, peak: float, speed: float, power: float) -> Effect:
    """LuGre's contact with a level that falls from peak to sliding over the speed."""
    def law(mo: Motion) -> Array:
        level = sliding + (peak - sliding) * np.exp(-((np.abs(mo.dq[joint - 1]) / speed) ** power))
        return presliding(mo.q[joint - 1], 0.0008, level)
    return on_joint("stribeck_friction", joint, law)


def gear_loss(joint: int, efficiency: float) -> Effect:
    """Mesh efficiency: the drive supplies tau / efficiency where it drives, and holds only tau * efficiency where it is driven back."""
    def law(mo: Motion, tau: Array) -> Array:
        load, z = tau[joint - 1], presliding(mo.q[joint - 1], 0.001)
        return load + np.abs(load) * z * np.where(load * z > 0, 1 / efficiency - 1, 1 - efficiency)
    return on_reading("load_friction", joint, law)


def sensor_timing(lag_s: float, delay_s: float) -> Effect:
    """The torque channels pass a first-order low-pass and a delay."""
    def apply(_: Arm, mo: Motion, tau: Array) -> Array:
        slow = lag(tau, lag_s, mo.dt)
        return np.stack([np.interp(mo.t - delay_s, mo.t, row) for row in slow])
    return Effect("sensor_timing", None, apply)


def encoder_offset(joint: int, offset: float) -> Effect:
    """The angle of one joint is recorded with a constant error."""
    def apply(_: Arm, mo: Motion, tau: Array) -> Array:
        mo.read_offset[joint - 1] = offset
        return tau
    return Effect("encoder_offset", joint, apply)


def payload(mass: float) -> Effect:
    """A point mass at the tip (weight included where the plane is upright)."""
    def apply(machine: Arm, mo: Motion, tau: Array) -> Array:
        _, acc, jac = point(machine, mo, machine.links - 1, machine.length[-1])
        acc[1] += machine.gravity
        return tau + mass * np.einsum("djt,dt->jt", jac, acc)
    return Effect("payload_mass", None, apply)
