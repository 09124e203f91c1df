"""What the baseline omits: the effects with numbers, and the errors on held-out recordings."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

from nnhydro.api.campaign import campaign_of
from nnhydro.api.model import Model
from nnhydro.diagnosis.diagnose import DiagnosisOptions
from nnhydro.diagnosis.experiment.rig_limits import read_limits
from nnhydro.diagnosis.findings.finding import Finding
from nnhydro.diagnosis.findings.sheets import parameters_sheet
from nnhydro.diagnosis.result import DiagnosisResult
from nnhydro.recordings.campaign import Campaign
from nnhydro.report.diagnosis.page import write_diagnosis
from nnhydro.report.diagnosis.tables import errors_sheet, findings_sheet, location_sheet
from nnhydro.sheet import ResultView, Sheet


@final
@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(ResultView):
    """What is missing, where, and how good the model with it is; the data frame has one row per finding."""

    result: DiagnosisResult
    campaign: Campaign

    @property
    def detected(self) -> bool:
        """Whether baseline and recordings differ beyond noise and recalibration."""
        return bool(self.document()["mismatch"]["detected"])

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The effects that the baseline omits, the strongest first."""
        return tuple(self.result.findings)

    @property
    def corrected(self) -> Model:
        """The baseline, refitted, with everything that was found."""
        return Model(self.result.corrected)

    @property
    def baseline(self) -> Model:
        """The baseline, calibrated on the recordings."""
        return Model(self.result.baseline)

    def verdict(self) -> str:
        """Return what was found in plain words."""
        return self.result.verdict()

    def sheets(self) -> tuple[Sheet, ...]:
        """Return findings, their numbers, the errors, and where the residual lies."""
        document = self.document()
        return findings_sheet(document), parameters_sheet(document["findings"]), errors_sheet(document), location_sheet(document)

    def document(self) -> dict[str, Any]:
        """Return what diagnosis.json holds."""
        return self.result.document()

    def save(self, folder: str | Path) -> list[Path]:
        """Write diagnosis.json, report.html, figures, model/ and baseline/ to `folder`, whole or not at all; returns their paths."""
        return write_diagnosis(self.result, self.campaign, Path(folder))


def diagnose(campaign: Campaign | str | Path, baseline: str | Path | None = None, cutoff_hz: float | None = None, seed: int = 0,
             report: Callable[[str], None] | None = None, rehearsals: int = 0, limits: str | Path | None = None) -> Diagnosis:
    """Return what the baseline omits, by the recordings of `campaign`.

    `baseline` is a physics model by name, the folder of any model, or "column": the user's own simulation in tau1_sim_Nm, ...; constant,
    or rigid where the arm is dry, by default. `report=print` shows progress. `rehearsals`: how often findings and their
    rivals are injected into these motions, which limits each confidence to the share of right names. `limits` is a file with what
    the rig can do, for the motion to record next. Raises ConfigError for an unknown baseline or limits that do not fit the arm,
    CampaignError or RecordingError where the data cannot be used.
    """
    given = campaign_of(campaign)
    options = DiagnosisOptions(None if baseline is None else str(baseline), seed, cutoff_hz, (), rehearsals,
                               None if limits is None else read_limits(Path(limits)))
    return Diagnosis(options.diagnose(given, report or (lambda line: None)), given)
