"""The naming part of a diagnosis alone, for rehearsals: search, pruning, findings; no proof, no models, no report."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

from nnhydro.diagnosis.case import Case, opened
from nnhydro.diagnosis.experiment import Proposal, next_experiment
from nnhydro.diagnosis.naming import named as named_in
from nnhydro.diagnosis.rig import Limits
from nnhydro.diagnosis.search import Found
from nnhydro.diagnosis.verdict import Finding
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.campaign import Campaign


@final
@dataclass(frozen=True, eq=False)
class Studied:
    """What was found in a case, and the state of the selection from which an experiment can be proposed."""

    case: Case
    found: Found
    findings: list[Finding]

    def proposal(self, seed: int = 0, limits: Limits | None = None) -> Proposal | None:
        """Return the motion that would settle the first ambiguous finding, None where there is none."""
        return next_experiment(self.found.race, self.case, self.found.believed, seed, limits)


@one_thread()
def named(case: Case, repeats: tuple[float, ...] | None = None, seed: int = 0, without: Sequence[str] = ()) -> Studied:
    """Return what the baseline leaves out of `case`, as `diagnose` names it; `repeats` (joints,) N m is the noise seen in repeats."""
    told = named_in(case, repeats, seed, without)
    return Studied(case, told.found, told.findings)


def studied(campaign: Campaign, baseline: str | None = None, seed: int = 0) -> Studied:
    """Return what is named in a campaign."""
    ready = opened(campaign, baseline, seed)
    return named(ready.case, ready.repeats, seed)
