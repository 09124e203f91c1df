"""Torques of an arm without any hidden effect: rigid bodies, stated friction, and strips in water."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from machines import Arm, Array
from motions import Motion
from responses import presliding

NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)
Flow = Callable[[Array, Array], tuple[Array, Array]]  # of places and times: the water's velocity and its derivative


def directions(mo: Motion) -> tuple[Array, Array]:
    """Unit vectors along and across each link, [2, n, rows]."""
    c, s = np.cos(mo.phi), np.sin(mo.phi)
    return np.stack([c, s]), np.stack([-s, c])


def point(machine: Arm, mo: Motion, i: int, x: float, beyond_y: Array | float = 0.0) -> tuple[Array, Array, Array]:
    """Place, acceleration and Jacobian [2, n, rows] of the point x along (and y across) link i, from the hub; y held fixed."""
    e, m = directions(mo)
    w, dw = np.cumsum(mo.dq, axis=0), np.cumsum(mo.ddq, axis=0)
    place, acc = np.zeros_like(mo.hub), mo.dhub.copy()
    joints = []
    for k in range(i + 1):
        joints.append(place.copy())
        along, across = (machine.length[k], 0.0) if k < i else (x, beyond_y)
        place = place + along * e[:, k] + across * m[:, k]
        acc = acc + along * (dw[k] * m[:, k] - w[k] ** 2 * e[:, k]) + across * (-dw[k] * e[:, k] - w[k] ** 2 * m[:, k])
    jac = np.zeros((2, machine.links, mo.t.size))
    for j in range(i + 1):
        arm_of = place - joints[j]
        jac[:, j] = np.stack([-arm_of[1], arm_of[0]])
    return place, acc, jac


def rigid_torques(machine: Arm, mo: Motion) -> Array:
    """Torques of the dry arm by virtual work of the masses' inertia and weight."""
    tau = np.zeros_like(mo.q)
    spin = np.cumsum(mo.ddq, axis=0)
    for i in range(machine.links):
        _, acc, jac = point(machine, mo, i, machine.com[i])
        acc[1] += machine.gravity
        tau += machine.mass[i] * np.einsum("djt,dt->jt", jac, acc)
        tau[: i + 1] += machine.inertia[i] * spin[i]
    if machine.rotor is not None:
        tau += machine.rotor[:, None] * mo.ddq
    if machine.coulomb is not None and machine.viscous is not None:
        for j in range(machine.links):
            tau[j] += machine.coulomb[j] * presliding(mo.q[j], 0.0005) + machine.viscous[j] * mo.dq[j]
    return tau


@dataclass
class Strips:
    """The strips of one link: places x, weights, normal velocity and its derivative [strips, rows], axial velocity, levers."""

    x: Array
    weight: Array
    w: Array
    dw: Array
    axial: Array
    lever: Array
    axial_lever: Array

    def torque(self, force: Array) -> Array:
        """Joint torques of a normal load per length, [n, rows]."""
        return np.einsum("s,st,jst->jt", self.weight, force, self.lever)


def strips(machine: Arm, mo: Motion, i: int) -> Strips:
    """Velocities at Gauss points of link i and the levers of their forces about all joints."""
    x = machine.length[i] * (NODES + 1) / 2
    phi, spin, dspin = mo.phi, np.cumsum(mo.dq, axis=0), np.cumsum(mo.ddq, axis=0)
    e, m = directions(mo)
    b = (mo.hub * m[:, i]).sum(0)
    db = (mo.dhub * m[:, i]).sum(0) - spin[i] * (mo.hub * e[:, i]).sum(0)
    axial = (mo.hub * e[:, i]).sum(0)
    lever, axial_lever = np.zeros((machine.links, x.size, mo.t.size)), np.zeros((machine.links, mo.t.size))
    lever[: i + 1] = x[:, None]
    for k in range(i):
        c, s = machine.length[k] * np.cos(phi[i] - phi[k]), machine.length[k] * np.sin(phi[i] - phi[k])
        b = b + spin[k] * c
        db = db + dspin[k] * c - spin[k] * (spin[i] - spin[k]) * s
        axial = axial + spin[k] * s
        lever[: k + 1] += c
        axial_lever[: k + 1] += s
    return Strips(x, machine.length[i] / 2 * WEIGHTS, np.outer(x, spin[i]) + b, np.outer(x, dspin[i]) + db, axial, lever, axial_lever)


def half_drag(machine: Arm, i: int) -> float:
    """Half of density times diameter."""
    return 0.5 * machine.density * machine.diameter[i]


def water_torques(machine: Arm, mo: Motion, cd: Array | None = None, cm: Array | None = None, flow: Flow | None = None) -> Array:
    """Torques of normal drag and added mass (body-frame derivative); flow(place, t) gives the water's velocity and d/dt at a place."""
    tau = np.zeros_like(mo.q)
    if not machine.density:
        return tau
    cd, cm = machine.cd if cd is None else cd, machine.cm if cm is None else cm
    _, m = directions(mo)
    for i in range(machine.links):
        s = strips(machine, mo, i)
        w, dw, extra = s.w, s.dw, 0.0
        area = machine.density * np.pi * machine.diameter[i] ** 2 / 4
        if flow is not None:
            place = np.stack([point(machine, mo, i, x)[0] for x in s.x], axis=1)
            c, dc = flow(place, mo.t)
            across = (c * m[:, i][:, None]).sum(0)
            w = w - across
            dw = dw - np.gradient(across, mo.dt, axis=1)
            extra = -area * (dc * m[:, i][:, None]).sum(0)
        tau += s.torque(0.5 * machine.density * machine.diameter[i] * cd[i] * np.abs(w) * w + cm[i] * area * dw + extra)
    return tau


def bare_torques(machine: Arm, mo: Motion) -> Array:
    """What the drives must supply without any hidden effect."""
    return rigid_torques(machine, mo) + water_torques(machine, mo)
