"""Rivera's identifier: one layer of tanh neurons with offsets and a linear output, trained on joint torques and nothing else.

    z = W_2 tanh(W_1 v + c_1) + c_2,      tau_j = S_j [z_j(v) - z_j(P v)]/2

v are the inputs of a set, standardised; S the Morison scale, that makes the output a torque coefficient (eq. 3-1-3); P the mirror of the
rig, which doubles the training set. Common layers feed both torques, parallel ones a torque each (figures 4-4, 4-5). No law of the strips,
no linear part, no memory: that is ours (fitting/network/linear_part.py). Source: Rivera (1995), section 2.4, after Sorensen (1993); S and P
ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, final

import torch
from torch import Tensor

from nnhydro.evaluation.metrics import Misfit
from nnhydro.evaluation.model_errors import misfit_of
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.network.gradient_fit import TrainingState, gradient_fit
from nnhydro.fitting.network.rows import Rows, base_rows, standardise, torque_rms, training_rows, watched_units
from nnhydro.models.learned.learned import LearnedTorque
from nnhydro.models.learned.network import Ensemble
from nnhydro.models.torque_model import TorqueModel
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.splitting import Unit

BOUND: Final = 40.0  # of the output in Morison scales: none in effect
FLOOR: Final = 0.1  # of the Morison scale in units of the torque's rms
MEMBERS: Final = 2  # each stops on recordings of its own


@final
@dataclass(frozen=True)
class Identifier:
    """A choice of inputs (feature sets), layers (`common` or `parallel`), neurons a layer, and passes over the rows."""

    inputs: tuple[str, ...]
    layers: str = "common"
    neurons: int = 16
    epochs: int = 150
    seed: int = 0

    def config(self) -> TrainingConfig:
        """Return the same as the choices of a training."""
        return TrainingConfig.model_validate({
            "model": "network", "features": self.inputs, "law": (), "free": False, "layers": self.layers, "hidden": (self.neurons,),
            "members": MEMBERS, "bound": BOUND, "floor": FLOOR, "epochs": self.epochs, "batch": 256, "learning_rate": 5e-3,
            "weight_decay": 0.01, "patience": self.epochs, "seed": self.seed})


@final
@dataclass(frozen=True, eq=False)
class TrainingSet:
    """Units to train on, the arm of them, and the analytic model whose torque stands in for the measured one (None: the measured)."""

    units: Sequence[Unit]
    arm: Arm
    truth: TorqueModel | None = None

    def rows(self, config: TrainingConfig, floor: Tensor) -> Rows:
        """Return the rows with the torques that the network is shown."""
        rows = training_rows(self.units, self.arm, config, floor, None)
        return rows if self.truth is None else replace(rows, target=base_rows(self.units, self.arm, self.truth))

    def error(self, model: TorqueModel) -> float:
        """Return sum |tau - model| / sum |tau| over these units, not to have been trained on."""
        if self.truth is None:
            return Misfit.total(m for unit in self.units if (m := misfit_of(model, unit)) is not None).error
        wanted = base_rows(self.units, self.arm, self.truth)
        return float((wanted - base_rows(self.units, self.arm, model)).abs().sum() / wanted.abs().sum())


def _join(parts: Sequence[Rows]) -> Rows:
    """All rows, units numbered through."""
    first, numbers, start = parts[0], [], 0
    for part in parts:
        numbers.append(part.unit + start)
        start += int(part.unit.max()) + 1
    x, scale, target = (torch.cat([getattr(part, name) for part in parts]) for name in ("x", "scale", "target"))
    return Rows(x, first.parity, scale, target, torch.cat(numbers))


def train_network(choice: Identifier, shown: Sequence[TrainingSet], how: Preparation) -> LearnedTorque:
    """Return the network trained on all that is `shown`, of one arm or of several."""
    config, arm = choice.config(), shown[0].arm
    floor = FLOOR * torque_rms(shown[0].units)
    rows = _join([part.rows(config, floor) for part in shown])
    centre, spread, lowest, highest = standardise(rows)
    watched = watched_units([unit for part in shown for unit in part.units], config)
    layout = Ensemble.fresh((rows.x.shape[1], choice.neurons, arm.n_links), MEMBERS, choice.seed, choice.layers == "parallel")
    ensemble = gradient_fit(layout, rows, watched, config, TrainingState.fresh(layout))
    none = torch.zeros(MEMBERS, rows.x.shape[1], arm.n_links, dtype=torch.float64)
    swiftest = torch.full((2 * arm.n_links,), torch.inf, dtype=torch.float64)
    return LearnedTorque(arm, how, {}, choice.inputs, BOUND, floor, centre, spread, rows.parity.double(), lowest, highest, swiftest, none,
                         ensemble, None)
