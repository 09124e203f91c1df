"""The columns of the linear part of a learned model, row by row as the torque is seen: law of the strips, body, odd features,
free functions.

Columns are many: a stretch of a recording is worked on at a time, with what the filter needs of the rows around it. What the wake remembers
is known from the whole.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.features.body_columns import body_columns
from nnhydro.features.feature_set import Features, View
from nnhydro.features.free_part import FreeRange, free_functions
from nnhydro.features.strip_law.law import law_columns, tiers
from nnhydro.features.strip_law.state import StripView, sets_of, strip_states
from nnhydro.models.learned.learned import swiftness
from nnhydro.physics.flow import Flow
from nnhydro.physics.memo import RecentMemo, content_of
from nnhydro.physics.motion import Base, Motion, Water, tensor
from nnhydro.recordings.filtering.filtered_rows import filtered_rows, reach
from nnhydro.recordings.segment import Segment

STRETCH = 1024  # rows at a time
_SHARED = RecentMemo(150_000_000)  # every model that is fitted to a recording needs the same columns of its motion


@final
@dataclass(frozen=True, eq=False)
class RowRange:
    """What the rows hold at most: variables of the strips, lowest and highest (k,), and the links' speed and acceleration (2 links,)."""

    lowest: Tensor
    highest: Tensor
    swiftest: Tensor  # m/s, m/s^2

    def and_of(self, other: "RowRange") -> "RowRange":
        """Return what both hold at most."""
        return RowRange(torch.minimum(self.lowest, other.lowest), torch.maximum(self.highest, other.highest),
                        torch.maximum(self.swiftest, other.swiftest))


@final
@dataclass(frozen=True, eq=False)
class Linear:
    """Columns (n, joints, p) N m of n rows, filtered as the torque is, and what the rows hold.

    The first `law_size` columns are those of the strips' law, then come the body's, both shared by the joints; then scale times odd
    features, and last the `free_size` functions of the free part.
    """

    columns: Tensor
    law_size: int
    shared: int
    free_size: int
    tiers: Tensor  # (law_size,), features/strip_law/law.py
    seen: RowRange

    def without_free(self) -> "Linear":
        """Return the columns but for the free functions'."""
        return replace(self, columns=self.columns[..., :self.columns.shape[2] - self.free_size], free_size=0)

    def and_of(self, other: "Linear") -> "Linear":
        """Return the rows of both."""
        return replace(self, columns=torch.cat([self.columns, other.columns]), seen=self.seen.and_of(other.seen))


def _stretches(flow: Flow, segment: Segment, chosen: NDArray[np.int64]) -> Iterator[tuple[Flow, NDArray[np.int64]]]:
    """The flow over a stretch, and which of its rows are among the `chosen`."""
    wake, m, halo = torch.stack(StripView(flow).wake), flow.motion, reach(segment)
    for some in np.array_split(chosen, -(-len(chosen) // STRETCH)):
        rows = slice(max(int(some[0]) - halo, 0), int(some[-1]) + halo + 1)
        yield Flow(flow.arm, replace(m, wake=wake).rows(rows)), some - rows.start


def _tensors(moving: Motion | Base | Water) -> Iterator[Tensor | None]:
    """All tensors of what moves."""
    for field in fields(moving):
        value = getattr(moving, field.name)
        if isinstance(value, Base | Water):
            yield from _tensors(value)
        elif value is None or isinstance(value, Tensor):
            yield value


def _shared_columns(flow: Flow, names: Sequence[str], segment: Segment, chosen: NDArray[np.int64]) -> Linear:
    """The columns of law and body: they are those of the motion, whatever is fitted to which recordings."""
    parts = []
    for near, some in _stretches(flow, segment, chosen):
        strips = StripView(near)
        z, of_three = strip_states(strips, names)
        body = body_columns(near)
        law = law_columns(strips, z, of_three) if names else body[..., :0]
        every, here = torch.cat([law, body], dim=2), torch.from_numpy(some)
        seen = RowRange(z[here].amin(dim=(0, 1, 3)), z[here].amax(dim=(0, 1, 3)), swiftness(near)[here].amax(dim=0))
        parts.append(Linear(tensor(filtered_rows(segment, every.numpy(), some)).float(), law.shape[2], every.shape[2], 0,
                            tiers(sets_of(strips, names), of_three, law.shape[2]), seen))
    first, *others = parts
    for other in others:
        first = first.and_of(other)
    return first


def linear_columns(view: View, x: Features, names: Sequence[str], segment: Segment, chosen: NDArray[np.int64],
                   free: FreeRange | None = None) -> Linear:
    """Return the linear part at the rows `chosen` (m,), ascending, of a segment; `names` are the sets of the strips' variables.

    `free` is the range of the free functions, None where there are none.
    """
    flow = view.flow
    moves = content_of((torch.from_numpy(chosen), *_tensors(flow.motion)))
    key = moves, flow.motion.steady, flow.arm.model_dump_json(), segment.low_pass, tuple(names)
    water = _SHARED.of(key, lambda: _shared_columns(flow, names, segment, chosen), lambda linear: 4 * linear.columns.numel())
    angles = x.odd[:, :0] if free is None else free_functions(flow, free)
    odd_columns = torch.cat([view.scale[..., None] * x.odd[:, None], angles[:, None].expand(-1, view.scale.shape[1], -1)], dim=2)
    columns = torch.cat([water.columns, tensor(filtered_rows(segment, odd_columns.numpy(), chosen)).float()], dim=2)
    return replace(water, columns=columns, free_size=angles.shape[1])
