"""What a campaign holds and what looks wrong with it."""

from dataclasses import dataclass
from pathlib import Path
from typing import final

from nnhydro.api.campaign import campaign_of
from nnhydro.errors import ConfigError, require
from nnhydro.fitting.physical_survey import survey_with_physics
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.survey import Survey
from nnhydro.report.survey_table import oddities_sheet, recordings_sheet, tips_sheet, verdict
from nnhydro.runtime.workers import HERE, Workers
from nnhydro.sheet import ResultView, Sheet


@final
@dataclass(frozen=True, eq=False, repr=False)
class Check(ResultView):
    """A campaign looked over: `survey` holds every number; the data frame has one row per recording."""

    survey: Survey

    @property
    def usable(self) -> bool:
        """Whether nothing makes the campaign unusable."""
        return not self.survey.errors

    @property
    def oddities(self) -> tuple[str, ...]:
        """What looks wrong, each with its remedy, the worst first."""
        return tuple(oddity.message for oddity in self.survey.oddities)

    def verdict(self) -> str:
        """Return whether the campaign can be used, in one sentence."""
        return verdict(self.survey)

    def sheets(self) -> tuple[Sheet, ...]:
        """Return recordings, oddities, and how the tips move."""
        return recordings_sheet(self.survey), oddities_sheet(self.survey), tips_sheet(self.survey)


def check(campaign: Campaign | str | Path, cutoff_hz: float | None = None, workers: Workers = HERE) -> Check:
    """Return what was given, what is derived and what looks wrong, with the remedy.

    `campaign` may be its folder. `cutoff_hz` is the low-pass cut-off, chosen from the data by default; `workers` share the recordings
    (docs/cluster.md). Raises RecordingError where a file cannot be read at all.
    """
    require(cutoff_hz is None or 0 < cutoff_hz < 1e6, f"cutoff_hz {cutoff_hz}: give a positive frequency in Hz", ConfigError)
    return Check(survey_with_physics(campaign_of(campaign), cutoff_hz, workers))
