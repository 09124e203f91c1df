"""What is fixed to the tank taken out of the recordings: the baseline, and all that is learned of the water, are fitted to what remains.

A line that pulls at the arm bends the coefficients of a baseline that knows nothing of it, and a correction that fades where it is not
sure would fade to that. What pulls is decided on held-out recordings (linear_part.py, `with_free_functions`) and then stands beside the
baseline.
"""

from collections.abc import Sequence
from dataclasses import replace

import torch
from torch import Tensor

from nnhydro.fitting.linear.several_arms import arm_of
from nnhydro.fitting.network.linear_part import LinearPart
from nnhydro.fitting.network.rows import CHUNK, Rows, base_rows
from nnhydro.models.learned.linear_parts import FreePart
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit


def without(unit: Unit, fixed: FreePart, arm: Arm) -> Unit:
    """Return `unit` with torques that are free of what is fixed to the tank."""
    unit_arm = arm_of(unit, arm)

    def rest_of(segment: Segment) -> Segment:
        pull = fixed.torque(Flow(unit_arm, Motion.of(segment))).mean(dim=0).numpy()
        raw = None if segment.tau_raw is None else segment.tau_raw - pull
        return replace(segment, tau=None if segment.tau is None else segment.tau - segment.filter(pull), tau_raw=raw)

    return replace(unit, segments=lambda: tuple(rest_of(segment) for segment in unit.segments()))


def targets_without(rows: Rows, columns: Tensor, unseen: LinearPart, used: LinearPart) -> Rows:
    """Return the rows with targets free of what is fixed to the tank, of whose columns (n, joints, p) each member knows its own part."""
    known = torch.cat([used.free_torque(A.double()).mean(dim=1) for A in torch.split(columns, CHUNK)])
    each = torch.cat([unseen.free_torque(A.double()) for A in torch.split(columns, CHUNK)])
    return replace(rows, target=rows.target - known.float(), parting=(each - known[:, None]).float())


def on_base(rows: Rows, old: TorqueModel | None, new: TorqueModel | None, chosen: Sequence[Unit], arm: Arm) -> Rows:
    """Return the rows of the units `chosen` with what the baseline `new` leaves as target, where it was what `old` leaves."""
    if old is None or new is None:
        return rows
    return replace(rows, target=rows.target + base_rows(chosen, arm, old) - base_rows(chosen, arm, new))
