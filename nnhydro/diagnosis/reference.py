"""What the recordings are compared with: a physics model of ours by name or from a file, any other model file, or the user's own column.

Whatever it is, physics may be recalibrated beside it: the columns of a physics model stand next to every hypothesis. A simulation that is
not physics of ours stays as it is, and these columns hold changes of it.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import ConfigError, RecordingError
from nnhydro.identification.identify import calibrated, started, versions
from nnhydro.identification.prior import Prior, prior
from nnhydro.models.amended import Amended
from nnhydro.models.baselines import BASELINES, Baseline
from nnhydro.models.baselines import baseline as baseline_called
from nnhydro.models.storage import MODEL, load_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.preprocessing import Preparation
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit

Array = NDArray[np.float64]
COLUMN = "column"


@final
@dataclass(frozen=True, eq=False)
class Reference:
    """The baseline by `name`; `physics` calibrated to the recordings with the prior `before` of its parameters.

    `simulated` is another model whose torque is compared; `column` says that the recordings hold the simulation themselves.
    """

    name: str
    physics: StripTheory
    before: Prior
    simulated: TorqueModel | None = None
    column: bool = False

    @property
    def ours(self) -> bool:
        """Whether the physics itself is the baseline."""
        return self.simulated is None and not self.column

    def to_explain(self, segment: Segment, Y: Array, c0: Array) -> Array:
        """Return the torque (n, joints) N m less the baseline's before it is recalibrated, as it is compared.

        Raises RecordingError where the recording holds no simulated torque and should.
        """
        assert segment.tau is not None
        if self.column:
            if segment.tau_sim is None:
                raise RecordingError(f"{segment.recording}: has no column tau1_sim_Nm: --baseline column compares with the simulation that "
                                     "the recordings hold; add it to every one, or name another baseline")
            return segment.tau - segment.tau_sim
        if self.simulated is not None:
            return segment.tau - segment.seen(self.simulated.torque(Motion.of(segment)).numpy())
        return segment.tau - c0 - Y @ self.before.mean

    def plain(self) -> TorqueModel:
        """Return the baseline as a model to be saved."""
        record = {"kind": "calibrated baseline of a diagnosis", "versions": versions()}
        if self.simulated is not None:
            return self.simulated
        return Amended(self.physics.arm, self.physics.preparation, record, None, self.physics, self.physics) if self.column \
            else replace(self.physics, fit=record)

    def amended(self, before: StripTheory, after: StripTheory) -> TorqueModel:
        """Return the corrected model: `after` itself where the physics is ours, else the simulation with `after` less `before` added."""
        return after if self.ours else Amended(after.arm, after.preparation, after.fit, self.simulated, before, after)


def reference(named: str | None, arm: Arm, all_units: tuple[Unit, ...], how: Preparation) -> Reference:
    """Return what `named` asks for: a baseline by name, a model folder, or "column"; by default constant, rigid where the arm is dry.

    Raises ConfigError for a name that is none of these, ModelError for a folder that cannot be read or was made for another arm.
    """
    usual = "rigid" if arm.dry else "constant"
    if named is None or named in BASELINES:
        return _physics(baseline_called(named or usual), arm, all_units, how)
    beside = _physics(baseline_called(usual), arm, all_units, how)
    if named == COLUMN:
        return replace(beside, name=COLUMN, column=True)
    if not (Path(named) / MODEL).is_file():
        raise ConfigError(f"--baseline {named}: neither a baseline ({', '.join(BASELINES)}), nor {COLUMN}, nor a model folder "
                          f"(no {MODEL}): nnhydro identify and train write one")
    model = load_model(Path(named))
    if model.arm.n_links != arm.n_links:
        raise ConfigError(f"--baseline {named}: is a model of {model.arm.n_links} joints, the campaign's arm has {arm.n_links}")
    if isinstance(model, StripTheory) and not model.instruments and model.loads.linear():
        return _physics(Baseline(model.name, "a model file", lambda _: model.loads, calibrated=True), arm, all_units, how)
    return replace(beside, name=named, simulated=model)


def _physics(chosen: Baseline, arm: Arm, all_units: tuple[Unit, ...], how: Preparation) -> Reference:
    return Reference(chosen.name, calibrated(chosen, all_units, arm, how), prior(started(chosen, all_units, arm), arm))
