"""Identification of the thirteen numbers against scipy's least squares from ten starts: `python training/benchmarks/identification.py`.

Both see the same twelve slews with the same noise (5 % of the rms torque) on one thread. The peer is as fast as we could make it: travels
and levers are computed once, the curves are scipy splines evaluated on all strips at once, bounds and tolerances are the golden file's or
scipy's own; starts in tau_s are spread over its range. Seconds are those of the processor, so that a busy machine does not decide. About
10 s.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import platform  # noqa: E402
import time  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402
import scipy  # noqa: E402
import torch  # noqa: E402
from scipy.interpolate import CubicSpline  # noqa: E402
from scipy.optimize import least_squares  # noqa: E402

from nnhydro.evaluation.mclain.arm import DIAMETER, IDENTIFICATION, LENGTH, SEGMENTS, arm, slew, truth  # noqa: E402
from nnhydro.fitting.travel.state_dependent import fit_state  # noqa: E402
from nnhydro.physics.flow import Flow  # noqa: E402
from nnhydro.physics.travel.state_model import state_loads  # noqa: E402
from nnhydro.runtime.files import write_json  # noqa: E402

STARTS, NOISE, SEED, REPEATS = 10, 0.05, 0, 5


def peer(flows: list[Flow], tau: np.ndarray) -> tuple[float, float, list[float]]:
    """Return seconds, best sum of squares and the tau_s that each start ends in."""
    l = (np.arange(SEGMENTS) + 0.5) * LENGTH / SEGMENTS  # noqa: E741
    theta, omega, alpha = (torch.cat([getattr(f.motion, n)[:, 0] for f in flows]).numpy() for n in ("q", "qd", "qdd"))
    s = np.outer(theta, l) / DIAMETER
    drag = 0.5 * 1000 * DIAMETER * np.outer(np.abs(omega) * omega, l**3) * LENGTH / SEGMENTS
    mass = 1000 * np.pi / 4 * DIAMETER**2 * np.outer(alpha, l**2) * LENGTH / SEGMENTS

    def residual(p: np.ndarray) -> np.ndarray:
        knots, ends = np.linspace(0, p[12], 7), ((2, 0.0), (1, 0.0))
        C_D = CubicSpline(knots, np.concatenate([[0.0], p[:6]]), bc_type=ends)(np.minimum(s, p[12]))
        C_M = CubicSpline(knots, np.concatenate([[1.0], p[6:12]]), bc_type=ends)(np.minimum(s, p[12]))
        return (C_D * drag + C_M * mass).sum(1) - tau

    began, found = time.process_time(), []
    for tau_s in np.linspace(3.0, 13.5, STARTS):
        start = np.array([1.0] * 6 + [0.5] * 6 + [tau_s])
        found.append(least_squares(residual, start, bounds=([-1.0] * 12 + [2.0], [3.0] * 12 + [15.0])))
    return time.process_time() - began, 2 * min(x.cost for x in found), [round(float(x.x[12]), 2) for x in found]


def ours(flows: list[Flow], tau: np.ndarray) -> tuple[float, float, float]:
    """Return seconds (median of several, everything computed anew), sum of squares and tau_s."""
    parts = torch.from_numpy(tau)[:, None].split([len(f.motion) for f in flows])
    seconds = []
    for _ in range(REPEATS):
        began = time.process_time()
        fit = fit_state(state_loads(arm()), [(Flow(f.arm, f.motion), t) for f, t in zip(flows, parts, strict=True)])
        seconds.append(time.process_time() - began)
    return float(np.median(seconds)), fit.search.energy, fit.tau_s[0]


def main() -> None:
    """Print and store the comparison."""
    torch.set_num_threads(1)
    flows = [slew(*motion) for motion in IDENTIFICATION]
    clean = torch.cat([truth().torque(flow)[:, 0] for flow in flows]).numpy()
    tau = clean + NOISE * np.sqrt(np.mean(clean**2)) * np.random.default_rng(SEED).standard_normal(len(clean))
    ours(flows[:1], tau[:len(flows[0].motion)])  # imports and first allocations
    (fast, our_cost, our_scale), (slow, peer_cost, ends) = ours(flows, tau), peer(flows, tau)
    machine = f"{platform.machine()}, {os.cpu_count()} cores, one thread; python {platform.python_version()}, scipy {scipy.__version__}"
    print(f"scipy.optimize.least_squares, {STARTS} starts: {slow:.2f} s, residual {peer_cost:.6f} (N m)^2, starts end at tau_s = {ends}")
    print(f"nnhydro, no start: {fast:.3f} s, residual {our_cost:.6f} (N m)^2, tau_s = {our_scale:.3f}")
    print(f"{slow / fast:.0f} times as fast, residual ratio {our_cost / peer_cost:.9f}; {machine}")
    write_json(Path(__file__).with_suffix(".json"), {
        "peer": {"seconds": slow, "residual": peer_cost, "tau_s": ends},
        "nnhydro": {"seconds": fast, "residual": our_cost, "tau_s": our_scale},
        "times_as_fast": slow / fast, "machine": machine, "versions": {"torch": torch.__version__, "numpy": np.__version__}})


if __name__ == "__main__":
    main()
