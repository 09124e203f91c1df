"""The choices of a diagnosis: one object for Python, the command line and batches."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

from nnhydro.diagnosis import diagnose as engine
from nnhydro.diagnosis.experiment.rig_limits import Limits
from nnhydro.diagnosis.result import DiagnosisResult
from nnhydro.recordings.campaign import Campaign


@final
@dataclass(frozen=True)
class DiagnosisOptions:
    """What `nnhydro diagnose` may be told, with its defaults."""

    baseline: str | None = None  # a physics model by name, a model folder, or "column"; constant, or rigid where dry
    seed: int = 0  # of subsets of recordings and of null draws
    cutoff_hz: float | None = None  # from the data
    without: tuple[str, ...] = ()  # effects that are taken out of the catalogue
    rehearsals: int = 0  # draws of each finding and of each alternative that calibrate the confidence
    limits: Limits | None = None  # what the rig can do; the ranges of the recordings

    def diagnose(self, campaign: Campaign, progress: Callable[[str], None] = lambda line: None) -> DiagnosisResult:
        """Return the diagnosis of `campaign` with these choices; raises as `nnhydro.diagnosis.diagnose.diagnose`."""
        return engine.diagnose(campaign, **vars(self), progress=progress)
