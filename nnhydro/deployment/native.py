"""Programs of scalars compiled by the system's C compiler and called from Python: an arm that can be simulated under control for hours.

    qdd, memory' = forward(q, qd, tau, u0, du0, dt, memory)             M qdd = tau - h, solved by elimination inside

Nothing is left behind: the C text and the library lie in a folder that is deleted once the library is loaded.
"""

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import chain, product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, final

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.optimize import minimize
from torch import Tensor

from nnhydro.deployment.c_program import c_function
from nnhydro.deployment.onnx.expressions import Program, Value
from nnhydro.deployment.onnx.tracing import trace
from nnhydro.deployment.step import MemoryStep, record_step, whole_sums
from nnhydro.dynamics.inertia import mass_and_bias
from nnhydro.dynamics.joint_model import JointModel
from nnhydro.errors import ModelError, NnhydroError, require
from nnhydro.physics.carried import StepMemory
from nnhydro.physics.motion import Motion

Array = NDArray[np.float64]
FLAGS: Final = ("-std=c99", "-O3", "-march=native", "-ffp-contract=fast", "-fPIC", "-shared")
ROUNDS: Final = 12
AROUND: Final = (1.0, 4.0)  # rad/s^2, further starts beside the one that failed
REACHES: Final = (1e-5, 1e-2, 1.0)  # rad/s^2 of the differences, by turns: a short one misleads near a kink
CLOSE, FAIR, NEAREST = 1e-10, 1e-5, 1e-2  # of the torque; where a learned torque jumps, the acceleration next to the jump is taken
REAL = ctypes.POINTER(ctypes.c_double)


def compiler() -> str | None:
    """Return the system's C compiler, None where there is none."""
    return shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


@final
class Native:
    """A program as a function from numbers to numbers, `calls(in) -> out`; raises ModelError where there is no C compiler."""

    def __init__(self, program: Program, outputs: Sequence[Value], n_inputs: int) -> None:
        cc = compiler()
        require(cc is not None, "no C compiler was found (cc, gcc or clang): install one, or use the model itself", ModelError)
        with TemporaryDirectory() as folder:
            source, library = Path(folder) / "program.c", Path(folder) / "program.so"
            source.write_text("#include <math.h>\n" + c_function("void run", program, outputs, "double"), encoding="utf-8")
            made = subprocess.run([str(cc), *FLAGS, str(source), "-o", str(library), "-lm"], capture_output=True, text=True, check=False)
            if made.returncode:
                raise NnhydroError(f"{cc} could not compile the model: {made.stderr.splitlines()[:3]}")
            self._function = ctypes.CDLL(str(library)).run
        self._function.argtypes, self._function.restype = [REAL, REAL], None
        self.given, self.out = np.zeros(max(n_inputs, 1)), np.zeros(max(len(outputs), 1))
        self._pointers = self.given.ctypes.data_as(REAL), self.out.ctypes.data_as(REAL)

    def __call__(self) -> Array:
        """Compute `out` from what stands in `given`; returns `out`, which the next call overwrites."""
        self._function(*self._pointers)
        return self.out


def _eliminate(mass: Tensor, right: Tensor) -> Tensor:
    """M^-1 b for M (1, n, n) with pivots on its diagonal, b (1, n), in operations that can be traced."""
    rows = [torch.cat([mass[0, i], right[0, i:i + 1]]) for i in range(mass.shape[1])]
    n = len(rows)
    for i in range(n):
        rows[i] = rows[i] / rows[i][i]
        for j in range(n):
            if j != i:
                rows[j] = rows[j] - rows[j][i] * rows[i]
    return torch.stack([row[n] for row in rows])


@final
@dataclass(eq=False)
class NativeArm:
    """One arm of the physics or learned model `joint`: its torque and, of physics, its acceleration, a few microseconds each."""

    joint: JointModel
    affine: bool
    memory: Array = field(init=False)
    _known: Array | None = field(init=False, default=None)  # d tau / d qdd of a learned model where it was last computed

    def __post_init__(self) -> None:
        made = record_step(self.joint, whole_sums(self.joint))
        self.step: MemoryStep = made.step
        flat = [x for name, values in made.outputs.items() if name != "std" for x in values.ravel()]
        self.inverse = Native(made.program, flat, made.program.n_inputs)
        self.n = self.joint.arm.n_links
        self.forward = self._forward() if self.affine else None
        self.begin()

    def _forward(self) -> Native:
        """The forward dynamics as machine code: acceleration from n + 1 torques, which are affine in the acceleration."""
        step, n = self.step, self.n

        def acceleration(q: Tensor, qd: Tensor, tau: Tensor, u0: Tensor, du0: Tensor, dt: Tensor, memory: Tensor) -> tuple[Tensor, ...]:
            """Return the accelerations (joints,) rad/s^2 under `tau` (joints,) N m: M^-1 (tau - h), with the memory `dt` s later."""
            before = step.memory_parts(memory)
            rows = n + 1

            def torque(qdd: Tensor) -> Tensor:
                """Return the torques (1, joints + 1, joints) N m at as many accelerations (1, joints + 1, joints) rad/s^2."""
                many = {name: x.expand(rows, *x.shape[1:]) for name, x in before.items()}
                carried = StepMemory(dt.clamp(min=0.0).expand(rows), many, fresh=(dt < 0).expand(rows))
                motion = Motion(torch.zeros(rows, dtype=torch.float64), q.expand(rows, n), qd.expand(rows, n), qdd.reshape(rows, n),
                                u0.expand(rows), du0.expand(rows), steady=True, carried=carried)
                return step.model.torque(motion)[None]

            mass, bias = mass_and_bias(torque, q[None])
            return (_eliminate(mass, tau[None] - bias),)

        example = [torch.linspace(0.3, 0.7, size, dtype=torch.float64) for size in (n, n, n, 1, 1)]
        example += [torch.full((1,), 0.01, dtype=torch.float64), torch.zeros(step.size, dtype=torch.float64)]
        program, (qdd,) = trace(acceleration, example, whole_sums(self.joint))
        return Native(program, list(qdd), program.n_inputs)

    def begin(self) -> None:
        """Forget the motion before: a run begins with the next instant."""
        self.memory, self.begun = np.zeros(self.step.size), False

    def _fill(self, native: Native, q: Any, qd: Any, third: Any, u0: float, du0: float, dt: float) -> None:
        n, given = self.n, native.given
        given[:n], given[n:2 * n], given[2 * n:3 * n] = q, qd, third
        given[3 * n], given[3 * n + 1], given[3 * n + 2] = u0, du0, dt if self.begun else -1.0
        given[3 * n + 3:] = self.memory

    def torque(self, q: Any, qd: Any, qdd: Any, u0: float = 0.0, du0: float = 0.0, dt: float = 0.0, keep: bool = True) -> Array:
        """Return the joint torques (joints,) N m `dt` s after the instant that was kept last; `keep`: this instant becomes it."""
        self._fill(self.inverse, q, qd, qdd, u0, du0, dt)
        out = self.inverse()
        if keep:
            self.memory, self.begun = out[self.n:self.n + self.step.size].copy(), True
        return out[:self.n].copy()

    def acceleration(self, q: Any, qd: Any, tau: Any, u0: float = 0.0, du0: float = 0.0, dt: float = 0.0, start: Any = None) -> Array:
        """Return the accelerations (joints,) rad/s^2 under `tau` N m, `dt` s after the instant that was kept last.

        Of a learned model by Newton's method from `start`; raises ModelError where that finds none.
        """
        if self.forward is not None:
            self._fill(self.forward, q, qd, tau, u0, du0, dt)
            return self.forward().copy()
        begun = np.zeros(self.n) if start is None else np.array(start)
        return self._search_acceleration(q, qd, np.asarray(tau, dtype=float), u0, du0, dt, begun)

    def encoders(self, q: Array) -> Array:
        """Return the angles (joints,) rad that are read where the links stand at `q` (joints,) rad: the same."""
        return q

    def _slope(self, q: Any, qd: Any, u0: float, du0: float, dt: float, qdd: Array, reach: float) -> Array:
        """d tau / d qdd (joints, joints) over `reach` rad/s^2."""
        shifted = [[self.torque(q, qd, qdd + sign * reach * unit, u0, du0, dt, keep=False) for unit in np.eye(self.n)] for sign in (1, -1)]
        return np.asarray((np.array(shifted[0]) - np.array(shifted[1])).T / (2 * reach))

    def _search_acceleration(self, q: Any, qd: Any, tau: Array, u0: float, du0: float, dt: float, start: Array) -> Array:
        """The acceleration of a learned model: from `start`, and where a kink stops Newton's steps, from around it and without slopes."""

        def missing(qdd: Array) -> Array:
            return tau - self.torque(q, qd, qdd, u0, du0, dt, keep=False)

        def squares(qdd: Array) -> float:
            return float((missing(qdd)**2).sum())

        scale, found = 1 + np.abs(tau).max(), []
        near = (NEAREST * scale)**2
        around = (start + size * np.array(signs) for size in AROUND for signs in product((1.0, -1.0), repeat=self.n))
        for begin in chain([start], around):
            qdd, left = self._newton(missing, lambda at, reach: self._slope(q, qd, u0, du0, dt, at, reach), scale, begin)
            if left @ left < near:
                return qdd
            found.append((float(left @ left), qdd))
        best = min(found, key=lambda candidate: candidate[0])[1]
        last = minimize(squares, best, method="Nelder-Mead", options={"xatol": CLOSE, "fatol": near * FAIR})
        require(last.fun < near, "no acceleration was found at which the learned model gives this torque: the arm is far from its training",
                ModelError)
        return np.asarray(last.x)

    def _newton(self, missing: Callable[[Array], Array], slope: Callable[[Array, float], Array], scale: float,
                qdd: Array) -> tuple[Array, Array]:
        """Newton's method with the slope of the state before as long as that brings the torque five times closer; qdd, torque missing."""
        reach = 0
        left = missing(qdd)
        for _ in range(ROUNDS):
            size = np.abs(left).max()
            if size < CLOSE * scale:
                return qdd, left
            if self._known is None:
                self._known = slope(qdd, REACHES[reach % len(REACHES)])
                reach += 1
            after = qdd + np.linalg.solve(self._known, left)
            new = missing(after)
            if np.abs(new).max() > 0.2 * size:
                self._known = None
            if np.abs(new).max() < size:
                qdd, left = after, new
            elif size < FAIR * scale:
                return qdd, left
        return qdd, left
