"""Checks of the generator: physics against other formulas, and written files against inverse dynamics."""

from pathlib import Path

import numpy as np
import pandas as pd
from drives import drag_moment, loose_second_joint
from machines import GRAVITY, WATER, Array, arm
from mechanics import bare_torques, rigid_torques, water_torques
from motions import Motion, move
from record import Case
from responses import mode
from scipy.ndimage import gaussian_filter1d


def check_physics(rng: np.random.Generator) -> None:
    """Energy balance, closed forms of drag, torques against finite differences of the kinetic energy, and both solvers of joint 2."""
    dry = arm([0.5, 0.4, 0.3], [0.06] * 3, [2.0, 1.5, 1.0], density=0.0, gravity=GRAVITY)
    mo = move(rng, "fourier", 3, 8, 1000, 1000, base_hz=0.2)

    def energy(q: Array, dq: Array) -> Array:
        phi, w = np.cumsum(q, axis=0), np.cumsum(dq, axis=0)
        place, speed, total = np.zeros((2, q.shape[1])), np.zeros((2, q.shape[1])), np.zeros(q.shape[1])
        for i in range(3):
            e, n = np.stack([np.cos(phi[i]), np.sin(phi[i])]), np.stack([-np.sin(phi[i]), np.cos(phi[i])])
            v = speed + dry.com[i] * w[i] * n
            height = (place + dry.com[i] * e)[1]
            total = total + dry.mass[i] * ((v**2).sum(0) / 2 + GRAVITY * height) + 0.5 * dry.inertia[i] * w[i] ** 2
            place, speed = place + dry.length[i] * e, speed + dry.length[i] * w[i] * n
        return total
    work = (rigid_torques(dry, mo) * mo.dq).sum(0)
    power = np.gradient(energy(mo.q, mo.dq), mo.dt)
    assert np.abs(work - power)[5:-5].max() < 2e-3 * np.abs(power).max(), "energy"
    kick = 1e-6

    def lagrangian(q: Array, dq: Array) -> Array:
        return energy(q, dq) - 2 * energy(q, 0 * q)
    for j in range(3):
        step = np.zeros((3, 1))
        step[j] = kick
        momentum = (energy(mo.q, mo.dq + step) - energy(mo.q, mo.dq - step)) / (2 * kick)
        slope = (lagrangian(mo.q + step, mo.dq) - lagrangian(mo.q - step, mo.dq)) / (2 * kick)
        lagrange = np.gradient(momentum, mo.dt) - slope
        assert np.abs(lagrange - rigid_torques(dry, mo)[j])[5:-5].max() < 3e-3 * np.abs(lagrange).max(), "Lagrange"
    wet = arm([0.6, 0.5], [0.07, 0.06], [2.0, 1.5], [1.0, 0.9], [0.8, 0.7])
    mo = move(rng, "fourier", 2, 6, 500, 2000, base_hz=0.3)
    drag = np.array([drag_moment(a, b, 0.5) for a, b in zip(mo.dq.sum(0), 0.6 * mo.dq[0] * np.cos(mo.q[1]), strict=True)])
    got = water_torques(wet, mo, np.array([0.0, 1.0]), np.zeros(2))[1]
    assert np.abs(got - 0.5 * WATER * 0.06 * drag).max() < 1e-3 * np.abs(got).max(), "drag"
    link = loose_second_joint(wet, mo, lambda d, v: 80 * d + 0.5 * v)
    twist = 80 * (mo.q[1, ::2][: link.t.size] - link.q[1]) + 0.5 * (mo.dq[1, ::2][: link.t.size] - link.dq[1])
    through = bare_torques(wet, link)[1]
    assert np.abs(twist - through).max() < 2e-3 * np.abs(through).max(), "spring"
    assert np.abs(np.gradient(link.dq[1], link.dt) - link.ddq[1])[9:-9].max() < 0.03 * np.abs(link.ddq[1]).max(), "acceleration of link 2"
    y, dy = mode(np.sin(np.arange(4000) * 0.01), 1.3, 0.1, 0.005)
    assert np.abs(np.gradient(y, 0.005) - dy)[5:-5].max() < 1e-3 * np.abs(dy).max(), "mode"


def check_recorded(case: Case, folder: Path) -> tuple[float, float]:
    """Torques of a healthy campaign against inverse dynamics of recorded angles by finite differences: residual, that of the noise."""
    shares, floors = [], []
    for file, mo in zip(sorted((folder / "recordings").glob("*.csv")), case.motions, strict=True):
        table = pd.read_csv(file)
        t = table["t_s"].to_numpy()
        q = table[[f"q{j + 1}_rad" for j in range(case.machine.links)]].to_numpy().T
        if case.machine.remote:
            q = np.stack([q[0], q[1] - q[0]])
        grid = np.linspace(t[0], t[-1], t.size)
        q = gaussian_filter1d(np.stack([np.interp(grid, t, row) for row in q]), 0.02 / (grid[1] - grid[0]), axis=1)
        u0 = np.interp(grid, mo.t, mo.u0)
        dq = np.gradient(q, grid, axis=1)
        seen = Motion(grid, q, dq, np.gradient(dq, grid, axis=1), u0, np.gradient(u0, grid), 1, "seen")
        tau = bare_torques(case.machine, seen)
        if case.machine.remote:
            tau = np.stack([tau[0] - tau[1], tau[1]])
        read = np.stack([np.interp(grid, t, table[f"tau{j + 1}_Nm"]) for j in range(case.machine.links)])
        read = gaussian_filter1d(read, 0.02 / (grid[1] - grid[0]), axis=1)
        size = np.abs(case.machine.mass[0] * GRAVITY * case.machine.com[0] * np.cos(q)) if case.free else np.abs(read)
        exact = bare_torques(case.machine, mo)
        exact = np.stack([exact[0] - exact[1], exact[1]]) if case.machine.remote else exact
        exact = gaussian_filter1d(np.stack([np.interp(grid, mo.t, row) for row in exact]), 0.02 / (grid[1] - grid[0]), axis=1)
        floors.append(np.abs(read - exact)[:, 5:-5].sum() / size[:, 5:-5].sum())
        shares.append(np.abs(read - tau)[:, 5:-5].sum() / size[:, 5:-5].sum())
    return float(np.median(shares)), float(np.median(floors))
