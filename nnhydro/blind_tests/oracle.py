"""The truth in the place of a model: what its own equations and numbers predict for a motion as a recorder wrote it down.

A model of nothing but the truth still errs on recorded motions: angles come in steps, derivatives have to be taken. What is left of the
error of a baseline when that is taken off is all that a diagnosis could mend.
"""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

import torch
import yaml
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.blind_tests.truth.campaign import UnseenRun
from nnhydro.models.prediction import predict
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import read_arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.readers.files import read_recording
from nnhydro.runtime.files import write_text


@final
@dataclass(frozen=True, eq=False)
class TrueModel(TorqueModel):
    """What the torque sensors of a concealed arm read, on any motion; it lives only while a suite is written."""

    unseen: UnseenRun

    def torque(self, motion: Motion) -> Tensor:
        """Return the sensor torques (n, joints) N m without noise, the mean over chance."""
        t, q, qd, qdd, u0, du0 = (x.numpy() for x in (motion.t, motion.q, motion.qd, motion.qdd, motion.u0, motion.du0))
        return torch.from_numpy(self.unseen.torque(t, q, qd, qdd, u0, du0))

    def document(self) -> dict[str, Any]:
        """Return nothing: the truth is not written into model files."""
        return {}


def true_torque(unseen: UnseenRun, document: dict[str, Any], csv: str) -> NDArray[Any]:
    """Return the sensor torques (n, joints) N m of the truth for its motion as recorded in `csv`, by the arm of arm.yaml's `document`.

    Derivatives that the recorder left out are taken as for any model (`predict`).
    """
    with TemporaryDirectory() as folder:
        write_text(Path(folder) / "arm.yaml", yaml.safe_dump(document, sort_keys=False))
        write_text(Path(folder) / "motion.csv", csv)
        arm = read_arm(Path(folder) / "arm.yaml")
        return predict(TrueModel(arm, Preparation(None), {}, unseen), read_recording(Path(folder) / "motion.csv", arm, torque=False)).tau
