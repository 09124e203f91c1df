"""Hidden causes in the wake: it grows with travel, lags, is met again, remembers the boundary layer, sheds.

    wake_development  C_D (1 - a exp(-s/l1)) or with an overshoot b (s/l2) exp(1 - s/l2); C_M falls as the wake grows
    flow_memory       T df/dt = f_quasi-steady - f, T a time (plain) or a travel l D / |w| (other)
    wake_reentry      drag of w - a Q: Q is how much faster the wake still runs than the link; one lag (plain) or two (other)
    history_force     c int dw/dt' K(t - t') dt', K = t^-1/2 (plain) or t^-1/2 exp(-t/T) (other)
    vortex_shedding   a f cos(2 Phi), dPhi/dt = 2 pi St |w| / D, each strip (plain) or cells of five D with jitter (other)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import fftconvolve

from nnhydro.blind_tests.truth.flow import LinkFlow
from nnhydro.blind_tests.truth.memory import follow, follow_at, since_reversal, wander
from nnhydro.blind_tests.truth.registry import hides
from nnhydro.blind_tests.truth.world import Array, Cause, Draft, Generator, TrueArm


@hides("wake_development")
def wake_development(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a wake that has to grow."""
    overshoot = bool(rng.random() < 0.5)
    l1, l2, loss = rng.uniform(1.2, 3.0), rng.uniform(3.0, 4.5), rng.uniform(0.2, 0.6)

    def make(a: float) -> Cause:
        """Return the cause whose depth is `a`."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            s = since_reversal(flow.w, flow.run.dt) / flow.link.diameter
            factor = 1 - a * np.exp(-s / l1) + (0.6 * a * (s / l2) ** 2 * np.exp(2 - 2 * s / l2) if overshoot else 0.0)
            return replace(flow.times(factor), C_M=flow.C_M * (1 - loss * a * (1 - np.exp(-s / l1))))
        return Cause("wake_development", None, "other" if overshoot else "plain",
                     "C_D starts low and grows with travel since the start or the last reversal",
                     {"depth": (a, "1"), "length": (l1, "D")}, water)
    return Draft(make, 0.02, 0.95)


@hides("flow_memory")
def flow_memory(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a drag that lags behind the motion."""
    by_travel = bool(rng.random() < 0.4)

    def make(a: float) -> Cause:
        """Return the cause whose travel is `8 * a` D."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            drag, dt = flow.drag, flow.run.dt
            if by_travel:
                lagged = follow_at(drag, 1 - np.exp(-dt * (np.abs(flow.w) + 0.02) / (8 * a * flow.link.diameter)))
            else:
                lagged = follow(drag, dt, a)
            return flow.with_normal_load(lagged - drag)
        size = {"travel": (8 * a, "D")} if by_travel else {"response_time": (a, "s")}
        return Cause("flow_memory", None, "other" if by_travel else "plain", "drag relaxes towards its quasi-steady value",
                     size, water, order=4)
    return Draft(make, 0.002, 0.8)


@hides("wake_reentry")
def wake_reentry(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a wake that runs on and meets the link."""
    T, twice = rng.uniform(0.4, 1.2), bool(rng.random() < 0.4)

    def make(a: float) -> Cause:
        """Return the cause whose strength is `a`."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            w = flow.w
            wake = follow(w, flow.run.dt, T)
            wake = follow(wake, flow.run.dt, T / 2) if twice else wake
            ahead = np.sign(wake) * np.maximum(np.abs(wake) - np.maximum(w * np.sign(wake), 0.0), 0.0)
            met = w - a * ahead
            k = 0.5 * flow.arm.rho * flow.link.diameter * flow.C_D
            return flow.with_normal_load(k * (np.abs(met) * met - np.abs(w) * w))
        return Cause("wake_reentry", None, "other" if twice else "plain", "the wake of earlier motion runs into the link",
                     {"strength": (a, "1"), "lifetime": (T, "s")}, water, order=3)
    return Draft(make, 0.02, 1.2)


@hides("history_force")
def history_force(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a boundary layer that remembers the acceleration."""
    fade = float(rng.uniform(1.0, 4.0)) if rng.random() < 0.4 else np.inf

    def make(a: float) -> Cause:
        """Return the cause whose strength is `a`."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            t = flow.run.t - flow.run.t[0]
            edges = np.concatenate([[0.0], t + 0.5 * flow.run.dt])
            kernel = np.diff(2 * np.sqrt(edges)) * np.exp(-t / fade)  # int t^-1/2 over each step
            past: Array = fftconvolve(flow.dw, kernel[:, None], axes=0)[: len(t)]
            return flow.with_normal_load(a * 0.5 * flow.section * past)
        return Cause("history_force", None, "plain" if np.isinf(fade) else "other", "convolution of the acceleration with t^-1/2",
                     {"strength": (a, "1")}, water, order=2)
    return Draft(make, 0.005, 2.0)


@hides("vortex_shedding")
def vortex_shedding(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a street of vortices whose phase is the run's own."""
    cells, St = bool(rng.random() < 0.4), rng.uniform(0.17, 0.21)

    def make(a: float) -> Cause:
        """Return the cause whose strength is `a`."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            chance = np.random.default_rng([flow.run.seed, 11, flow.i])
            speed = np.abs(flow.w)
            if cells:
                width = max(1, round(5 * flow.link.diameter / (flow.x[1] - flow.x[0])))
                group = np.arange(len(flow.x)) // width
                speed = np.column_stack([speed[:, group == g].mean(axis=1) for g in group])
            phase = 2 * np.pi * St * np.cumsum(speed, axis=0) * flow.run.dt / flow.link.diameter + chance.uniform(0, 2 * np.pi)
            if cells:
                phase = phase + 0.4 * wander(chance, flow.run.t, 1.0)[:, None]
            return flow.with_normal_load(a * flow.drag * np.cos(2 * phase))
        return Cause("vortex_shedding", None, "other" if cells else "plain", "in-line force at twice the Strouhal frequency",
                     {"strength": (a, "1"), "strouhal": (St, "1")}, water, chance=True, order=2)
    return Draft(make, 0.01, 1.2)
