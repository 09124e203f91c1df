"""Torque of model `state` (Cd(s/D), Cm(s/D), 10 strips per link) along a long run: `python training/benchmarks/state_batch.py`.

The peer is numpy as a good hand writes it: strips along an axis, pieces of rows that stay in the cache, a reversal at every zero of a
strip's velocity. It leaves out what only the model does (reversals of less than 0.03 D do not count, running starts, pauses) and has no
belt or gears. Half a minute.
"""

from importlib.util import find_spec
from pathlib import Path

from machine import ARM, machine, seconds, versions

# isort: split
import numpy as np
import torch

from nnhydro.deployment.compiled.torque import compile_model
from nnhydro.models.baselines import baseline
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.coefficients.travel_spline import cardinal_matrix
from nnhydro.physics.loads.travel_added_mass import StateAddedMass
from nnhydro.physics.loads.travel_drag import StateDrag
from nnhydro.physics.motion import Motion
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.runtime.files import write_json

ROWS, FEW, ROUNDS, PIECE, STRIPS, WANTED = 1_000_000, 50_000, 10, 1024, 10, 15.0


def motion(rows: int) -> Motion:
    """Return a run of sums of sines from rest at 100 Hz, with many reversals and a carriage that moves."""
    t = torch.arange(rows, dtype=torch.float64) / 100.0
    w = torch.tensor([0.9, 1.3, 0.5], dtype=torch.float64)
    p = t[:, None] * w
    x, v, a = 0.6 * (1 - torch.cos(p)), 0.6 * w * torch.sin(p), 0.6 * w**2 * torch.cos(p)
    q, qd, qdd, u0, du0 = (y.contiguous() for y in (x[:, :2], v[:, :2], a[:, :2], v[:, 2], a[:, 2]))
    return Motion(t, q, qd, qdd, u0, du0)


def by_hand(model: StripTheory):
    """Return the model's torque written for numpy."""
    drag, mass = (next(t for t in model.loads.terms.values() if isinstance(t, kind)) for kind in (StateDrag, StateAddedMass))
    T = cardinal_matrix().numpy()
    c_D, c_M = T[:, 1:] @ drag.linear_values().numpy(), T[:, 1:] @ mass.linear_values().numpy() + T[:, 0]
    rho, L, D, tau_s = ARM.fluid.density_kg_m3, ARM.L, ARM.D, drag.tau_s[0]
    x = L[:, None] * (np.arange(STRIPS) + 0.5) / STRIPS
    one, two = ARM.links
    h1, h2, m2 = one.mass_kg * one.com_m, two.mass_kg * two.com_m, two.mass_kg
    J1, J2 = one.inertia_kg_m2 + one.mass_kg * one.com_m**2, two.inertia_kg_m2 + m2 * two.com_m**2

    def strips(i, A, B, M, N, turned, moved, memory):
        w = A[:, None] * x[i] + B[:, None]
        before = np.concatenate([memory["w"][i], w[:-1]])
        step = np.abs(turned[:, None] * x[i] + moved[:, None])
        path = np.cumsum(step, axis=0) + memory["path"][i]
        b = np.abs(before)
        zero = np.where(w * before < 0, path - step + step * b / (b + np.abs(w) + 1e-300), 0.0)
        origin = np.maximum.accumulate(np.concatenate([memory["origin"][i], zero]), axis=0)[1:]
        memory["w"][i], memory["path"][i], memory["origin"][i] = w[-1:], path[-1:], origin[-1:]
        u = np.minimum((path - origin) * (1 / (D[i] * tau_s)), 1.0)
        C_D, C_M = c_D[0] * u, 1 + c_M[0] * u
        for k in range(6):
            ramp = np.maximum(u - k / 6, 0.0)
            cube = ramp * ramp * ramp
            C_D += c_D[k + 1] * cube
            C_M += c_M[k + 1] * cube
        f = (0.5 * rho * D[i]) * C_D * np.abs(w) * w + (rho * np.pi / 4 * D[i] ** 2) * C_M * (M[:, None] * x[i] + N[:, None])
        ds = L[i] / STRIPS
        return f.sum(axis=1) * ds, f @ x[i] * ds

    def torque(run: Motion) -> np.ndarray:
        t, q, qd, qdd, u0, du0 = (y.numpy() for y in (run.t, run.q, run.qd, run.qdd, run.u0, run.du0))
        tau = np.empty_like(q)
        memory = {key: [np.zeros((1, STRIPS)) for _ in L] for key in ("w", "path", "origin")}
        last = (t[0], q[0], 0.0, 0.0)
        for start in range(0, len(t), PIECE):
            at = slice(start, start + PIECE)
            (q1, q2), (w1, r2), (e1, f2), u, du = q[at].T, qd[at].T, qdd[at].T, u0[at], du0[at]
            c1, s1, c2, s2 = np.cos(q1), np.sin(q1), np.cos(q2), np.sin(q2)
            c12, s12, w2, e2 = c1 * c2 - s1 * s2, s1 * c2 + c1 * s2, w1 + r2, e1 + f2
            B1, B2 = u * c1, L[0] * w1 * c2 + u * c12
            N1, N2 = du * c1 - u * w1 * s1, L[0] * (e1 * c2 - w1 * r2 * s2) + du * c12 - u * w2 * s12
            half = 0.5 * np.diff(t[at], prepend=last[0])
            turned1, turned2 = np.diff(q1, prepend=last[1][0]), np.diff(q1 + q2, prepend=last[1].sum())
            moved1, moved2 = (half * (B + np.concatenate([[b], B[:-1]])) for B, b in ((B1, last[2]), (B2, last[3])))
            last = (t[at][-1], q[at][-1], B1[-1], B2[-1])
            _, Mo1 = strips(0, w1, B1, e1, N1, turned1, moved1, memory)
            F2, Mo2 = strips(1, w2, B2, e2, N2, turned2, moved2, memory)
            outer = J2 * e2 + h2 * (L[0] * (e1 * c2 + w1 * w1 * s2) + du * c12) + Mo2
            tau[at, 1] = outer
            tau[at, 0] = (outer + (J1 + m2 * L[0] ** 2) * e1 + h2 * L[0] * (e2 * c2 - w2 * w2 * s2) + du * (h1 + m2 * L[0]) * c1 + Mo1
                          + L[0] * c2 * F2)
        return tau

    return torque


def main() -> None:
    """Print and store the comparison."""
    torch.set_num_threads(1)
    if not find_spec("numba"):
        raise SystemExit("this benchmark needs numba: pip install 'nnhydro[fast]'")
    model = StripTheory(ARM, Preparation(None), {}, "state", baseline("state").start(ARM))
    fast, peer, some = compile_model(model), by_hand(model), motion(5000)
    want = model.torque(some).numpy()
    np.testing.assert_allclose(fast.torque(some).numpy(), want, rtol=0, atol=1e-12 * np.abs(want).max())
    near = float(np.median(np.abs(peer(some) - want)) / np.sqrt((want**2).mean()))
    assert near < 1e-3, f"the peer computes something else: {near}"
    long, short = motion(ROWS), motion(FEW)
    times = seconds({"nnhydro numba": lambda: fast.torque(long), "numpy by hand": lambda: peer(long),
                     "nnhydro torch (the model itself)": lambda: model.torque(short)}, ROUNDS)
    rate = {name: (FEW if "torch" in name else ROWS) / t / 1e6 for name, t in times.items()}
    ours = rate["nnhydro numba"]
    for name, value in rate.items():
        said = f"wanted {WANTED:g}" if value == ours else f"nnhydro numba is {ours / value:.1f} times as fast"
        print(f"{name:36s} {value:8.2f} M states/s   {said}")
    print(machine("nnhydro", "numba", "numpy", "torch"))
    write_json(Path(__file__).with_suffix(".json"), {
        "million_states_per_s": rate, "times_as_fast": {name: ours / value for name, value in rate.items()}, "wanted": WANTED,
        "machine": machine(), "versions": versions("nnhydro", "numba", "numpy", "torch")})


if __name__ == "__main__":
    main()
