"""A physics model compiled: the torques of `model.torque`, many times as fast, for long recordings, sweeps over states and controllers.

    fast = compiled(load_model(Path("my_model")))
    tau = fast.torque(motion)                            # (n, joints) N m, as the model's own
    tau1, tau2 = fast.step(q1, q2, dq1, dq2, ddq1, ddq2, u0, du0)

The load terms are traced once, as they stand (deployment/onnx/tracing.py), and what they leave is compiled: there is no second formula to
keep equal. Coefficients over the travel s/D are worked off by physics/travel/kernel.py, which needs numba. Gradients come from the model
itself.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Final, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.deployment.compiled.engines import engine_called
from nnhydro.deployment.compiled.memoryless import Memoryless
from nnhydro.deployment.compiled.travelling import TravelKernels
from nnhydro.errors import ModelError, require
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion, trial_runs
from nnhydro.physics.travel.term import TravelTerm

Array = NDArray[np.float64]
# rows from which on compiling pays: it takes 3 s and saves 11 s a million rows with coefficients over the travel, 0.8 s without
WORTH: Final = {True: 500_000, False: 5_000_000}
CLOSE: Final = 1e-9  # of the rms torque: far above rounding, far below any difference that would be a fault


@final
@dataclass(frozen=True, eq=False)
class CompiledModel(TorqueModel):
    """`model` with kernels for its torque; `engine` says what they are made of. Saved, it is the model it was made from."""

    kind: ClassVar[str] = StripTheory.kind
    model: StripTheory
    engine: str
    kernel: Memoryless | TravelKernels

    def torque(self, motion: Motion) -> Tensor:
        """Return the sensor torques (n, joints) N m, to rounding those of the model; without gradients.

        Kernels take u0 alone: on a base that also turns or moves along +X, or in moving water, the model itself is asked.
        """
        if motion.surrounded:
            return self.model.torque(motion)
        return torch.from_numpy(self.kernel.torque(motion))

    @property
    def step(self) -> Callable[..., tuple[float, ...]]:
        """The function step(q_1, ..., qd_1, ..., qdd_1, ..., u0, du0) of plain numbers that gives the sensor torques N m of one state.

        Raises ModelError where the coefficients follow the travel: one state does not tell it.
        """
        if isinstance(self.kernel, TravelKernels):
            raise ModelError("this model's coefficients follow the travel s/D, which one state does not tell: give torque() a whole run")
        return self.kernel.step

    @property
    def name(self) -> str:
        """The name of the model."""
        return self.model.name

    def document(self) -> dict[str, Any]:
        """Return what the model itself stores."""
        return self.model.document()


def _travels(model: StripTheory) -> bool:
    return any(isinstance(term, TravelTerm) for term in model.loads.terms.values())


def _check(made: CompiledModel) -> CompiledModel:
    """Return `made` if it gives what the model gives along two runs."""
    for run in trial_runs(made.arm.n_links):
        want = made.model.torque(run)
        far = float((made.torque(run) - want).abs().max() / (want.square().mean().sqrt() + 1e-12))
        require(far < CLOSE, "this model holds a memory that is not compiled (Basset's force, a wake that lags, a contact that bends, "
                "instruments with a delay): use the model itself", ModelError)
    return made


def compile_model(model: TorqueModel, engine: str | None = None) -> CompiledModel:
    """Return `model` compiled by `engine` (numba or numpy; by default numba where it is installed).

    Held against the model along two runs before it is returned. Raises ModelError where the model is no sum of load terms, remembers the
    motion in another way than by the travel s/D, or needs numba for that; ConfigError for another engine, MissingExtraError without it.
    """
    if not isinstance(model, StripTheory):
        raise ModelError("only physics models are compiled: nnhydro export makes a network fast for a controller")
    chosen = engine_called(engine)
    travelling = _travels(model)
    if travelling:
        require(not model.instruments, "coefficients over the travel together with faults of sensors are not compiled", ModelError)
        require(chosen == "numba", "coefficients over the travel s/D are compiled with numba only: pip install 'nnhydro[fast]'", ModelError)
    kernel = TravelKernels(model) if travelling else Memoryless(model, chosen)
    return _check(CompiledModel(model.arm, model.preparation, model.fit, model, chosen, kernel))


def quickest(model: TorqueModel, rows: int) -> TorqueModel:
    """Return what computes `rows` rows of torque soonest: the model, or the model compiled where it can be."""
    if not isinstance(model, StripTheory) or rows < WORTH[_travels(model)]:
        return model
    try:
        return compile_model(model)
    except ModelError:
        return model
