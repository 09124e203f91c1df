"""Motions that are solved for: a soft or loose drive at joint 2, a link that swings freely, a hub on a swaying mount."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from effects import Effect
from machines import Arm, Array
from mechanics import bare_torques, directions, half_drag, point, strips
from motions import Motion
from responses import mode
from scipy.integrate import solve_ivp


def drag_moment(a: float, b: float, length: float) -> float:
    """The integral of |a x + b| (a x + b) x over the link, in closed form on pieces of one sign."""
    def piece(lo: float, hi: float) -> float:
        s = 1.0 if a * (lo + hi) / 2 + b >= 0 else -1.0
        return s * (a * a * (hi**4 - lo**4) / 4 + 2 * a * b * (hi**3 - lo**3) / 3 + b * b * (hi * hi - lo * lo) / 2)
    cut = -b / a if a else -1.0
    return piece(0, cut) + piece(cut, length) if 0 < cut < length else piece(0, length)


def loose_second_joint(machine: Arm, mo: Motion, spring: Callable[[float, float], float]) -> Motion:
    """The links' motion where a spring(twist, rate) lies between drive 2 and link 2; hub fixed; RK4 with two grid steps to one."""
    l1, l2, m2, c2 = machine.length[0], machine.length[1], machine.mass[1], machine.com[1]
    body = machine.inertia[1] + m2 * c2 * c2
    area = machine.cm[1] * machine.density * np.pi * machine.diameter[1] ** 2 / 4
    half = 0.5 * machine.density * machine.diameter[1] * machine.cd[1]
    v1, a1, th, dth = (list(map(float, v)) for v in (mo.dq[0], mo.ddq[0], mo.q[1], mo.dq[1]))

    def rates(k: int, q: float, v: float) -> float:
        cos, sin = np.cos(q), np.sin(q)
        given = m2 * l1 * c2 * (a1[k] * cos + v1[k] ** 2 * sin) + area * l1 * (a1[k] * cos - v1[k] * v * sin) * l2 * l2 / 2
        given += half * drag_moment(v1[k] + v, l1 * v1[k] * cos, l2)
        return (spring(th[k] - q, dth[k] - v) - given) / (body + area * l2**3 / 3) - a1[k]
    h, n = 2 * mo.dt, (len(th) - 1) // 2
    q, v = th[0], dth[0]
    out = np.zeros((3, n + 1))
    for s in range(n + 1):
        k = 2 * s
        f1 = rates(k, q, v)
        out[:, s] = q, v, f1
        if s == n:
            break
        f2 = rates(k + 1, q + h / 2 * v, v + h / 2 * f1)
        f3 = rates(k + 1, q + h / 2 * v + h * h / 4 * f1, v + h / 2 * f2)
        f4 = rates(k + 2, q + h * v + h * h / 2 * f2, v + h * f3)
        q, v = q + h * v + h * h / 6 * (f1 + f2 + f3), v + h / 6 * (f1 + 2 * f2 + 2 * f3 + f4)
    coarse = slice(0, 2 * n + 1, 2)
    link = Motion(mo.t[coarse], mo.q[:, coarse].copy(), mo.dq[:, coarse].copy(), mo.ddq[:, coarse].copy(), mo.u0[coarse], mo.du0[coarse],
                  mo.step // 2, mo.kind)
    link.q[1], link.dq[1], link.ddq[1] = out
    return link


def loose_drive(name: str, spring: Callable[[float, float], float]) -> Effect:
    """A drive at joint 2 with a spring or a gap: the recorded angles are the drive's, the torque is what passes."""
    def apply(machine: Arm, mo: Motion, tau: Array) -> Array:
        link = loose_second_joint(machine, mo, spring)
        passed = bare_torques(machine, link)
        out = tau.copy()
        for j in range(2):
            out[j] = np.interp(mo.t, link.t, passed[j])
        return out
    return Effect(name, 2, apply)


def free_swing(machine: Arm, start: float, seconds: float, rate_hz: float, extra: Callable[[float], float] = lambda _: 0.0) -> Motion:
    """A single link that swings freely under its weight, drag and an extra torque that resists it, tau = 0."""
    length, area = machine.length[0], machine.density * np.pi * machine.diameter[0] ** 2 / 4
    total = machine.inertia[0] + machine.mass[0] * machine.com[0] ** 2 + machine.cm[0] * area * length**3 / 3
    half = 0.5 * machine.density * machine.diameter[0] * machine.cd[0] * length**4 / 4
    weight = machine.mass[0] * machine.gravity * machine.com[0]

    def rates(_: float, y: Array) -> list[float]:
        return [y[1], -(weight * np.cos(y[0]) + half * abs(y[1]) * y[1] + extra(y[0] + np.pi / 2)) / total]
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    y = solve_ivp(rates, (0, t[-1]), [start - np.pi / 2, 0.0], "DOP853", t, rtol=1e-10, atol=1e-12).y
    acc = np.array([rates(0, v)[1] for v in y.T])
    return Motion(t, y[:1], y[1:], acc[None], 0 * t, 0 * t, 1, "free decay")


def hub_force(machine: Arm, mo: Motion) -> Array:
    """The force that the hub supplies to the arm, [rows, 2]."""
    force = np.zeros_like(mo.hub)
    m = directions(mo)[1]
    for i in range(machine.links):
        force += machine.mass[i] * point(machine, mo, i, machine.com[i])[1]
        s = strips(machine, mo, i)
        load = machine.cd[i] * half_drag(machine, i) * np.abs(s.w) * s.w + machine.cm[i] * machine.density * np.pi * (
            machine.diameter[i] ** 2 / 4) * s.dw
        force += (s.weight[:, None] * load).sum(0) * m[:, i]
    return force.T


def swaying_mount(hz: float, zeta: float, mass: float, angle: float) -> Effect:
    """The hub sways in one direction on a mount; motion found by iterating the hub's force until it no longer changes."""
    def apply(machine: Arm, mo: Motion, tau: Array) -> Array:
        d = np.array([np.cos(angle), np.sin(angle)])
        m_arm, y2, now = machine.mass.sum(), np.zeros_like(mo.t), mo
        total = mass + 1.6 * m_arm
        for _ in range(40):
            force = hub_force(machine, now) @ d
            y, dy = mode(-(force - 1.6 * m_arm * y2) / total, hz, zeta, mo.dt)
            new = -(force - 1.6 * m_arm * y2) / total - 4 * np.pi * hz * zeta * dy - (2 * np.pi * hz) ** 2 * y
            change, y2 = np.abs(new - y2).max(), new
            now = replace(mo, hub=mo.hub + d[:, None] * dy, dhub=mo.dhub + d[:, None] * y2)
            if change < 1e-6 * np.abs(new).max():
                break
        else:
            raise RuntimeError("the swaying mount did not converge")
        return tau + bare_torques(machine, now) - bare_torques(machine, mo)
    return Effect("flexible_mount", None, apply)
