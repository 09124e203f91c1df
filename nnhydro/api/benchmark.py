"""Every model on the same held-out recordings."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

from nnhydro.api.campaign import campaign_of
from nnhydro.evaluation.benchmark import BenchmarkOptions
from nnhydro.evaluation.benchmark_result import BenchmarkResult
from nnhydro.evaluation.protocols.protocol import DEFAULT
from nnhydro.fitting.config import TrainingConfig, read_config
from nnhydro.recordings.campaign import Campaign
from nnhydro.report.benchmark.page import write_benchmark
from nnhydro.report.benchmark.tables import benchmark_sheets, models_sheet, recordings_sheet
from nnhydro.runtime.workers import HERE, Workers
from nnhydro.sheet import ResultView, Sheet

if TYPE_CHECKING:
    import pandas as pd


@final
@dataclass(frozen=True, eq=False, repr=False)
class Benchmark(ResultView):
    """Every model on recordings held out of its fit; the data frame has one row per model, best first, shares as fractions of 1."""

    result: BenchmarkResult

    @property
    def ranking(self) -> list[str]:
        """The models' names, best first."""
        return self.result.ranking()

    @property
    def noise_floor(self) -> float | None:
        """Error that a perfect model would have; None where nothing was repeated."""
        return self.result.noise_floor

    def verdict(self) -> str:
        """Return who won, in a sentence with numbers."""
        return self.result.verdict()

    def sheets(self) -> tuple[Sheet, ...]:
        """Return all models, folds where they differ in kind, and how the intervals cover."""
        return benchmark_sheets(self.result)

    def to_frame(self) -> "pd.DataFrame":
        """Return one row per model, best first: error with 95 % interval, NRMSE and VAF of each joint, seconds spent fitting."""
        return models_sheet(self.result, self.document(), perfect=False).frame()

    def by_recording(self) -> "pd.DataFrame":
        """Return every model's error on every recording, the worst for the best model first."""
        return recordings_sheet(self.result, self.document()).frame()

    def document(self) -> dict[str, Any]:
        """Return what benchmark.json holds."""
        return self.result.document()

    def save(self, folder: str | Path) -> list[Path]:
        """Write benchmark.json, the page report.html and the figures to `folder`; returns their paths."""
        return write_benchmark(self.result, Path(folder))


def benchmark(campaign: Campaign | str | Path | Sequence[Campaign | str | Path], models: Sequence[str] = (), folds: int = 5, seed: int = 0,
              config: TrainingConfig | str | Path | None = None, protocol: str = DEFAULT,
              report: Callable[[str], None] | None = None, workers: Workers = HERE) -> Benchmark:
    """Return every model's misfit on recordings held out of its fit.

    `models`: baselines, network, hybrid, comparators or folders of models (all physics that suits the arm, network and hybrid by default);
    several campaigns are several arms; `protocol` says what is held out; `report=print` shows progress; `workers` share the fits
    (docs/cluster.md). Raises ConfigError for an unknown name, CampaignError where nothing can be held out.
    """
    chosen = read_config(Path(config)) if isinstance(config, str | Path) else config
    arms: Sequence[Any] = campaign if isinstance(campaign, Sequence) and not isinstance(campaign, str) else (campaign,)
    options = BenchmarkOptions(models, folds, seed, chosen, protocol)
    return Benchmark(options.benchmark([campaign_of(arm) for arm in arms], report or (lambda text: None), workers))
