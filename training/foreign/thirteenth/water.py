"""Hidden effects of the water: wakes, shedding, memory, buoyancy, rubbing along a link, waves and currents."""

from collections.abc import Callable

import numpy as np
from effects import Effect
from machines import GRAVITY, Arm, Array
from mechanics import Flow, Strips, directions, half_drag, point, strips, water_torques
from motions import Motion
from responses import lag
from scipy.signal import fftconvolve


def young_wake(machine: Arm, mo: Motion, i: int, s: Strips) -> Array:
    """McLain & Rock's dependence on the travel since rest or reversal: C_D overshoots at 3.8 D, C_M falls from 1 and recovers."""
    travel, run, last = np.zeros_like(mo.t), 0.0, 0.0
    for k in range(mo.t.size):
        sign = np.sign(mo.dq[0, k]) if abs(mo.dq[0, k]) > 1e-3 else 0.0
        run = run + abs(mo.dq[0, k]) * mo.dt if sign == last else 0.0
        travel[k], last = run, sign
    r = np.outer(s.x, travel) / machine.diameter[i]
    cd = 0.80 * (1 - np.exp(-((r / 1.7) ** 2))) + 0.38 * np.exp(-(((r - 3.8) / 1.6) ** 2))
    cm = 0.40 + 0.60 * np.exp(-((r / 2.2) ** 2)) - 0.18 * np.exp(-(((r - 4.3) / 1.5) ** 2))
    return (cd - machine.cd[i]) * half_drag(machine, i) * np.abs(s.w) * s.w + (cm - machine.cm[i]) * machine.density * np.pi * (
        machine.diameter[i] ** 2 / 4) * s.dw


def drag_crisis(machine: Arm, _: Motion, i: int, s: Strips) -> Array:
    """A rough cylinder's C_D falls over a logistic curve of log Re about 5.5e4 (Achenbach's rough cylinders)."""
    re = np.abs(s.w) * machine.diameter[i] / machine.viscosity
    return -0.4 / (1 + (5.5e4 / np.maximum(re, 1.0)) ** 5) * half_drag(machine, i) * np.abs(s.w) * s.w


def left_behind(machine: Arm, mo: Motion, i: int, s: Strips) -> Array:
    """The dragged water follows a strip over 6 diameters of travel and fades in 4 s; where it runs ahead of the strip, it pushes it."""
    v, lead = np.zeros(s.x.size), np.zeros_like(s.w)
    for k in range(mo.t.size):
        w = s.w[:, k]
        rate = (np.abs(w) + np.abs(v)) / (2 * 6 * machine.diameter[i])
        settle = np.exp(-rate * mo.dt)
        v = (w + (v - w) * settle) * np.exp(-mo.dt / 4.0 * (np.abs(w) < np.abs(v)))
        lead[:, k] = np.sign(v) * np.maximum(np.sign(v) * (v - w), 0)
    rel = s.w - 0.45 * lead
    return machine.cd[i] * half_drag(machine, i) * (np.abs(rel) * rel - np.abs(s.w) * s.w)


def slow_drag(share: float, seconds: float) -> Callable[[Arm, Motion, int, Strips], Array]:
    """A share of the drag follows the quasi-steady drag with a first-order lag."""
    def law(machine: Arm, mo: Motion, i: int, s: Strips) -> Array:
        drag = machine.cd[i] * half_drag(machine, i) * np.abs(s.w) * s.w
        return share * (lag(drag, seconds, mo.dt) - drag)
    return law


def shedding(seed: int) -> Callable[[Arm, Motion, int, Strips], Array]:
    """In-line force at twice the shedding frequency, one cell per link, its phase wandering slowly."""
    rng = np.random.default_rng(seed)

    def law(machine: Arm, mo: Motion, i: int, s: Strips) -> Array:
        speed = (s.weight[:, None] * np.abs(s.w)).sum(0) / machine.length[i]
        pitch = 4 * np.pi * 0.19 * speed / machine.diameter[i]
        wander = np.cumsum(rng.normal(size=mo.t.size) * np.sqrt(mo.dt * 0.01 * pitch))
        return 0.22 * half_drag(machine, i) * np.abs(s.w) * s.w * np.sin(np.cumsum(pitch) * mo.dt + rng.uniform(0, 6.28) + wander)
    return law


def basset(machine: Arm, mo: Motion, tau: Array) -> Array:
    """Basset's force on a turning single link: product integration of the angular acceleration over 1/sqrt(t)."""
    edges = np.arange(mo.t.size + 1) * mo.dt
    kernel = 2 * (np.sqrt(edges[1:]) - np.sqrt(edges[:-1]))
    memory = fftconvolve(mo.ddq[0], kernel)[: mo.t.size]
    return tau + 2 * machine.density * machine.diameter[0] * np.sqrt(np.pi * machine.viscosity) * machine.length[0] ** 3 / 3 * memory


def link_wake(machine: Arm) -> Effect:
    """Link 2 in the far wake of link 1 under tow: Schlichting's deficit sqrt(C_D D / 4 d), at most 0.75, behind the span of link 1."""
    def apply(_: Arm, mo: Motion, tau: Array) -> Array:
        c1, s1 = np.cos(mo.q[0]), np.sin(mo.q[0])
        second = strips(machine, mo, 1)
        m = directions(mo)[1][:, 1]
        place = np.stack([point(machine, mo, 1, x)[0] for x in second.x], axis=1)
        along = place[0] / np.where(np.abs(c1) < 0.15, 0.15, c1)
        inside = 1 / (1 + np.exp(-np.clip(np.minimum(along, machine.length[0] - along) / (0.5 * machine.diameter[0]), -40, 40)))
        behind = np.sign(mo.u0) * (along * s1 - place[1]) / machine.diameter[0]
        deficit = np.minimum(0.75, np.sqrt(machine.cd[0] / (4 * np.maximum(behind, 0.1)))) * np.clip(behind, 0, 1)
        w = second.w - mo.u0 * deficit * inside * m[1]
        return tau + second.torque(machine.cd[1] * half_drag(machine, 1) * (np.abs(w) * w - np.abs(second.w) * second.w))
    return Effect("link_interference", 2, apply)


def buoyancy() -> Effect:
    """Archimedes: each link is lifted at its middle by the water that it displaces."""
    def apply(machine: Arm, mo: Motion, tau: Array) -> Array:
        for i in range(machine.links):
            jac = point(machine, mo, i, machine.length[i] / 2)[2]
            volume = np.pi * machine.diameter[i] ** 2 / 4 * machine.length[i]
            tau = tau - machine.density * volume * GRAVITY * jac[1]
        return tau
    return Effect("buoyancy_tilt", None, apply)


def axial_rub(coefficient: float) -> Effect:
    """Quadratic rubbing along each link."""
    def apply(machine: Arm, mo: Motion, tau: Array) -> Array:
        for i in range(machine.links):
            s = strips(machine, mo, i)
            tau = tau + coefficient * half_drag(machine, i) * machine.length[i] * np.abs(s.axial) * s.axial * s.axial_lever
        return tau
    return Effect("axial_drag", None, apply)


def wave(amplitude: float, hz: float, heading: float, seed: int) -> Effect:
    """A regular deep-water wave seen in the plane of the arm; each recording starts at its own phase."""
    rng = np.random.default_rng(seed)

    def apply(machine: Arm, mo: Motion, tau: Array) -> Array:
        omega, d, start = 2 * np.pi * hz, np.array([np.cos(heading), np.sin(heading)]), rng.uniform(0, 6.28)
        travelled = np.cumsum(mo.u0) * mo.dt

        def flow(place: Array, t: Array) -> tuple[Array, Array]:
            run = d[0] * place[0] + d[1] * (place[1] + travelled)
            psi = omega * t - omega**2 / GRAVITY * run + start
            return amplitude * np.cos(psi) * d[:, None, None], -amplitude * omega * np.sin(psi) * d[:, None, None]
        return tau + water_torques(machine, mo, flow=flow) - water_torques(machine, mo)
    return Effect("wave_orbital", None, apply)


def uniform_current(cx: float, cy: float) -> Flow:
    """A current of one velocity everywhere."""
    def flow(place: Array, _: Array) -> tuple[Array, Array]:
        c = np.array([cx, cy])[:, None, None] * np.ones_like(place)
        return c, 0 * c
    return flow
