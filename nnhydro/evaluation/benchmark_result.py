"""What a benchmark found: every model's errors on held-out recordings, benchmark.json, the verdict and the command that comes next."""

from dataclasses import dataclass, field
from typing import Any, final

from nnhydro.conventions import SCHEMA_BENCHMARK
from nnhydro.errors import count_text
from nnhydro.evaluation.interval_coverage import Coverage, coverage_document
from nnhydro.evaluation.metrics import Misfit, error_interval
from nnhydro.evaluation.protocols.protocol import Fold, Split
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.identify import unusual_coefficients, versions
from nnhydro.models.baselines import BASELINES
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.splitting import Unit

UNEXPLAINED = 0.5  # of the torque: a model that leaves more explains nothing
CLEAR_RATIO = 1.05  # times better: below it two models are alike
MANY_FLOORS, SMALL_ERROR = 2.0, 0.05  # noise floors, share of the torque: what may be left without a cause to look for


@final
@dataclass(eq=False)
class Standing:
    """One model's result: misfit of every held-out unit fold by fold, time spent fitting, and the folds' models."""

    name: str
    by_fold: list[dict[str, Misfit]] = field(default_factory=list)  # by unit, one per fold
    fit_s: float = 0.0
    models: list[TorqueModel] = field(default_factory=list)  # one per fold
    coverage: list[Coverage] = field(default_factory=list)  # of held-out units, where the model knows its std; one per fold
    fitted_coverage: list[Coverage] = field(default_factory=list)  # of some fitted units, one per fold

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
                 "vaf": pooled.vaf, "fit_s": round(self.fit_s, 3),
                 "by_recording": {unit: misfit.error for unit, misfit in self.misfit.items()}}
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
        return {name: Misfit.total(standing.by_fold[number].values()).error for name, standing in self.standings.items()
                if standing.by_fold[number]}

    def fold_wider(self, number: int) -> dict[str, float]:
        """Return how much wider, relative to the torque, the intervals of one fold are on held-out than on fitted recordings."""
        known = {name: (standing.coverage[number].width, standing.fitted_coverage[number].width)
                 for name, standing in self.standings.items()
                 if len(standing.coverage) > number and len(standing.fitted_coverage) > number}
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
        """Return the best model in a sentence with numbers, or that no model explains the torques."""
        ranking = self.ranking()
        best = self.standings[ranking[0]].pooled.error
        if best > UNEXPLAINED:
            text = (f"No model explains these torques: the best, {ranking[0]}, leaves {100 * best:.1f} % of them on recordings that no fit "
                    "has seen")
        else:
            text = f"On recordings that no fit has seen, {ranking[0]} predicts the torques best: {100 * best:.1f} % error"
            text += self._against_reference(ranking[0], best)
        text += f"; a perfect model would leave {100 * self.noise_floor:.1f} %" if self.noise_floor is not None else ""
        left = sorted({name for units in self.seen.values() for name in units})
        if left:
            text += (f". {count_text(len(left), 'recording')} not compared, because {' and '.join(self.seen)} had been fitted to them: "
                     f"{', '.join(left[:4])}{', ...' if len(left) > 4 else ''}")
        return f"{text}.{self._unusual()}"

    def _unusual(self) -> str:
        """The coefficients of the best fitted physics that no cylinder has, as a sentence; empty where there are none."""
        for name in self.ranking():
            model = next(iter(self.standings[name].models[-1:]), None)
            unusual = unusual_coefficients(model.loads) if isinstance(model, StripTheory) else []
            if unusual:
                kinds = [", ".join(f"{label} = {value:.3g}" for label, value, kind in unusual if kind == said) + f" ({said})"
                         for said in dict.fromkeys(said for _, _, said in unusual)]
                return (f" The fit of {name} has {' and '.join(kinds)}: check diameters, lengths, units and signs with nnhydro check. An "
                        "omitted effect may distort them, too: see nnhydro diagnose.")
        return ""

    def _against_reference(self, best_name: str, best: float) -> str:
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
        if best_name == "hybrid":
            return f"nnhydro train {campaign} --out my_model   (the hybrid on all recordings, for nnhydro predict)"
        if best_name == "network":
            return (f"echo 'model = \"network\"' > network.toml && nnhydro train {campaign} --config network.toml --out my_model"
                    "   (the network on all recordings, for nnhydro predict)")
        return f"nnhydro diagnose {campaign} --out diagnosis   (which physics explains what {best_name} learned?)"
