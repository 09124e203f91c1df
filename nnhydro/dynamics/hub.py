"""What the arm does to its base: the force at joint 1 and the moment about it, of the links' inertia and weight, and of the water.

    wrench on the base = -(what the base supplies):   F = -sum_i (m_i a_i - m_i g) - F_water,    M_z likewise about joint 1     [N, N m]

Friction in the joints, springs across them and motors act between the base and the arm, or between links, and are no part of it: M_z is not
the torque of motor 1. What a hybrid learns is a torque at a joint, and may be friction as well as water, so it is no part of it either:

    tau_1 + M_z = friction and springs at joint 1 + what is learned at joint 1     [N m], direct drive, without faults of sensors

The forces are found as the loads' own virtual work: every load reaches the hub by the same levers by which it
reaches the joints, the virtual motion of the hub along X and along Y beside those of the joints.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.dynamics.arrays import Answer
from nnhydro.dynamics.joint_model import JointModel, joint_model
from nnhydro.effects.hypotheses.ambient_current import AmbientCurrent
from nnhydro.errors import ModelError, require
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.learned.learned import LearnedTorque
from nnhydro.models.prediction import motion_filter, on_rows
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import Motion
from nnhydro.recordings.recording import Recording

COLUMNS = ("hub_Fx_N", "hub_Fy_N", "hub_Mz_Nm")


@final
@dataclass(frozen=True, eq=False)
class HubWrench:
    """Force along X and Y (N) and moment about +Z at joint 1 (N m) that the arm exerts on its base, (..., 3) each, in world axes."""

    rigid: Answer  # inertia and weight of the links
    fluid: Answer  # all else: water, payload, what pulls at the links

    @property
    def total(self) -> Answer:
        """The sum of both."""
        return self.rigid + self.fluid

    def __add__(self, other: "HubWrench") -> "HubWrench":
        """Return the wrench of both together."""
        return HubWrench(self.rigid + other.rigid, self.fluid + other.fluid)

    def __sub__(self, other: "HubWrench") -> "HubWrench":
        """Return this wrench without the other."""
        return HubWrench(self.rigid - other.rigid, self.fluid - other.fluid)


def _flow(physics: StripTheory, motion: Motion) -> Flow:
    """The flow that the loads meet, in water that flows where the model has a current."""
    flow = Flow(physics.arm, motion)
    for instrument in physics.instruments:
        if isinstance(instrument, AmbientCurrent):
            flow = instrument.met_by(flow)
    return flow


def _on_base(supplied: Tensor, joints: int) -> Tensor:
    """F_x, F_y, M_z (n, 3) on the base, of what joints and hub supply (n, joints + 2)."""
    return -torch.stack([supplied[:, joints], supplied[:, joints + 1], supplied[:, 0]], dim=1)


def wrench_columns(model: TorqueModel, recording: Recording, cutoff_hz: float | None = None) -> dict[str, NDArray[np.float64]]:
    """Return hub_Fx_N, hub_Fy_N and hub_Mz_Nm (n,) along a recorded motion, row for row, as `predict` returns torques.

    hub_Mz_Nm is not -tau1_Nm: friction, springs and what is learned at joint 1, the drive, and sensor faults are in tau1_Nm only.
    Raises ModelError for a network, RecordingError where the motion cannot be used.
    """
    mechanical = joint_model(model)
    found = on_rows(lambda segment: [hub_wrench(mechanical, Motion.of(segment)).total.numpy()], model.arm.n_links, recording,
                    motion_filter(recording, cutoff_hz))
    assert found is not None
    return dict(zip(COLUMNS, found[0].T, strict=True))


def _of_loads(physics: StripTheory, motion: Motion) -> HubWrench:
    """The wrench of a sum of load terms."""
    flow, joints = _flow(physics, motion), physics.arm.n_links
    rigid, fluid = (torch.zeros(len(motion), joints + 2, dtype=torch.float64) for _ in range(2))
    for name, supplied in physics.loads.with_hub(flow).items():
        if isinstance(physics.loads.terms[name], RigidBody):
            rigid = rigid + supplied
        else:
            fluid = fluid + supplied
    return HubWrench(_on_base(rigid, joints), _on_base(fluid, joints))


def _wrench(model: TorqueModel | None, motion: Motion) -> HubWrench:
    """The wrench of a model as it is built: of load terms, on a baseline, or a simulation with physics added."""
    if isinstance(model, StripTheory):
        return _of_loads(model, motion)
    if isinstance(model, LearnedTorque) and model.baseline is not None:
        return _wrench(model.baseline, motion)
    if isinstance(model, CorrectedSimulation):
        return _wrench(model.simulation, motion) + _of_loads(model.after, motion) - _of_loads(model.before, motion)
    raise ModelError("this model knows torques at the joints, not the forces behind them: ask a physics model or a hybrid, whose baseline "
                     "has them")


def hub_wrench(model: JointModel, motion: Motion) -> HubWrench:
    """Return the wrench of the physics in `model`: of a hybrid that of its baseline, for what is learned are torques, not forces.

    Raises ModelError for a network, which knows torques at the joints only, and for a linear axis.
    """
    require(not model.arm.sliding, "a linear axis has no hub: the force along it is that of its drive, tau1", ModelError)
    return _wrench(model.model, motion)
