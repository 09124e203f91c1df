"""Who takes part in a benchmark: how a model of a given name is made from the recordings of a fold."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

from nnhydro.errors import ConfigError
from nnhydro.evaluation.comparators.comparator import comparators
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.linear.several_arms import calibrated_on
from nnhydro.fitting.network.gradient_fit import Progress
from nnhydro.fitting.network.train import train_units
from nnhydro.models.baselines import BASELINES
from nnhydro.models.seen import marks_seen_by
from nnhydro.models.storage import load_model
from nnhydro.models.torque_model import TorqueModel
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.splitting import Unit
from nnhydro.runtime.registry import choices

LEARNED = ("network", "hybrid")
Fit = Callable[[Sequence[Unit], Arm, Preparation, Progress | None], TorqueModel]


@final
@dataclass(frozen=True)
class ModelEntry:
    """A model by name, the way to fit it to the units of a fold, and the contents (models/seen.py) that it has seen before."""

    name: str
    fit: Fit
    seen: frozenset[str] = frozenset()


def _physics(name: str) -> ModelEntry:
    return ModelEntry(name, lambda chosen, arm, how, progress: calibrated_on(BASELINES[name], chosen, arm, how))


def _train_entry(name: str, campaigns: Sequence[Campaign], config: TrainingConfig) -> ModelEntry:
    named = config.model_copy(update={"model": name})
    stored = name == "hybrid" and config.baseline != "auto" and config.baseline not in BASELINES
    seen = marks_seen_by(_stored_model(Path(config.baseline), campaigns)) if stored else frozenset[str]()
    return ModelEntry(name, lambda chosen, arm, how, progress: train_units(chosen, arm, how, named, progress=progress), seen or frozenset())


def _comparator(name: str, config: TrainingConfig) -> ModelEntry:
    network = config.model_copy(update={"model": "network"})
    return ModelEntry(name, lambda chosen, arm, how, progress: comparators()[name].fit(chosen, arm, how, network))


def _stored_model(folder: Path, campaigns: Sequence[Campaign]) -> TorqueModel:
    """Return the model in `folder`; raises ConfigError where it is of another arm or does not say which recordings it has seen."""
    model = load_model(folder)
    if marks_seen_by(model) is None:
        raise ConfigError(f"{folder}: does not say which recordings it has seen, so none here counts as new: make it again with this "
                          f"version, or name the model ({', '.join((*BASELINES, *LEARNED))}) instead of its folder")
    if model.arm.n_links != campaigns[0].arm.n_links:
        raise ConfigError(f"{folder}: is a model of {model.arm.n_links} joint(s), the campaign's arm has {campaigns[0].arm.n_links}")
    return model


def _stored_entry(folder: Path, campaigns: Sequence[Campaign]) -> ModelEntry:
    model = _stored_model(folder, campaigns)
    return ModelEntry(folder.name, lambda chosen, arm, how, progress: model, marks_seen_by(model) or frozenset())


def default_names(arm: Arm) -> tuple[str, ...]:
    """Return the default entries: the physics that makes sense in this fluid, the network and the hybrid."""
    return (("rigid",) if arm.dry else tuple(BASELINES)) + LEARNED


def all_names(arm: Arm) -> tuple[str, ...]:
    """Return the entries of `--models all`: the default ones and every comparator."""
    return (*default_names(arm), *comparators())


def entries(names: Sequence[str], campaigns: Sequence[Campaign], config: TrainingConfig) -> tuple[ModelEntry, ...]:
    """Return the entries called `names`: baselines, `network`, `hybrid`, comparators, folders of stored models; `all` is all but folders.

    Raises ConfigError for a name that is unknown or stands twice.
    """
    made = []
    for name in all_names(campaigns[0].arm) if list(names) == ["all"] else names:
        if name in BASELINES:
            made.append(_physics(name))
        elif name in LEARNED:
            made.append(_train_entry(name, campaigns, config))
        elif name in comparators():
            made.append(_comparator(name, config))
        elif Path(name).is_dir():
            made.append(_stored_entry(Path(name), campaigns))
        else:
            known = (*BASELINES, *LEARNED, *comparators(), "all")
            raise ConfigError(f"--models: unknown model {name!r}: {choices(name, known)} (a model's folder may stand here, too)")
    if len({entry.name for entry in made}) < len(made):
        raise ConfigError(f"--models: a name stands twice in {', '.join(names)}: name each model once")
    return tuple(made)
