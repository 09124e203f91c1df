"""Angles of an encoder that begins again after a turn: the joint goes on, its reading jumps by a whole turn.

    |q_{k+1} - q_k| within `NEAR` of a turn (2 pi rad, or 360 where the column holds degrees), every other step far smaller

Where most steps are a turn, nothing begins again: the shaft was read once a turn.
"""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Array, Reading, rows
from nnhydro.recordings.readers.map_line import mapping_text

NEAR = 0.1  # of the turn
OTHERS = 0.3  # of the turn: no other step may be as large
TURNS = ((2 * np.pi, "2 pi"), (360.0, "360"))


def wraps(q: Array, turn: float) -> list[int]:
    """Return the rows of `q` (n,) after which it jumps by a `turn`; none where other steps are large too."""
    step = np.abs(np.diff(q))
    jumps = np.abs(step - turn) < NEAR * turn
    few = 2 * jumps.sum() < len(jumps)
    return [int(row) for row in np.flatnonzero(jumps)] if few and step[~jumps].max(initial=0.0) < OTHERS * turn else []


def wrapped_rows(reading: Reading, joint: int, turn: float) -> list[int]:
    """Return the rows of a recording at which the angle of `joint` (from 0) has jumped by a `turn`."""
    q = reading.recording.q[:, joint]
    return [start + row + 1 for start, stop in reading.stretches for row in wraps(q[start:stop], turn)]


@check
class WrappedAngles(RecordingCheck):
    """Angles go on beyond a turn."""

    id = "wrapped"
    looks_for = "angles that jump by a whole turn between two rows"
    remedy = "the reading begins again after a turn: map it with its period"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding a joint."""
        for joint in range(reading.arm.n_links if not reading.arm.sliding else 0):
            name = reading.arm.column("q", joint + 1)
            for turn, said in TURNS:
                found = wrapped_rows(reading, joint, turn)
                if found:
                    more = f" and {len(found) - 1} more" if len(found) > 1 else ""
                    yield Oddity(reading.name, "error", f"{name}, {rows(found[0])}{more}", f"jumps by a turn ({said})",
                                 f"{self.remedy}, {mapping_text(reading.recording.origin, name, period=turn)} "
                                 "(360 where the file holds degrees)")
