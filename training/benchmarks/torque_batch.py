"""Torque of the two-link arm, model `constant`, for a million states, beside its peers: `python training/benchmarks/torque_batch.py`.

Peers: Pinocchio's rneaInParallel (the dry arm on a carriage that stands: less work than ours), MuJoCo's mj_inverse with ellipsoids in water
(no added mass; from Python and in a loop in C), and the closed form in C as cc vectorises it: what one core can do at all. Pinocchio's
torques are those of our dry arm, the closed form's are ours. Peers that are not installed (pip install pin mujoco) are left out. A minute;
with `--torch-compile` also torch.compile of the model as it stands, which needs a C++ compiler.
"""

import sys
from importlib.util import find_spec
from pathlib import Path

from machine import ARM, machine, seconds, versions

# isort: split
import numpy as np
import torch
from torque_peers import Torque, closed_form, mujoco_c, mujoco_python, pinocchio_batch

from nnhydro.deployment.compiled.torque import compile_model
from nnhydro.models.baselines import baseline
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.runtime.files import write_json

STATES, FEW, ROUNDS, SEED = 1_000_000, 20_000, 15, 0
C_D, C_M = 1.1, 0.8
WANTED = {"pinocchio rneaInParallel (dry)": 10.0, "mujoco mj_inverse from Python": 40.0, "closed form in C": 1 / 3}


def states(n: int) -> tuple[np.ndarray, ...]:
    """Return random q, qd, qdd (n, 2), u0, du0 (n,)."""
    random = np.random.default_rng(SEED)
    return (random.uniform(-3, 3, (n, 2)), 2 * random.standard_normal((n, 2)), 5 * random.standard_normal((n, 2)),
            0.8 * random.standard_normal(n), random.standard_normal(n))


def of(name: str) -> StripTheory:
    """Return the baseline `name` at its start values, C_D = 1.1 and C_M = 0.8."""
    return StripTheory(ARM, Preparation(None), {}, name, baseline(name).start(ARM))


def as_torque(model, wrapped=lambda function: function) -> Torque:
    """Return a model as a function of arrays."""
    @wrapped
    def inner(q, qd, qdd, u0, du0):
        return model.torque(Motion(u0, q, qd, qdd, u0, du0, steady=True))

    return lambda *state: inner(*map(torch.from_numpy, state)).numpy()


def entries() -> dict[str, tuple[Torque, int]]:
    """Return every way there is to compute the torque, and for how many states it is timed."""
    found = {"nnhydro numba": (as_torque(compile_model(of("constant"), "numba")), STATES)} if find_spec("numba") else {}
    found |= {"nnhydro numpy": (as_torque(compile_model(of("constant"), "numpy")), STATES // 4),
              "nnhydro torch (the model itself)": (as_torque(of("constant")), STATES // 10)}
    if "--torch-compile" in sys.argv:
        found["nnhydro torch, torch.compile"] = (as_torque(of("constant"), torch.compile(dynamic=True)), STATES // 4)
    if (limit := closed_form(ARM, C_D, C_M)) is not None:
        found["closed form in C"] = (limit, STATES)
    if find_spec("pinocchio"):
        found["pinocchio rneaInParallel (dry)"] = (pinocchio_batch(ARM), STATES)
    if find_spec("mujoco"):
        found["mujoco mj_inverse from Python"] = (mujoco_python(ARM), FEW)
        if (loop := mujoco_c(ARM)) is not None:
            found["mujoco mj_inverse in C"] = (loop, 10 * FEW)
    return found


def check(found: dict[str, tuple[Torque, int]]) -> None:
    """Stop unless those that compute the same agree."""
    some = states(1000)
    want = as_torque(of("constant"))(*some)
    for name in ("nnhydro numba", "nnhydro numpy", "closed form in C"):
        if name in found:
            np.testing.assert_allclose(found[name][0](*some), want, rtol=1e-10, atol=1e-10)
    if "pinocchio rneaInParallel (dry)" in found:
        still = (*some[:3], 0 * some[3], 0 * some[4])
        dry = as_torque(of("rigid"))(*still)
        np.testing.assert_allclose(found["pinocchio rneaInParallel (dry)"][0](*still), dry, rtol=1e-10, atol=1e-10)


def main() -> None:
    """Print and store the comparison."""
    torch.set_num_threads(1)
    found = entries()
    check(found)
    inputs = {n: states(n) for n in {n for _, n in found.values()}}
    times = seconds({name: (lambda f=f, n=n: f(*inputs[n])) for name, (f, n) in found.items()}, ROUNDS)
    rate = {name: found[name][1] / times[name] / 1e6 for name in found}
    ours = next(iter(rate))
    for name, value in rate.items():
        wanted = f", wanted {WANTED[name]:.3g}" if name in WANTED else ""
        said = "" if name == ours else f"   {ours} is {rate[ours] / value:6.2f} times as fast{wanted}"
        print(f"{name:36s} {value:8.2f} M states/s{said}")
    print(machine("nnhydro", "numba", "numpy", "torch", "pin", "mujoco"))
    write_json(Path(__file__).with_suffix(".json"), {
        "million_states_per_s": rate, "times_as_fast": {name: rate[ours] / value for name, value in rate.items()}, "wanted": WANTED,
        "machine": machine(), "versions": versions("nnhydro", "numba", "numpy", "torch", "pin", "mujoco")})


if __name__ == "__main__":
    main()
