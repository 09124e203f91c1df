"""Train a network or a hybrid on chosen recordings of a campaign: the work behind `nnhydro train` and of the benchmark's folds."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from nnhydro.identification.config import TrainingConfig
from nnhydro.identification.gradient_fit import Progress, TrainingState, gradient_fit
from nnhydro.identification.identify import calibrated, versions
from nnhydro.identification.training_rows import Rows, torque_rms, training_rows, watched_units
from nnhydro.models.baselines import baseline
from nnhydro.models.learned import LearnedTorque
from nnhydro.models.network import Ensemble
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.preprocessing import Preparation
from nnhydro.recordings.splitting import Unit, units

FLAT = 1e-6  # a feature that varies less over the campaign tells nothing and is left out by a huge spread


def _standardised(rows: Rows) -> tuple[Rows, tuple[Tensor, Tensor, Tensor, Tensor]]:
    """Return the rows with inputs of zero mean and unit spread, mirror images included, and (centre, spread, lowest, highest)."""
    x, odd = rows.x.double(), rows.parity < 0
    centre = torch.where(odd, 0.0, x.mean(dim=0))
    spread = (x - centre).pow(2).mean(dim=0).sqrt()
    spread = torch.where(spread > FLAT, spread, torch.full_like(spread, 1 / FLAT))
    x = (x - centre) / spread
    lowest, highest = x.amin(dim=0), x.amax(dim=0)
    reach = torch.maximum(-lowest, highest)
    return replace(rows, x=x.float()), (centre, spread, torch.where(odd, -reach, lowest), torch.where(odd, reach, highest))


def hybrid_baseline(config: TrainingConfig, chosen: Sequence[Unit], arm: Arm, how: Preparation) -> StripTheory | None:
    """Return the calibrated baseline of a hybrid, None for a network."""
    if config.model == "network":
        return None
    name = config.baseline if config.baseline != "auto" else "rigid" if arm.dry else "constant"
    return calibrated(baseline(name), chosen, arm, how)


def train_units(chosen: Sequence[Unit], arm: Arm, how: Preparation, config: TrainingConfig, checkpoint: Path | None = None,
                progress: Progress | None = None) -> LearnedTorque:
    """Return the model trained on the units `chosen` alone: scaling, baseline, weights and early stop see nothing else.

    With `checkpoint`, the state is written there after every epoch and taken up again if it is there.
    """
    base = hybrid_baseline(config, chosen, arm, how)
    floor = config.floor * torque_rms(chosen)
    rows, (centre, spread, lowest, highest) = _standardised(training_rows(chosen, arm, config, floor, base))
    layout = Ensemble.fresh((rows.x.shape[1], *config.hidden, arm.n_links), config.members, config.seed)
    resumed = checkpoint is not None and checkpoint.exists()
    state = TrainingState.load(checkpoint) if resumed and checkpoint is not None else TrainingState.fresh(layout)
    save = None if checkpoint is None else lambda state: state.save(checkpoint)
    ensemble = gradient_fit(layout, rows, watched_units(chosen, config), config, state, save, progress)
    record: dict[str, Any] = {"config": config.model_dump(mode="json"), "epochs": state.epoch, "best_epoch": state.best_epoch.tolist(),
                              "validation_error": state.best_error.tolist(), "recordings": [unit.name for unit in chosen]}
    return LearnedTorque(arm, how, record, config.features, config.bound, floor, centre, spread, rows.parity.double(), lowest, highest,
                         ensemble, base)


def train(campaign: Campaign, config: TrainingConfig | None = None, checkpoint: Path | None = None,
          progress: Progress | None = None) -> LearnedTorque:
    """Return a network or hybrid trained on all recordings of `campaign` (a share of them watched for early stopping)."""
    config = config or TrainingConfig()
    how = campaign.plan(config.cutoff_hz)
    model = train_units(units(campaign, how, config.seed), campaign.arm, how, config, checkpoint, progress)
    return replace(model, fit={**model.fit, "campaign_sha256": campaign.sha256(), "versions": versions()})
