"""Diagnose many campaigns, each into its own folder, on all workers."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

from nnhydro.diagnosis.diagnose import DiagnosisOptions
from nnhydro.effects.plugin import load_plugin
from nnhydro.errors import NnhydroError
from nnhydro.recordings.campaign import verify_campaign
from nnhydro.report.diagnosis.page import write_diagnosis
from nnhydro.runtime.user_code import named_faults
from nnhydro.runtime.workers import HERE, Workers, spread


@final
@dataclass(frozen=True)
class DiagnosisRequest:
    """One diagnosis: the folder of the campaign, where the result goes, the choices, and the user's own effects and columns."""

    campaign: Path
    out: Path
    options: DiagnosisOptions
    effects: Path | None = None
    column_map: Path | None = None


@final
@dataclass(frozen=True)
class BatchOutcome:
    """What became of it: diagnosis.json and the verdict, or why there is none."""

    asked: DiagnosisRequest
    document: dict[str, Any] | None
    verdict: str


def _diagnose(asked: DiagnosisRequest) -> BatchOutcome:
    """One campaign: read, diagnosed and written by the worker itself, so that a finished diagnosis is never lost."""
    try:
        with named_faults():
            if asked.effects is not None:
                load_plugin(asked.effects)
            campaign = verify_campaign(asked.campaign, asked.column_map)
            result = asked.options.diagnose(campaign)
            write_diagnosis(result, campaign, asked.out)
            return BatchOutcome(asked, result.document(), result.verdict())
    except NnhydroError as cause:
        return BatchOutcome(asked, None, str(cause))


def diagnose_all(asked: Sequence[DiagnosisRequest], workers: Workers = HERE) -> Iterator[BatchOutcome]:
    """Yield what became of each diagnosis, in order; one that fails by a user's error says so and stops no other."""
    yield from spread(_diagnose, [(request,) for request in asked], workers)
