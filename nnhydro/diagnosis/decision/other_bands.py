"""Whether the claims depend on the band: the score of the claimed laws at other upper edges of it.

    gain_k(f) = score(S) - score(S less k)   on rows up to f times the edge;   lost where <= LEAST_GAIN

Motion, noise and unknown are estimated anew at each edge.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from nnhydro.diagnosis.constants import LEAST_GAIN
from nnhydro.diagnosis.model.evidence import WhiteRows
from nnhydro.diagnosis.model.unknown import unknown_of
from nnhydro.diagnosis.noise.spectrum import calibrated_noise, reestimate
from nnhydro.diagnosis.problem.hypothesis import Hypothesis, Key
from nnhydro.diagnosis.problem.problem import Problem, problem_of
from nnhydro.diagnosis.problem.stated_friction import design_on
from nnhydro.diagnosis.search.library import Library
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary
from nnhydro.errors import require
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.band import Band

FACTORS = (0.7, 1.4)  # factors of the band's upper edge at which the decisions are repeated


@final
@dataclass(frozen=True)
class OtherBand:
    """The upper edge, Hz, and the effects and joints that would not be claimed with it."""

    edge: float
    lost: tuple[Key, ...]

    def document(self) -> dict[str, Any]:
        """Return the entry of diagnosis.json."""
        return {"band_hz": self.edge, "lost": [{"effect": effect, "joint": joint or None} for effect, joint in self.lost]}

    def sentence(self) -> str:
        """Return what would not be claimed, in words; empty where all stands."""
        said = ", ".join(f"{effect} at joint {joint}" if joint else effect for effect, joint in self.lost)
        return f"If only frequencies below {self.edge:.2g} Hz were compared, this would not be claimed: {said}." if self.lost else ""


def claims_at(campaign: Campaign, judged: Problem, band: Band, baseline: str | None, claimed: Sequence[Hypothesis]) -> OtherBand:
    """Return which of the laws `claimed` in the problem `judged` lose their evidence in another `band`.

    Raises ConfigError for edges that are no frequencies, CampaignError or RecordingError where too little is left in that band.
    """
    require(band.torque > 0 and band.motion > 0, f"a band up to {min(band.torque, band.motion):g} Hz holds nothing: give edges above 0 Hz")
    design = design_on(problem_of(campaign, judged.names, band, judged.left_out), baseline)
    unknown = unknown_of(design, design.baseline.at(np.zeros(design.Y.shape[2])))
    noise, whitened, sizes, model = calibrated_noise(design, unknown)
    library, whole = Library.of(design, claimed, model), tuple(range(len(claimed)))
    search = Search(WeightedLibrary(whitened, library), sizes)
    found = search.score(whole)
    noise = reestimate(design, noise, whitened, search.view.join(whole), found.sizes.vector(whitened))
    search = Search(WeightedLibrary(WhiteRows(design, unknown.smooth, noise.v), library), found.sizes)
    found = search.score(whole)
    gains = [search.gain(search.score(found.without(k)), found) for k in whole]
    return OtherBand(band.torque, tuple(hypothesis.key for hypothesis, gain in zip(claimed, gains, strict=True) if gain <= LEAST_GAIN))
