"""Search for a training's choices, nested so that the recordings of the final judgement stay untouched.

outer   one fold of the campaign is put aside: nothing of it enters the search
inner   each trial is judged by cross-validation over folds of the rest

Only the winner is fitted to all of the rest and judged once on the fold put aside. Source: nested cross-validation, Varma and Simon (2006),
BMC Bioinformatics 7:91; the tree-structured Parzen estimator of optuna.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, final

from nnhydro.errors import CampaignError, missing_extra, require
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.network.train import train_units
from nnhydro.models.learned.learned import LearnedTorque
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.repeats import group_names
from nnhydro.recordings.splitting import Unit, folds, units
from nnhydro.runtime.workers import HERE, Workers, spread

Score = Callable[[LearnedTorque, Sequence[Unit]], float]  # error of a model on units, less is better
Ranges = dict[str, Sequence[Any]]  # choice: values to try; two floats are the ends of a logarithmic range


@final
@dataclass(frozen=True)
class SearchResult:
    """What a search gave: the best choices, every trial, and the error on recordings that the search never saw."""

    config: TrainingConfig
    trials: tuple[tuple[dict[str, Any], float], ...]  # choices and inner error, in order
    inner_error: float
    held_out_error: float
    default_error: float  # of the starting configuration on the same recordings
    held_out: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """Return the result for result files."""
        return {"config": self.config.model_dump(mode="json"), "inner_error": self.inner_error, "held_out_error": self.held_out_error,
                "default_error": self.default_error, "held_out": list(self.held_out),
                "trials": [{"choices": choices, "error": error} for choices, error in self.trials]}


def _fold_error(chosen: Sequence[Unit], held_out: Sequence[int], arm: Arm, how: Preparation, config: TrainingConfig,
                score: Score) -> float:
    """One fold: the piece of work that goes to a worker."""
    model = train_units([unit for i, unit in enumerate(chosen) if i not in held_out], arm, how, config)
    return score(model, [chosen[i] for i in held_out])


def inner_error(chosen: Sequence[Unit], campaign: Campaign, how: Preparation, config: TrainingConfig, score: Score, count: int,
                workers: Workers = HERE) -> float:
    """Return the mean error of `config` over `count` folds of the units `chosen` alone, which `workers` share."""
    tasks = [(chosen, held_out, campaign.arm, how, config, score) for held_out in folds(chosen, count, config.seed)]
    errors = list(spread(_fold_error, tasks, workers))
    return sum(errors) / len(errors)


def _suggest(trial: Any, ranges: Ranges) -> dict[str, Any]:
    """The choices of one trial."""
    made: dict[str, Any] = {}
    for name, values in ranges.items():
        if len(values) == 2 and all(isinstance(value, float) for value in values):
            made[name] = trial.suggest_float(name, *values, log=True)
        else:
            made[name] = values[trial.suggest_categorical(name, list(range(len(values))))]
    return made


def search(campaign: Campaign, config: TrainingConfig, ranges: Ranges, trials: int, score: Score, outer_folds: int = 5,
           inner_folds: int = 3, progress: Callable[[int, float], None] | None = None, workers: Workers = HERE) -> SearchResult:
    """Return the best of `trials` choices within `ranges`, judged once on a fold that the search did not see.

    `workers` share the inner folds of a trial; trials follow one another, for each learns from those before.
    Raises MissingExtraError without optuna, CampaignError where the campaign is too small, ConfigError for choices that are none.
    """
    try:
        import optuna
    except ImportError:
        missing_extra("optuna", "search", "the search for a training's choices")
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    how = campaign.plan(config.cutoff_hz)
    every = units(campaign, how, config.seed, group_names(campaign))
    aside = set(folds(every, outer_folds, config.seed)[0])
    chosen = [unit for i, unit in enumerate(every) if i not in aside]
    held_out = [unit for i, unit in enumerate(every) if i in aside]
    require(len({unit.group for unit in chosen}) > inner_folds, "too few motions for a nested search: record more", CampaignError)
    found: list[tuple[dict[str, Any], float]] = []

    def objective(trial: Any) -> float:
        """Return the inner error of the choices that `trial` suggests."""
        choices = _suggest(trial, ranges)
        tried = TrainingConfig.model_validate({**config.model_dump(), **choices})
        found.append((choices, inner_error(chosen, campaign, how, tried, score, inner_folds, workers)))
        if progress is not None:
            progress(len(found), found[-1][1])
        return found[-1][1]

    optuna.create_study(sampler=optuna.samplers.TPESampler(seed=config.seed)).optimize(objective, n_trials=trials)
    choices, inner = min(found, key=lambda pair: pair[1])
    best = TrainingConfig.model_validate({**config.model_dump(), **choices})
    errors = [score(train_units(chosen, campaign.arm, how, settings), held_out) for settings in (best, config)]
    return SearchResult(best, tuple(found), inner, errors[0], errors[1], tuple(unit.name for unit in held_out))
