"""All models on the same held-out recordings: the work behind `nnhydro benchmark`."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import SCHEMA_BENCHMARK
from nnhydro.errors import CampaignError, count_text, require
from nnhydro.evaluation.entries import ModelEntry, default_names, entries
from nnhydro.evaluation.interval_coverage import Coverage, coverage_document
from nnhydro.evaluation.metrics import Misfit, error_interval
from nnhydro.evaluation.protocols.pool import left_out
from nnhydro.evaluation.protocols.protocol import DEFAULT, Fold, Material, Split, protocol_called
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.identify import versions
from nnhydro.fitting.linear.several_arms import arm_of, on_arm
from nnhydro.fitting.network.gradient_fit import Progress
from nnhydro.models.baselines import BASELINES
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.repeats import group_names, noise_floor
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit
from nnhydro.runtime.workers import HERE, Workers, spread

Array = NDArray[np.float64]
PROTOCOL = DEFAULT
Report = Callable[[str], None]
UNEXPLAINED = 0.5  # of the torque: a model that leaves more explains nothing
CLEAR_RATIO = 1.05  # times better: below it two models are alike
MANY_FLOORS, SMALL_ERROR = 2.0, 0.05  # noise floors, share of the torque: what may be left without a cause to look for
LOOKED_BACK = 12  # fitted recordings on which the width of the intervals is looked up for comparison


@final
@dataclass(eq=False)
class Standing:
    """One model's result: misfit of every held-out unit fold by fold, time spent fitting, and the folds' models."""

    name: str
    by_fold: list[dict[str, Misfit]] = field(default_factory=list)  # by unit, one a fold
    fit_s: float = 0.0
    models: list[TorqueModel] = field(default_factory=list)  # one a fold
    coverage: list[Coverage] = field(default_factory=list)  # of held-out units, where the model knows its std; one a fold
    fitted_coverage: list[Coverage] = field(default_factory=list)  # of some fitted units, one a fold

    def add(self, fold: "Standing") -> None:
        """Take in what one more fold says."""
        self.by_fold += fold.by_fold
        self.fit_s += fold.fit_s
        self.models += fold.models
        self.coverage += fold.coverage
        self.fitted_coverage += fold.fitted_coverage

    @property
    def misfit(self) -> dict[str, Misfit]:
        """Misfit by held-out unit; of one that is held out again, that of the last fold."""
        return {name: misfit for fold in self.by_fold for name, misfit in fold.items()}

    @property
    def pooled(self) -> Misfit:
        """Misfit over all held-out units."""
        return Misfit.total(self.misfit.values())

    def document(self, seed: int, last_alone: bool) -> dict[str, Any]:
        """Return the model's entry in benchmark.json; `last_alone` takes the coverage of the last fold instead of all."""
        pooled = self.pooled
        entry = {"error": pooled.error, "error_ci95": list(error_interval(list(self.misfit.values()), seed)), "nrmse": pooled.nrmse,
                 "vaf": pooled.vaf, "fit_s": round(self.fit_s, 3), "by_recording": {unit: m.error for unit, m in self.misfit.items()}}
        if self.coverage:
            parts, back = (x[-1:] if last_alone else x for x in (self.coverage, self.fitted_coverage))
            entry["coverage"] = coverage_document(sum(parts[1:], start=parts[0]), sum(back[1:], start=back[0]) if back else None)
        return entry


@final
@dataclass(frozen=True, eq=False)
class BenchmarkResult:
    """Every model on the same held-out units."""

    campaigns: tuple[Campaign, ...]
    how: Preparation
    protocol: str
    split: Split
    standings: dict[str, Standing]
    noise_floor: float | None
    seed: int
    config: TrainingConfig
    left_out: tuple[str, ...] = ()  # recordings without a stretch of finite rows
    seen: dict[str, tuple[str, ...]] = field(default_factory=dict)  # by model: units that it had seen before, on which nobody is judged

    @property
    def campaign(self) -> Campaign:
        """The campaign, the first where there are several arms."""
        return self.campaigns[0]

    @property
    def units(self) -> tuple[Unit, ...]:
        """All units."""
        return self.split.units

    @property
    def folds(self) -> tuple[tuple[int, ...], ...]:
        """Indices of the units held out, one tuple a fold."""
        return tuple(fold.held_out for fold in self.split.folds)

    def ranking(self) -> list[str]:
        """Return the names, best first."""
        return sorted(self.standings, key=lambda name: self.standings[name].pooled.error)

    def fitted_count(self, fold: Fold) -> int:
        """Return how many recordings a fold fits (bunches of steady rows where there is no recording)."""
        return sum(not self.units[i].steady for i in fold.fitted) or len(fold.fitted)

    def fold_errors(self, number: int) -> dict[str, float]:
        """Return every model's pooled error in one fold."""
        return {name: Misfit.total(s.by_fold[number].values()).error for name, s in self.standings.items() if s.by_fold[number]}

    def fold_wider(self, number: int) -> dict[str, float]:
        """Return how much wider, relative to the torque, the intervals of one fold are on held-out than on fitted recordings."""
        known = {name: (s.coverage[number].width, s.fitted_coverage[number].width) for name, s in self.standings.items()
                 if len(s.coverage) > number and len(s.fitted_coverage) > number}
        return {name: held_out / fitted for name, (held_out, fitted) in known.items() if fitted > 0}

    def document(self) -> dict[str, Any]:
        """Return what benchmark.json holds."""
        models = {name: standing.document(self.seed, self.split.curve) for name, standing in self.standings.items()}
        parts = [{"name": fold.name, "held_out": [self.units[i].name for i in fold.held_out], "fitted": self.fitted_count(fold),
                  "errors": self.fold_errors(k), "wider": self.fold_wider(k)} for k, fold in enumerate(self.split.folds)]
        low_pass = self.how.low_pass
        digests = [campaign.sha256() for campaign in self.campaigns]
        return {"schema": SCHEMA_BENCHMARK, "protocol": self.protocol, "noise_floor": self.noise_floor, "models": models, "folds": parts,
                "left_out": list(self.left_out),
                "seen_before": {name: list(units) for name, units in self.seen.items()},
                "cutoff_hz": None if low_pass is None else low_pass.cutoff_hz, "seed": self.seed,
                "config": self.config.model_dump(mode="json"),
                "versions": versions() | {"campaign_sha256": digests[0] if len(digests) == 1 else digests}}

    def verdict(self) -> str:
        """Return who won, in a sentence with numbers; where nobody explains the torques, it says that."""
        ranking = self.ranking()
        best = self.standings[ranking[0]].pooled.error
        if best > UNEXPLAINED:
            text = (f"No model explains these torques: the best, {ranking[0]}, leaves {100 * best:.1f} % of them on recordings that no fit "
                    "has seen")
        else:
            text = f"On recordings that no fit has seen, {ranking[0]} predicts the torques best: {100 * best:.1f} % error"
            text += self._beside_reference(ranking[0], best)
        text += f"; a perfect model would leave {100 * self.noise_floor:.1f} %" if self.noise_floor is not None else ""
        left = sorted({name for units in self.seen.values() for name in units})
        if left:
            text += (f". {count_text(len(left), 'recording')} not compared, because {' and '.join(self.seen)} had been fitted to them: "
                     f"{', '.join(left[:4])}{', ...' if len(left) > 4 else ''}")
        return text + "."

    def _beside_reference(self, best_name: str, best: float) -> str:
        """How much better the best is than a baseline that everybody knows."""
        reference = next((name for name in ("constant", "rigid", "textbook") if name in self.standings and name != best_name), None)
        if reference is None:
            return ""
        reference_error = self.standings[reference].pooled.error
        ratio = reference_error / max(best, 1e-12)
        if ratio < CLEAR_RATIO:
            return f", not clearly better than {reference} ({100 * reference_error:.1f} %)"
        return f", {ratio:.1f} times better than {reference} ({100 * reference_error:.1f} %)"

    def following(self, campaign: str) -> str:
        """Return the command that comes next: a diagnosis where much is left, else the model that won, made of all recordings."""
        best_name = self.ranking()[0]
        best = self.standings[best_name].pooled.error
        if best > max(MANY_FLOORS * self.noise_floor if self.noise_floor is not None else SMALL_ERROR, SMALL_ERROR):
            return f"nnhydro diagnose {campaign} --out diagnosis   (what is missing?)"
        if best_name in BASELINES:
            return f"nnhydro identify {campaign} --model {best_name} --out my_model   (of all recordings, for nnhydro predict)"
        if best_name in ("network", "hybrid"):
            return f"nnhydro train {campaign} --out my_model   (the hybrid on all recordings, for nnhydro predict)"
        return f"nnhydro diagnose {campaign} --out diagnosis   (which physics explains what {best_name} learned?)"


def model_torque(model: TorqueModel, segment: Segment) -> Array:
    """Return the model's torque (n, joints) N m on a segment, through the same filter as the measured one."""
    return segment.filter(model.torque(Motion.of(segment)).numpy())


def misfit_and_coverage(model: TorqueModel, unit: Unit) -> tuple[Misfit | None, Coverage | None]:
    """Return the misfit of `model` on the compared rows of `unit`, None where it has none, and how its intervals cover them.

    The coverage is None where the model knows no standard deviation.
    """
    model = on_arm(model, arm_of(unit, model.arm))
    misfits, covered = [], []
    for segment in unit.segments():
        if segment.tau is None or not segment.keep.any():
            continue
        keep, measured = segment.keep, segment.tau[segment.keep]
        found, std = model.torque_and_std(Motion.of(segment))
        modelled = segment.filter(found.numpy())[keep]
        misfits.append(Misfit.of(measured, modelled))
        covered += [] if std is None else [Coverage.of(measured, modelled, std.numpy()[keep])]
    return Misfit.total(misfits) if misfits else None, _total(covered)


def misfit_of(model: TorqueModel, unit: Unit) -> Misfit | None:
    """Return the misfit of `model` on the compared rows of `unit`; None where it has none."""
    return misfit_and_coverage(model, unit)[0]


def coverage_of(model: TorqueModel, chosen: Sequence[Unit]) -> Coverage | None:
    """Return how the intervals of `model` cover the compared rows of the units `chosen`; None where it knows no std."""
    return _total([coverage for unit in chosen if (coverage := misfit_and_coverage(model, unit)[1]) is not None])


def _total(parts: Sequence[Coverage]) -> Coverage | None:
    return sum(parts[1:], start=parts[0]) if parts else None


def _judge_fold(model: TorqueModel, fit_s: float, fitted: Sequence[Unit], held_out: Sequence[Unit], name: str) -> Standing:
    """What one fold says of a model."""
    found = {unit.name: misfit_and_coverage(model, unit) for unit in held_out}
    known = {name: misfit for name, (misfit, _) in found.items() if misfit is not None}
    covered = _total([coverage for _, coverage in found.values() if coverage is not None])
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


@one_thread()
def benchmark(campaign: Campaign | Sequence[Campaign], models: Sequence[str] = (), fold_count: int = 5, seed: int = 0,
              config: TrainingConfig | None = None, report: Report | None = None, protocol: str = DEFAULT,
              workers: Workers = HERE) -> BenchmarkResult:
    """Return every model's misfit on recordings held out of its fit, as `protocol` says which; by default each recording once.

    `models`: baselines, `network`, `hybrid`, comparators or model folders (all physics that suits the arm, network and hybrid by default).
    Several campaigns are several arms. `workers` share the fits, a model and fold each. Raises ConfigError for an unknown name,
    CampaignError where nothing can be held out.
    """
    require(seed >= 0, f"seed {seed}: give 0 or a positive number")
    config = config or TrainingConfig(seed=seed)
    campaigns = (campaign,) if isinstance(campaign, Campaign) else tuple(campaign)
    chosen = protocol_called(protocol)
    entered = entries(models or default_names(campaigns[0].arm), campaigns, config)
    material = _material(campaigns, config, fold_count, seed)
    unusable = left_out(material)
    if report is not None and unusable:
        report(f"left out, because no stretch of finite rows is long enough (see nnhydro check): {', '.join(unusable)}")
    split, seen = honest(chosen.split(material), entered)
    standings = {entry.name: Standing(entry.name) for entry in entered}
    rounds = _in_turn(split, entered, campaigns[0].arm, material.hows[0], report or (lambda text: None), workers)
    for (_, entry), standing in zip(product(split.folds, entered), rounds, strict=True):
        standings[entry.name].add(standing)
    floors = [floor.error for campaign, how in zip(campaigns, material.hows, strict=True)
              if (floor := noise_floor(campaign, how)) is not None]
    mean_floor = float(np.mean(floors)) if floors else None
    return BenchmarkResult(campaigns, material.hows[0], chosen.name, split, standings, mean_floor, seed, config, unusable, seen)
