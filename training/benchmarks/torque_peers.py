"""The peers of the torque's benchmarks: Pinocchio, MuJoCo and a C compiler's closed form."""

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from nnhydro.recordings.arm import Arm

HERE = Path(__file__).parent
Torque = Callable[..., np.ndarray]  # q, qd, qdd (n, 2), u0, du0 (n,) -> tau (n, 2)
FLAGS = ("-O3", "-march=native", "-mprefer-vector-width=512", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=fast", "-fPIC",
         "-shared")


def compiled(source: str, *more: str) -> ctypes.CDLL | None:
    """Return `source` compiled and loaded; None without a compiler."""
    if shutil.which("cc") is None:
        return None
    out = Path(tempfile.mkdtemp()) / "peer.so"
    subprocess.run(["cc", *FLAGS, str(HERE / source), "-o", str(out), *more, "-lm"], check=True)
    return ctypes.CDLL(str(out))


def address(x: np.ndarray) -> ctypes.c_void_p:
    """Return where the array lies."""
    return ctypes.c_void_p(x.ctypes.data)


def closed_form(arm: Arm, C_D: float, C_M: float) -> Torque | None:
    """Return the closed form in C, vectorised by the compiler."""
    library = compiled("closed_form.c")
    if library is None:
        return None
    rho, (one, two) = arm.fluid.density_kg_m3, arm.links
    k = np.array([*arm.L, *(0.5 * rho * arm.D * C_D), *(rho * np.pi / 4 * arm.D**2 * C_M), one.mass_kg * one.com_m, two.mass_kg * two.com_m,
                  one.inertia_kg_m2 + one.mass_kg * one.com_m**2, two.inertia_kg_m2 + two.mass_kg * two.com_m**2, two.mass_kg])

    def torque(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, u0: np.ndarray, du0: np.ndarray) -> np.ndarray:
        tau = np.empty_like(q)
        library.torque(ctypes.c_long(len(q)), *map(address, (q, qd, qdd, u0, du0, k, tau)))
        return tau

    return torque


def pinocchio_model(arm: Arm) -> Any:
    """Return the dry arm in Pinocchio."""
    import pinocchio as pin

    model, joint, place = pin.Model(), 0, pin.SE3.Identity()
    for i, link in enumerate(arm.links):
        joint = model.addJoint(joint, pin.JointModelRZ(), place, f"joint{i + 1}")
        model.appendBodyToJoint(joint, pin.Inertia(link.mass_kg, np.array([link.com_m, 0, 0]), link.inertia_kg_m2 * np.eye(3)),
                                pin.SE3.Identity())
        place = pin.SE3(np.eye(3), np.array([link.length_m, 0, 0]))
    model.gravity.setZero()
    return model


def pinocchio_batch(arm: Arm) -> Torque:
    """Return rneaInParallel on one thread; the carriage stands."""
    import pinocchio as pin

    pool = pin.ModelPool(pinocchio_model(arm), 1)

    def torque(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, *_: Any) -> np.ndarray:
        tau = np.empty((2, len(q)), order="F")
        pin.rneaInParallel(1, pool, q.T, qd.T, qdd.T, tau)
        return tau.T

    return torque


def mujoco_model(arm: Arm) -> Any:
    """Return the arm in MuJoCo with ellipsoids in water; the carriage stands."""
    import mujoco

    body, tail = "", ""
    for i, link in enumerate(arm.links):
        at = f"{arm.links[i - 1].length_m} 0 0" if i else "0 0 0"
        body += (f'<body pos="{at}"><joint axis="0 0 1"/><inertial pos="{link.com_m} 0 0" mass="{link.mass_kg}" '
                 f'diaginertia="{link.inertia_kg_m2} {link.inertia_kg_m2} {link.inertia_kg_m2}"/>'
                 f'<geom type="ellipsoid" pos="{link.length_m / 2} 0 0" size="{link.length_m / 2} {link.diameter_m / 2} '
                 f'{link.diameter_m / 2}" fluidshape="ellipsoid" contype="0" conaffinity="0"/>')
        tail += "</body>"
    option = f'<option density="{arm.fluid.density_kg_m3}" viscosity="0.001" gravity="0 0 0"/>'
    return mujoco.MjModel.from_xml_string(f"<mujoco>{option}<worldbody>{body}{tail}</worldbody></mujoco>")


def mujoco_python(arm: Arm) -> Torque:
    """Return mj_inverse called from Python, state by state."""
    import mujoco

    model = mujoco_model(arm)
    data = mujoco.MjData(model)

    def torque(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, *_: Any) -> np.ndarray:
        tau, inverse = np.empty_like(q), mujoco.mj_inverse
        qpos, qvel, qacc, made = data.qpos, data.qvel, data.qacc, data.qfrc_inverse
        for i in range(len(q)):
            qpos[:], qvel[:], qacc[:] = q[i], qd[i], qdd[i]
            inverse(model, data)
            tau[i] = made
        return tau

    return torque


def mujoco_c(arm: Arm) -> Torque | None:
    """Return mj_inverse in a loop in C."""
    import mujoco

    home = Path(mujoco.__file__).parent
    library = compiled("mujoco_loop.c", f"-I{home / 'include'}", str(next(home.glob("libmujoco.so*"))), f"-Wl,-rpath,{home}")
    if library is None:
        return None
    model = mujoco_model(arm)
    data = mujoco.MjData(model)

    def torque(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, *_: Any) -> np.ndarray:
        tau = np.empty_like(q)
        library.inverse(ctypes.c_void_p(model._address), ctypes.c_void_p(data._address), ctypes.c_long(len(q)),
                        *map(address, (q, qd, qdd, tau)))
        return tau

    return torque
