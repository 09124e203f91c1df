"""Train a network or a hybrid on chosen recordings of a campaign: the work behind `nnhydro train` and of the benchmark's folds."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from nnhydro.features.strip_law.neurons import directions
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.identify import versions
from nnhydro.fitting.linear.normal_equations import Grams
from nnhydro.fitting.linear.several_arms import calibrated_on, on_arm
from nnhydro.fitting.network.base_choice import baseline_choice, on_best_base
from nnhydro.fitting.network.fixed_to_tank import on_base, targets_without, without
from nnhydro.fitting.network.gradient_fit import Progress, TrainingState, gradient_fit
from nnhydro.fitting.network.linear_columns import Linear
from nnhydro.fitting.network.linear_part import LinearPart, with_free_functions
from nnhydro.fitting.network.predictive_std import support, with_std, with_trust
from nnhydro.fitting.network.row_store import RowStore
from nnhydro.fitting.network.rows import CHUNK, Rows, free_range, law_of, rows_and_linear, standardise, torque_rms, watched_units
from nnhydro.fitting.network.strip_net.share import with_strip_net
from nnhydro.models.baselines import BASELINES, baseline
from nnhydro.models.domain import DOMAIN, domain_of
from nnhydro.models.learned.learned import LEFT_OUT, LearnedTorque
from nnhydro.models.learned.linear_parts import FreePart, StripLaw
from nnhydro.models.learned.network import Ensemble
from nnhydro.models.seen import SEEN, seen_record
from nnhydro.models.storage import load_model
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.loads.rigid_body import inertial_directions
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.repeats import group_names
from nnhydro.recordings.splitting import Unit, units


def hybrid_baselines(config: TrainingConfig, chosen: Sequence[Unit], arm: Arm, how: Preparation) -> tuple[TorqueModel | None, ...]:
    """Return the calibrated baselines that a hybrid may stand on, or the stored model that the configuration names; None for a network."""
    if config.model == "network":
        return (None,)
    if config.baseline != "auto" and config.baseline not in BASELINES:
        return (on_arm(load_model(Path(config.baseline)), arm),)
    auto = ("rigid",) if arm.dry else baseline_choice(chosen, arm, how) if config.baseline == "auto" else (config.baseline,)
    return tuple(calibrated_on(baseline(name), chosen, arm, how) for name in auto)


def _with_linear(rows: Rows, part: LinearPart, columns: Tensor) -> Rows:
    """The rows with what the linear part gives them."""
    pieces = zip(torch.split(columns, CHUNK), torch.split(rows.scale, CHUNK), strict=True)
    return replace(rows, linear=torch.cat([part.of(A.double()) / S[:, None].double() for A, S in pieces]).float())


def _skip(part: LinearPart, rows: Rows, spread: Tensor) -> Tensor:
    """K (E, features, joints) of the standardised features, zero for even ones."""
    odd = rows.parity < 0
    K = torch.zeros(len(part.odd), len(odd), part.odd.shape[2], dtype=torch.float64)
    K[:, odd] = part.odd * spread[odd, None]
    return K


def _law(part: LinearPart, linear: Linear, names: tuple[str, ...]) -> StripLaw:
    return StripLaw(names, linear.seen.lowest, linear.seen.highest, part.shared[:, :linear.law_size].contiguous(),
                    part.shared[:, linear.law_size:].contiguous(), directions().clone())


@one_thread()
def train_units(chosen: Sequence[Unit], arm: Arm, how: Preparation, config: TrainingConfig, checkpoint: Path | None = None,
                progress: Progress | None = None) -> LearnedTorque:
    """Return the model trained on the units `chosen` alone: scaling, baseline, weights, early stop and doubt see nothing else.

    With `checkpoint`, the state is written there after every epoch and taken up again if it is there; rows beyond the memory budget lie
    beside it in files as long as the training runs. Raises CampaignError where nothing can be trained on.
    """
    bases, rms = hybrid_baselines(config, chosen, arm, how), torque_rms(chosen)
    floor = config.floor * rms
    watched = watched_units(chosen, config, arm)
    with RowStore(int(config.memory_mb * 1e6), None if checkpoint is None else checkpoint.parent) as store:
        free = free_range(chosen, arm) if config.free else None
        rows, linear = rows_and_linear(chosen, arm, config, floor, bases[0], store, free)
        centre, spread, lowest, highest = standardise(rows)
        stated = inertial_directions(arm).shape[1]
        grams = Grams.of(linear.columns, watched[:, rows.unit])
        fixed, pulls = None, with_free_functions(rows, linear, watched, stated, rms, grams)
        if free is not None and pulls is not None:
            fixed = FreePart(free, pulls[1].free.contiguous())
            chosen, first = [without(unit, fixed, arm) for unit in chosen], bases[0]
            bases = hybrid_baselines(config, chosen, arm, how)
            rows = on_base(targets_without(rows, linear.columns, *pulls), first, bases[0], chosen, arm)
        linear = linear.without_free()
        law_grams = grams.first(linear.columns.shape[2])
        base, rows, (trained, part) = on_best_base(bases, rows, linear, watched, stated, rms, chosen, arm, law_grams)
        rows = _with_linear(rows, trained, linear.columns)
        resumed = checkpoint is not None and checkpoint.exists()
        layout = Ensemble.fresh((rows.x.shape[1], *config.hidden, arm.n_links), config.members, config.seed, config.layers == "parallel")
        state = TrainingState.load(checkpoint) if resumed and checkpoint is not None else TrainingState.fresh(layout)
        save = None if checkpoint is None else lambda state: state.save(checkpoint)
        ensemble = gradient_fit(layout, rows, watched, config, state, save, progress)
        record: dict[str, Any] = {"config": config.model_dump(mode="json"), "epochs": state.epoch, "best_epoch": state.best_epoch.tolist(),
                                  "validation_error": state.best_error.tolist(), "recordings": [unit.name for unit in chosen],
                                  SEEN: seen_record(chosen, base), LEFT_OUT: float(watched.double().mean())}
        bare = LearnedTorque(arm, how, record, config.features, config.bound, floor, centre, spread, rows.parity.double(), lowest, highest,
                             linear.seen.swiftest, _skip(part, rows, spread), ensemble, base, _law(part, linear, law_of(config, arm)),
                             fixed)
        model = with_trust(replace(bare, support=support(rows).contiguous()), rows, watched)
        if config.strip_net and not arm.dry:
            model, rows = with_strip_net(model, rows, watched, chosen, config.seed)
        return with_std(model, rows, watched)


def train(campaign: Campaign, config: TrainingConfig | None = None, checkpoint: Path | None = None,
          progress: Progress | None = None) -> LearnedTorque:
    """Return a network or hybrid trained on all recordings of `campaign` (a share of them watched for early stopping)."""
    config = config or TrainingConfig()
    how = campaign.plan(config.cutoff_hz)
    chosen = units(campaign, how, config.seed, group_names(campaign))
    model = train_units(chosen, campaign.arm, how, config, checkpoint, progress)
    domain = domain_of(chosen, campaign.arm)
    return replace(model, fit={**model.fit, "campaign_sha256": campaign.sha256(), "versions": versions(),
                               DOMAIN: None if domain is None else domain.document()})
