"""All models on the same held-out recordings: the work behind `nnhydro benchmark`."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import SCHEMA_BENCHMARK
from nnhydro.errors import require
from nnhydro.evaluation.contenders import Contender, contenders, default_names
from nnhydro.evaluation.metrics import Misfit, error_interval
from nnhydro.identification.config import TrainingConfig
from nnhydro.identification.identify import versions
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.preprocessing import Preparation
from nnhydro.recordings.repeats import group_names, noise_floor
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit, folds, units

Array = NDArray[np.float64]
PROTOCOL = "leave-recordings-out"
Report = Callable[[str], None]


@final
@dataclass(eq=False)
class Standing:
    """One model's result: misfit of every held-out unit, time spent fitting, and the fold's models."""

    name: str
    misfit: dict[str, Misfit] = field(default_factory=dict)  # by unit
    fit_s: float = 0.0
    models: list[TorqueModel] = field(default_factory=list)  # one a fold

    @property
    def pooled(self) -> Misfit:
        """Misfit over all held-out units."""
        return Misfit.total(self.misfit.values())


@final
@dataclass(frozen=True, eq=False)
class Benchmark:
    """Every model on the same held-out units; `folds` holds unit indices."""

    campaign: Campaign
    how: Preparation
    units: tuple[Unit, ...]
    folds: tuple[tuple[int, ...], ...]
    standings: dict[str, Standing]
    noise_floor: float | None
    seed: int
    config: TrainingConfig
    left_out: tuple[str, ...] = ()  # recordings without a stretch of finite rows

    def ranking(self) -> list[str]:
        """Return the names, best first."""
        return sorted(self.standings, key=lambda name: self.standings[name].pooled.error)

    def document(self) -> dict[str, Any]:
        """Return what benchmark.json holds."""
        models = {}
        for name, standing in self.standings.items():
            pooled = standing.pooled
            models[name] = {"error": pooled.error, "error_ci95": list(error_interval(list(standing.misfit.values()), self.seed)),
                            "nrmse": pooled.nrmse, "vaf": pooled.vaf, "fit_s": round(standing.fit_s, 3),
                            "by_recording": {unit: misfit.error for unit, misfit in standing.misfit.items()}}
        parts = []
        for fold in self.folds:
            names = [self.units[i].name for i in fold]
            parts.append({"held_out": names, "errors": {name: Misfit.total(s.misfit[n] for n in names if n in s.misfit).error
                                                        for name, s in self.standings.items()}})
        low_pass = self.how.low_pass
        return {"schema": SCHEMA_BENCHMARK, "protocol": PROTOCOL, "noise_floor": self.noise_floor, "models": models, "folds": parts,
                "left_out": list(self.left_out),
                "cutoff_hz": None if low_pass is None else low_pass.cutoff_hz, "seed": self.seed,
                "config": self.config.model_dump(mode="json"), "versions": versions() | {"campaign_sha256": self.campaign.sha256()}}

    def verdict(self) -> str:
        """Return who won, in a sentence with numbers."""
        ranking = self.ranking()
        best = self.standings[ranking[0]].pooled.error
        text = f"On recordings that no fit has seen, {ranking[0]} predicts the torques best: {100 * best:.1f} % error"
        rival = next((name for name in ("constant", "rigid", "textbook") if name in self.standings and name != ranking[0]), None)
        if rival is not None:
            other = self.standings[rival].pooled.error
            text += f", {other / max(best, 1e-12):.1f} times better than {rival} ({100 * other:.1f} %)"
        return text + (f"; a perfect model would leave {100 * self.noise_floor:.1f} %." if self.noise_floor is not None else ".")


def modelled(model: TorqueModel, segment: Segment) -> Array:
    """Return the model's torque (n, joints) N m on a segment, through the same filter as the measured one."""
    return segment.seen(model.torque(Motion.of(segment)).numpy())


def misfit_of(model: TorqueModel, unit: Unit) -> Misfit | None:
    """Return the misfit of `model` on the compared rows of `unit`; None where it has none."""
    parts = [Misfit.of(segment.tau[segment.keep], modelled(model, segment)[segment.keep])
             for segment in unit.segments() if segment.tau is not None and segment.keep.any()]
    return Misfit.total(parts) if parts else None


def _comparable(unit: Unit) -> bool:
    return any(segment.tau is not None and bool(segment.keep.any()) for segment in unit.segments())


def _fit_fold(number: int, held_out: tuple[int, ...], entered: Sequence[Contender], standings: dict[str, Standing], of: Campaign,
              how: Preparation, all_units: Sequence[Unit], count: int, report: Report | None) -> None:
    fitted = [unit for i, unit in enumerate(all_units) if i not in held_out]
    for contender in entered:
        label = f"fold {number + 1}/{count}: {contender.name}"

        def epochs(epoch: int, total: int, error: float, label: str = label) -> None:
            if report is not None and epoch % 10 == 0:
                report(f"{label}, epoch {epoch}/{total}")

        if report is not None:
            report(label)
        start = time.perf_counter()
        model = contender.fit(fitted, of.arm, how, epochs)
        standing = standings[contender.name]
        standing.fit_s += time.perf_counter() - start
        standing.models.append(model)
        for i in held_out:
            misfit = misfit_of(model, all_units[i])
            if misfit is not None:
                standing.misfit[all_units[i].name] = misfit


def benchmark(campaign: Campaign, models: Sequence[str] = (), fold_count: int = 5, seed: int = 0, config: TrainingConfig | None = None,
              report: Report | None = None) -> Benchmark:
    """Return every model's misfit on recordings held out of all its fits; each recording is held out once.

    `models`: baselines, `network`, `hybrid` or model folders (all that suit the arm by default). Repeats of one motion share a fold.
    Raises ConfigError for an unknown name, CampaignError where fewer than two motions leave nothing to hold out.
    """
    require(seed >= 0, f"seed {seed}: give 0 or a positive number")
    config = config or TrainingConfig(seed=seed)
    entered = contenders(models or default_names(campaign.arm), campaign, config)
    how = campaign.plan(config.cutoff_hz)
    every = units(campaign, how, seed, group_names(campaign))
    usable = [_comparable(unit) for unit in every]
    all_units = tuple(unit for unit, use in zip(every, usable, strict=True) if use)
    left_out = tuple(unit.name for unit, use in zip(every, usable, strict=True) if not use)
    if report is not None and left_out:
        report(f"left out, because no stretch of finite rows is long enough (see nnhydro check): {', '.join(left_out)}")
    split = folds(all_units, fold_count, seed)
    standings = {contender.name: Standing(contender.name) for contender in entered}
    for number, held_out in enumerate(split):
        _fit_fold(number, held_out, entered, standings, campaign, how, all_units, len(split), report)
    floor = noise_floor(campaign, how)
    return Benchmark(campaign, how, all_units, split, standings, None if floor is None else floor.error, seed, config, left_out)
