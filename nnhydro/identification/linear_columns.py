"""The columns of the linear part of a learned model, row by row as the torque is seen: law of the strips, body, odd features.

Columns are many: a stretch of a recording is worked on at a time, with what the filter needs of the rows around it. What the wake remembers
is known from the whole.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.features.body_columns import body_columns
from nnhydro.features.feature_set import Features, View
from nnhydro.features.strip_law import law_columns
from nnhydro.features.strip_state import StripView, strip_states
from nnhydro.identification.seen_rows import reach, seen_rows
from nnhydro.models.learned import swiftness
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import tensor
from nnhydro.recordings.segment import Segment

STRETCH = 1024  # rows at a time


@final
@dataclass(frozen=True, eq=False)
class Seen:
    """What the rows hold at most: variables of the strips, lowest and highest (k,), and the links' speed and acceleration (2 links,)."""

    lowest: Tensor
    highest: Tensor
    swiftest: Tensor  # m/s, m/s^2

    def and_of(self, other: "Seen") -> "Seen":
        """Return what both hold at most."""
        return Seen(torch.minimum(self.lowest, other.lowest), torch.maximum(self.highest, other.highest),
                    torch.maximum(self.swiftest, other.swiftest))


@final
@dataclass(frozen=True, eq=False)
class Linear:
    """Columns (n, joints, p) N m of n rows, filtered as the torque is, and what the rows hold.

    The first `law_size` columns are those of the strips' law, then come the body's, then scale times odd features.
    """

    columns: Tensor
    law_size: int
    seen: Seen

    def and_of(self, other: "Linear") -> "Linear":
        """Return the rows of both."""
        return Linear(torch.cat([self.columns, other.columns]), self.law_size, self.seen.and_of(other.seen))


def _stretches(flow: Flow, segment: Segment, chosen: NDArray[np.int64]) -> Iterator[tuple[slice, Flow, NDArray[np.int64]]]:
    """The rows of a stretch, the flow over them, and which of them are among the `chosen`."""
    wake, m, halo = torch.stack(StripView(flow).wake), flow.motion, reach(segment)
    for some in np.array_split(chosen, -(-len(chosen) // STRETCH)):
        rows = slice(max(int(some[0]) - halo, 0), int(some[-1]) + halo + 1)
        yield rows, Flow(flow.arm, replace(m, wake=wake).rows(rows)), some - rows.start


def linear_columns(view: View, x: Features, names: Sequence[str], segment: Segment, chosen: NDArray[np.int64]) -> Linear:
    """Return the linear part at the rows `chosen` (m,), ascending, of a segment; `names` are the sets of the strips' variables."""
    parts = []
    for rows, flow, some in _stretches(view.flow, segment, chosen):
        strips = StripView(flow)
        z, of_three = strip_states(strips, names)
        body = body_columns(flow)
        law = law_columns(strips, z, of_three) if names else body[..., :0]
        every = torch.cat([law, body, view.scale[rows, :, None] * x.odd[rows, None]], dim=2)
        here = torch.from_numpy(some)
        seen = Seen(z[here].amin(dim=(0, 1, 3)), z[here].amax(dim=(0, 1, 3)), swiftness(flow)[here].amax(dim=0))
        parts.append(Linear(tensor(seen_rows(segment, every.numpy(), some)).float(), law.shape[2], seen))
    first, *others = parts
    for other in others:
        first = first.and_of(other)
    return first
