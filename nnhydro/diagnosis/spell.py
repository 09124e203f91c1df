"""The part of a campaign in which an effect acts: from or up to a moment, in some recordings, or while a joint lies in a sector.

    x_k -> w x_k,   w = [begin <= place < end] [recording among the named] [low <= q_j < high]

Places run from -1 to 1 over the campaign (`places_in`), so that recordings which took no part in the search have theirs.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import column
from nnhydro.effects.effect import Effect
from nnhydro.effects.in_sector import within

Array = NDArray[np.float64]


@final
@dataclass(frozen=True)
class Sector:
    """Angles of one joint (from 1), rad; None where it is open to that side."""

    joint: int
    low: float | None
    high: float | None

    def holds(self, q: Array) -> NDArray[np.bool_]:
        """Return which angles (n,) rad lie in it."""
        return np.asarray(within(q, self.low, self.high))

    def shows(self, effect: Effect) -> bool:
        """Return whether the sector is wide enough for what the effect does along these angles."""
        if self.low is None or self.high is None or self.joint != effect.joint:
            return True
        return self.high - self.low >= effect.narrowest()

    def sentence(self) -> str:
        """Return it in words."""
        if self.low is None:
            return f"below {self.high:.2f} rad"
        return f"above {self.low:.2f} rad" if self.high is None else f"between {self.low:.2f} and {self.high:.2f} rad"

    def document(self) -> dict[str, Any]:
        """Return it for diagnosis.json."""
        return {"joint": self.joint, "low_rad": self.low, "high_rad": self.high}


@final
@dataclass(frozen=True)
class Spell:
    """When and where an effect acts; what is None or infinite does not limit it.

    `since`, `until` are the recordings with which it begins and ends, `since_s`, `until_s` the time in them where it does so within one;
    `inside` are the recordings in which it acts, whatever their order; `outside` turns the whole into its opposite. `throughout` are the
    studied recordings that lie in it from their first row to the last; None: all do.
    """

    begin: float = -inf
    end: float = inf
    since: str | None = None
    until: str | None = None
    since_s: float | None = None
    until_s: float | None = None
    inside: frozenset[str] | None = None
    sector: Sector | None = None
    outside: bool = False
    throughout: frozenset[str] | None = field(default=None, compare=False)

    def mask(self, recording: str, place: Array | None, state: Mapping[str, Array]) -> NDArray[np.bool_]:
        """Return which rows (n,) lie in it; `place` None: nobody knows when they were recorded, and it is taken to act in none."""
        acts = np.ones(len(next(iter(state.values()))), dtype=bool)
        if self.begin > -inf or self.end < inf:
            acts &= (place >= self.begin) & (place < self.end) if place is not None else False
        if self.inside is not None:
            acts &= recording in self.inside
        if self.sector is not None:
            acts &= self.sector.holds(state[column("q", self.sector.joint)])
        return ~acts if self.outside else acts

    @property
    def opposite(self) -> "Spell":
        """All that is not in it."""
        return replace(self, outside=not self.outside)

    @property
    def foreseeable(self) -> bool:
        """Whether it is known to act in what is recorded next."""
        return self.end == inf and self.inside is None

    def sentence(self) -> str:
        """Return it in words."""
        if self.sector is not None:
            return f"while joint {self.sector.joint} lies {self.sector.sentence()}"
        if self.inside is not None:
            return f"in {', '.join(sorted(self.inside))}"
        first, last = (name if s is None else f"{s:.2f} s of {name}"
                       for name, s in ((self.since, self.since_s), (self.until, self.until_s)))
        return f"from {first} on" if self.until is None else f"up to {last}" if self.since is None else f"from {first} to {last}"

    def document(self) -> dict[str, Any]:
        """Return it for diagnosis.json."""
        return {"since": self.since, "until": self.until, "since_s": self.since_s, "until_s": self.until_s,
                "recordings": None if self.inside is None else sorted(self.inside),
                "region": None if self.sector is None else self.sector.document()}
