"""Torque of one state from Python, model `constant`, beside its peers: `python training/benchmarks/single_state_physics.py`.

`step` as `compiled(model)` gives it, made by numba and in plain Python (which needs nothing installed), Pinocchio's rnea (the dry arm) and
MuJoCo's mj_inverse with ellipsoids in water, each called as a controller in Python would. Ten seconds.
"""

from importlib.util import find_spec
from pathlib import Path

from machine import ARM, machine, seconds, versions

# isort: split
import numpy as np
import torch
from torque_peers import mujoco_model, pinocchio_model

from nnhydro.deployment.compiled.torque import compile_model
from nnhydro.models.baselines import baseline
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.runtime.files import write_json

CALLS, ROUNDS, WANTED = 3000, 40, 5.0  # microseconds
STATE = (0.3, -0.5, 1.0, 0.5, 0.1, 0.2, 0.3, 0.2)


def entries():
    """Return a call of each entry that computes one state."""
    model = StripTheory(ARM, Preparation(None), {}, "constant", baseline("constant").start(ARM))
    motion = Motion.at([STATE[:2]], [STATE[2:4]], [STATE[4:6]], STATE[6], STATE[7])
    plain = compile_model(model, "numpy").step
    found = {"nnhydro step, plain Python": lambda: plain(*STATE), "nnhydro torch (the model itself)": lambda: model.torque(motion)}
    np.testing.assert_allclose(plain(*STATE), model.torque(motion)[0], rtol=1e-12)
    if find_spec("numba"):
        fast = compile_model(model, "numba").step
        np.testing.assert_allclose(fast(*STATE), plain(*STATE), rtol=1e-12)
        found["nnhydro step, numba"] = lambda: fast(*STATE)
    q, qd, qdd = (np.array(STATE[k:k + 2]) for k in (0, 2, 4))
    if find_spec("pinocchio"):
        import pinocchio as pin

        dry = pinocchio_model(ARM)
        data, rnea = dry.createData(), pin.rnea
        found["pinocchio rnea (dry)"] = lambda: rnea(dry, data, q, qd, qdd)
    if find_spec("mujoco"):
        import mujoco

        wet = mujoco_model(ARM)
        state, inverse = mujoco.MjData(wet), mujoco.mj_inverse
        qpos, qvel, qacc, made = state.qpos, state.qvel, state.qacc, state.qfrc_inverse

        def mujoco_call():
            qpos[:], qvel[:], qacc[:] = q, qd, qdd
            inverse(wet, state)
            return made

        found["mujoco mj_inverse"] = mujoco_call
    return found


def main() -> None:
    """Print and store the comparison."""
    torch.set_num_threads(1)
    found = entries()
    repeats = {name: CALLS // 100 if "torch" in name else CALLS for name in found}
    times = seconds({name: (lambda call=call, n=repeats[name]: [call() for _ in range(n)]) for name, call in found.items()}, ROUNDS)
    spent = {name: 1e6 * times[name] / repeats[name] for name in found}
    for name, value in sorted(spent.items(), key=lambda item: item[1]):
        wanted = f"   wanted <= {WANTED:g}" if "step" in name else ""
        print(f"{name:36s} {value:8.2f} microseconds{wanted}")
    print(machine("nnhydro", "numba", "pin", "mujoco"))
    write_json(Path(__file__).with_suffix(".json"), {"microseconds": spent, "wanted": WANTED, "machine": machine(),
                                                     "versions": versions("nnhydro", "numba", "numpy", "torch", "pin", "mujoco")})


if __name__ == "__main__":
    main()
