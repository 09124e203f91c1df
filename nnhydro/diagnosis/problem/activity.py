"""When and where a hypothesis acts: in some recordings, from or until a time of the campaign, or in a sector of a joint's angle."""

from dataclasses import dataclass
from math import comb, log
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.effects.in_sector import within
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
BINS = 8  # bins of a joint's angle


@final
@dataclass(frozen=True)
class Sector:
    """Angles of `joint` (from 1) from `low` to `high`, rad."""

    joint: int
    low: float
    high: float


@final
@dataclass(frozen=True)
class ActivityWindow:
    """The recordings (by name), or the sector of angles, in which an effect acts; it persists where it acts in the last recording."""

    recordings: tuple[str, ...] = ()
    sector: Sector | None = None
    since: bool = False  # consecutive recordings up to the last one
    until: bool = False  # consecutive recordings from the first one

    @property
    def persists(self) -> bool:
        """Whether the effect is known to act in what is recorded next."""
        return self.sector is not None or self.since

    def log_alternatives(self, recordings: int) -> float:
        """Return the log number of parts of this kind in a campaign of `recordings`, of which each is as probable.

            sectors  BINS (BINS + 1) / 2,    parts with an end in time  2 (G - 1),    m of G recordings  G binom(G, m)
        """
        if self.sector is not None:
            return log(BINS * (BINS + 1) / 2)
        if self.since or self.until:
            return log(2 * max(recordings - 1, 1))
        return log(recordings * comb(recordings, len(self.recordings)))

    def mask(self, segment: Segment) -> Array:
        """Return 1 where the effect acts on the rows of `segment`, else 0, (n,)."""
        if self.sector is not None:
            q = segment.q[:, self.sector.joint - 1]
            return np.asarray(within(q, self.sector.low, self.sector.high)).astype(float)
        return np.full(len(segment), float(segment.recording in self.recordings))

    def sentence(self) -> str:
        """Return when or where, in words."""
        if self.sector is not None:
            return f"while joint {self.sector.joint} lies between {self.sector.low:.2f} and {self.sector.high:.2f} rad"
        if self.since:
            return f"from recording {self.recordings[0]} on"
        if self.until:
            return f"until recording {self.recordings[-1]}"
        return f"in the recordings {', '.join(self.recordings)}"

    def document(self) -> dict[str, Any]:
        """Return the window for diagnosis.json."""
        sector = None if self.sector is None else {"joint": self.sector.joint, "q_rad": [self.sector.low, self.sector.high]}
        return {"sentence": self.sentence(), "recordings": list(self.recordings), "sector": sector}
