"""All models on the same held-out recordings: the work behind `nnhydro benchmark`."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import CampaignError, require
from nnhydro.evaluation.benchmark_result import BenchmarkResult, Standing
from nnhydro.evaluation.entries import ModelEntry, default_names, entries
from nnhydro.evaluation.model_errors import coverage_of, misfit_and_coverage, total_coverage
from nnhydro.evaluation.protocols.pool import left_out
from nnhydro.evaluation.protocols.protocol import DEFAULT, Material, Split, protocol_called
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.network.gradient_fit import Progress
from nnhydro.models.baselines import BASELINES
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.repeats import group_names, noise_floor
from nnhydro.recordings.splitting import Unit
from nnhydro.runtime.workers import HERE, Workers, spread

Array = NDArray[np.float64]
Report = Callable[[str], None]
LOOKED_BACK = 4  # fitted recordings on which the width of the intervals is looked up for comparison


def _judge_fold(model: TorqueModel, fit_s: float, fitted: Sequence[Unit], held_out: Sequence[Unit], name: str) -> Standing:
    """What one fold says of a model."""
    found = {unit.name: misfit_and_coverage(model, unit) for unit in held_out}
    known = {name: misfit for name, (misfit, _) in found.items() if misfit is not None}
    covered = total_coverage([coverage for _, coverage in found.values() if coverage is not None])
    back = coverage_of(model, fitted[::-(-len(fitted) // LOOKED_BACK)]) if covered is not None else None
    return Standing(name, [known], fit_s, [model], [] if covered is None else [covered], [] if back is None else [back])


@one_thread()
def _fitted_and_judged(entry: ModelEntry, fitted: Sequence[Unit], held_out: Sequence[Unit], arm: Arm, how: Preparation,
                       epochs: Progress | None) -> Standing:
    """One entry in one fold: the piece of work that goes to a worker."""
    start = time.perf_counter()
    model = entry.fit(fitted, arm, how, epochs)
    return _judge_fold(model, time.perf_counter() - start, fitted, held_out, entry.name)


def _in_turn(split: Split, entered: Sequence[ModelEntry], arm: Arm, how: Preparation, report: Report,
             workers: Workers) -> Iterator[Standing]:
    """Every entry in every fold, in order; one process tells what begins, several tell what has come in."""
    def progress_of(label: str) -> Progress | None:
        """Return what reports every tenth epoch of one training, None where several processes work."""
        if not workers.alone:
            return None
        return lambda epoch, total, error: report(f"{label}, epoch {epoch}/{total}") if epoch % 10 == 0 else None

    labels, tasks = [], []
    for number, fold in enumerate(split.folds):
        fitted, held_out = ([split.units[i] for i in part] for part in (fold.fitted, fold.held_out))
        for entry in entered:
            labels.append(f"{fold.name} ({number + 1} of {len(split.folds)}): {entry.name}")
            tasks.append((entry, fitted, held_out, arm, how, progress_of(labels[-1])))
    results = spread(_fitted_and_judged, tasks, workers)
    for label in labels:
        if workers.alone:
            report(label)
        yield next(results)
        if not workers.alone:
            report(label)


def honest(split: Split, entered: Sequence[ModelEntry]) -> tuple[Split, dict[str, tuple[str, ...]]]:
    """Return `split` without the held-out units that one of `entered` has seen before, and which units each has seen.

    Raises CampaignError where nothing is left on which all can be compared.
    """
    known = {entry.name: {i for i, unit in enumerate(split.units) if entry.seen & unit.content()}
             for entry in entered if entry.seen}
    every = set[int]().union(*known.values())
    if not every:
        return split, {}
    folds = [replace(fold, held_out=tuple(i for i in fold.held_out if i not in every)) for fold in split.folds]
    left = tuple(fold for fold in folds if fold.held_out)
    seen = {name: tuple(split.units[i].name for i in sorted(units)) for name, units in known.items() if units}
    if not left:
        who, units = max(seen.items(), key=lambda pair: len(pair[1]))
        raise CampaignError(f"{who}: has seen {len(units)} of the {len(split.units)} recordings here in its own fit ({', '.join(units[:4])}"
                            f"{', ...' if len(units) > 4 else ''}). No other is left to compare on: name the model "
                            f"({', '.join(BASELINES)}) instead of its folder, or benchmark it on recordings that it has not seen")
    return replace(split, folds=left), seen


def _material(campaigns: tuple[Campaign, ...], config: TrainingConfig, fold_count: int, seed: int) -> Material:
    return Material(campaigns, tuple(campaign.plan(config.cutoff_hz) for campaign in campaigns),
                    tuple(group_names(campaign) for campaign in campaigns), fold_count, seed)


def _mean_floor(material: Material) -> float | None:
    """Return the mean noise floor of the campaigns that repeat a motion; None where none does."""
    floors = [floor.error for campaign, how in zip(material.campaigns, material.hows, strict=True)
              if (floor := noise_floor(campaign, how)) is not None]
    return float(np.mean(floors)) if floors else None


@final
@dataclass(frozen=True)
class BenchmarkOptions:
    """The choices of a benchmark with their defaults: one object for Python, the command line and studies."""

    models: Sequence[str] = ()  # baselines, network, hybrid, comparators, model folders or all; by default what suits the arm
    folds: int = 5  # each recording is held out in one of them
    seed: int = 0  # of folds, networks and intervals
    config: TrainingConfig | None = None  # of networks; the defaults with `seed`
    protocol: str = DEFAULT  # what is held out

    @one_thread()
    def benchmark(self, campaign: Campaign | Sequence[Campaign], report: Report = lambda text: None,
                  workers: Workers = HERE) -> BenchmarkResult:
        """Return every model's misfit on recordings held out of its fit, as `protocol` says which; by default each recording once.

        Several campaigns are several arms. `workers` share the fits, a model and fold each. Raises ConfigError for an unknown name,
        CampaignError where nothing can be held out.
        """
        require(self.seed >= 0, f"seed {self.seed}: give 0 or a positive number")
        config = self.config or TrainingConfig(seed=self.seed)
        campaigns = (campaign,) if isinstance(campaign, Campaign) else tuple(campaign)
        chosen = protocol_called(self.protocol)
        entered = entries(self.models or default_names(campaigns[0].arm), campaigns, config)
        material = _material(campaigns, config, self.folds, self.seed)
        unusable = left_out(material)
        if unusable:
            report(f"left out, because no stretch of finite rows is long enough (see nnhydro check): {', '.join(unusable)}")
        split, seen = honest(chosen.split(material), entered)
        standings = {entry.name: Standing(entry.name) for entry in entered}
        rounds = _in_turn(split, entered, campaigns[0].arm, material.hows[0], report, workers)
        for (_, entry), standing in zip(product(split.folds, entered), rounds, strict=True):
            standings[entry.name].add(standing)
        return BenchmarkResult(campaigns, material.hows[0], chosen.name, split, standings, _mean_floor(material), self.seed, config,
                               unusable, seen)
