"""What is diagnosed: recordings, what they are compared with, and where in the campaign each row lies.

Of a large campaign so many recordings are studied, spread over it; all others take no part in the search and are the proof. That keeps
memory flat and time linear, and no choice, fit or count has seen what the result is judged on.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from torch import Tensor

from nnhydro.diagnosis.reference import Reference, reference
from nnhydro.identification.prior import Prior
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import tensor
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.preprocessing import Preparation
from nnhydro.recordings.repeats import NoiseFloor, group_names, noise_floor
from nnhydro.recordings.splitting import Unit, units

MOST_STUDIED = 60  # recordings: more hardly sharpen a name, and memory and the search's time grow with them
AT_ONCE = 20  # recordings of the proof that are prepared together
PAUSE = 1.0  # s between recordings whose times of the day are not known
MOVED = (0.7, 1.3)  # of the cut-off: a verdict that hangs on it is an artefact of the filter

Places = Callable[[Unit, int], Tensor | None]


@final
@dataclass(frozen=True, eq=False)
class Case:
    """The units studied, the baseline, and the place in the campaign, -1 to 1, of the rows of a unit's segment (None: not known)."""

    all_units: tuple[Unit, ...]
    reference: Reference
    places: Places
    moved: "tuple[Case, ...]" = ()  # the same recordings with the cut-off moved: what is true survives it

    @property
    def model(self) -> StripTheory:
        """The calibrated physics."""
        return self.reference.physics

    @property
    def passed_hz(self) -> float:
        """The cut-off of the comparison: white noise passes in proportion to it; 1 where nothing is filtered."""
        segments = (s for unit in self.all_units for s in unit.segments())
        return next((s.low_pass.cutoff_hz for s in segments if s.low_pass is not None), 1.0)

    @property
    def before(self) -> Prior:
        """What is known of its parameters."""
        return self.reference.before


def places_in(campaign: Campaign, studied: Sequence[str]) -> Places:
    """Return the places -1 to 1 by the clock where every recording `studied` has one, else as if one had followed the other in their order.

    Recordings that are not studied count as long as those that are, in the mean.
    """
    clocks = [campaign.load(name).clock for name in studied]
    known = [clock for clock in clocks if clock is not None and np.isfinite(clock).any()]
    by_clock, lasts = len(known) == len(clocks), {name: campaign.load(name).duration for name in studied}
    usual = float(np.mean(list(lasts.values()))) if lasts else 0.0
    starts = np.cumsum([0.0, *(lasts.get(name, usual) + PAUSE for name in campaign.names)])
    begins = dict(zip(campaign.names, starts.tolist(), strict=False))
    first = min((float(np.nanmin(clock)) for clock in known), default=0.0) if by_clock else 0.0
    span = max((float(np.nanmax(clock)) for clock in known), default=1.0) - first if by_clock else float(starts[-1]) - PAUSE

    def places(unit: Unit, number: int) -> Tensor | None:
        if unit.steady:
            return None
        recording, segment = campaign.load(unit.name), unit.segments()[number]
        if not by_clock:
            passed = begins[unit.name] + segment.t - recording.t[0]
        elif recording.clock is None:
            return None
        else:
            passed = recording.clock[segment.start_row] + segment.t - segment.t[0]
        return tensor(2 * (passed - first) / (span or 1.0) - 1)

    return places


def drawn(campaign: Campaign, most: int, seed: int) -> tuple[str, ...]:
    """Return the names of at most `most` recordings, one drawn from each of as many consecutive stretches of the campaign."""
    rng = np.random.default_rng(seed)
    stretches = np.array_split(np.arange(len(campaign.names)), min(most, max(len(campaign.names), 1)))
    return tuple(campaign.names[int(rng.choice(stretch))] for stretch in stretches if len(stretch))


@final
@dataclass(frozen=True, eq=False)
class Opened:
    """A campaign ready for diagnosis: the case of what is studied, what its repeats say of the noise, and what is left for the proof."""

    case: Case
    floor: NoiseFloor | None
    campaign: Campaign
    later: tuple[str, ...]
    how: Preparation

    @property
    def repeats(self) -> tuple[float, ...] | None:
        """The noise (joints,) N m seen in repeats."""
        return None if self.floor is None else self.floor.std

    def fresh(self) -> Iterator[Case]:
        """Yield the recordings that took no part, a few at a time."""
        for start in range(0, len(self.later), AT_ONCE):
            part = replace(self.campaign, names=self.later[start:start + AT_ONCE], steady=())
            yield replace(self.case, all_units=units(part, self.how))


def opened(campaign: Campaign, baseline: str | None = None, seed: int = 0, cutoff_hz: float | None = None,
           most: int = MOST_STUDIED) -> Opened:
    """Return `campaign` ready for diagnosis against `baseline`, at most `most` recordings of it studied.

    Raises ConfigError for an unknown baseline, CampaignError or RecordingError where the data cannot be used.
    """
    names = drawn(campaign, most, seed)
    part = replace(campaign, names=names)
    how = part.plan(cutoff_hz)
    all_units = units(part, how, seed, group_names(part))
    case = Case(all_units, reference(baseline, campaign.arm, all_units, how), places_in(campaign, names))
    if how.low_pass is not None:
        others = [replace(how, low_pass=replace(how.low_pass, cutoff_hz=share * how.low_pass.cutoff_hz)) for share in MOVED]
        case = replace(case, moved=tuple(replace(case, all_units=units(part, other, seed)) for other in others))
    taken = set(names)
    return Opened(case, noise_floor(part, how), campaign, tuple(name for name in campaign.names if name not in taken), how)
