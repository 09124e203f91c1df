"""Who takes part in a benchmark: how a model of a given name is made from the recordings of a fold."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

from nnhydro.errors import ConfigError
from nnhydro.identification.config import TrainingConfig
from nnhydro.identification.gradient_fit import Progress
from nnhydro.identification.identify import calibrated
from nnhydro.identification.train import train_units
from nnhydro.models.baselines import BASELINES
from nnhydro.models.storage import load_model
from nnhydro.models.torque_model import TorqueModel
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.preprocessing import Preparation
from nnhydro.recordings.splitting import Unit

LEARNED = ("network", "hybrid")
Fit = Callable[[Sequence[Unit], Arm, Preparation, Progress | None], TorqueModel]


@final
@dataclass(frozen=True)
class Contender:
    """A model by name and the way to fit it to the units of a fold."""

    name: str
    fit: Fit


def _physics(name: str) -> Contender:
    return Contender(name, lambda chosen, arm, how, progress: calibrated(BASELINES[name], chosen, arm, how))


def _learned(name: str, config: TrainingConfig) -> Contender:
    own = config.model_copy(update={"model": name})
    return Contender(name, lambda chosen, arm, how, progress: train_units(chosen, arm, how, own, progress=progress))


def _stored(folder: Path, campaign: Campaign) -> Contender:
    model = load_model(folder)
    if model.fit.get("campaign_sha256") == campaign.sha256():
        raise ConfigError(f"{folder}: was fitted to this very campaign, so no recording of it is held out: name the model "
                          f"({', '.join((*BASELINES, *LEARNED))}) instead of its folder, or benchmark it on another campaign")
    if model.arm.n_links != campaign.arm.n_links:
        raise ConfigError(f"{folder}: is a model of {model.arm.n_links} joint(s), the campaign's arm has {campaign.arm.n_links}")
    return Contender(folder.name, lambda chosen, arm, how, progress: model)


def default_names(arm: Arm) -> tuple[str, ...]:
    """Return who takes part where nobody is named: the physics that makes sense in this fluid, the network and the hybrid."""
    return (("rigid",) if arm.dry else tuple(BASELINES)) + LEARNED


def contenders(names: Sequence[str], campaign: Campaign, config: TrainingConfig) -> tuple[Contender, ...]:
    """Return the contenders called `names`: baselines, `network`, `hybrid`, or folders of stored models."""
    made = []
    for name in names:
        if name in BASELINES:
            made.append(_physics(name))
        elif name in LEARNED:
            made.append(_learned(name, config))
        elif Path(name).is_dir():
            made.append(_stored(Path(name), campaign))
        else:
            raise ConfigError(f"--models: unknown model {name!r}: one of {', '.join((*BASELINES, *LEARNED))}, or a model's folder")
    if len({contender.name for contender in made}) < len(made):
        raise ConfigError(f"--models: a name stands twice in {', '.join(names)}: name each model once")
    return tuple(made)
