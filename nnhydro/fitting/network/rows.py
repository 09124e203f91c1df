"""The rows that a network is trained on: features, scale, target, columns of the linear part, and who watches which recording."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.errors import CampaignError
from nnhydro.features.feature_set import features
from nnhydro.features.free_part import FreeRange
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.linear.several_arms import arm_of, on_arm
from nnhydro.fitting.network.kinds import of_one_kind, progress, swing
from nnhydro.fitting.network.linear_columns import Linear, linear_columns
from nnhydro.fitting.network.row_store import RowStore
from nnhydro.models.learned.learned import view_of
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit, validation_split

CHUNK = 8192  # rows worked on at a time
FLAT = 1e-6  # a feature that varies less over the campaign tells nothing and is left out by a huge spread
ROWS_PER_CUTOFF = 4.0  # rows kept a period of the cut-off: a low-passed signal holds no more


@final
@dataclass(frozen=True, eq=False)
class Rows:
    """n rows in float32: inputs x (n, k) with their parity (k,), Morison scale S and target (n, joints) N m, unit number (n,).

    `linear` (n, E, joints) is what the linear part gives for each member, in units of the scale; none: zero. `parting` (n, E, joints) N m:
    by how much a member's free part exceeds the one that the target is free of; none: there is no free part. `replaced` (n, joints + 1):
    what strip nets that have not seen a row put in place of the baseline, N m, and how far they may be used by the base's speed; none:
    there is no strip net.
    """

    x: Tensor
    parity: Tensor
    scale: Tensor
    target: Tensor
    unit: Tensor
    linear: Tensor | None = None
    parting: Tensor | None = None
    replaced: Tensor | None = None

    def target_of(self, index: Tensor, mine: Tensor) -> Tensor:
        """Return what the base leaves (m, joints) N m of the rows `index`, its free part being that of the members in `mine` (E, m)."""
        target = self.target[index].double()
        if self.parting is None:
            return target
        weight = mine.T.double()[..., None]
        return target - (self.parting[index].double() * weight).sum(dim=1) / weight.sum(dim=1)


def torque_rms(chosen: Sequence[Unit]) -> Tensor:
    """Return the rms torque (joints,) N m over the units `chosen`, in one pass."""
    squares, count = 0.0, 0
    for unit in chosen:
        for segment in unit.segments():
            assert segment.tau is not None
            squares = squares + (segment.tau[segment.keep] ** 2).sum(axis=0)
            count += int(segment.keep.sum())
    if count == 0:
        raise CampaignError("no recording holds a stretch of finite rows long enough to train on: see nnhydro check")
    return tensor(np.sqrt(np.asarray(squares) / count)) + 1e-9


def free_range(chosen: Sequence[Unit], arm: Arm) -> FreeRange:
    """Return the angles and rates that the units `chosen` span."""
    parts = [FreeRange.of(Flow(arm_of(unit, arm), Motion.of(segment))) for unit in chosen for segment in unit.segments()]
    first, *others = parts
    for other in others:
        first = first.and_of(other)
    return first


def law_of(config: TrainingConfig, arm: Arm) -> tuple[str, ...]:
    """Return the sets of variables of the strips' law, none where there is no water."""
    return () if arm.dry else config.law


def row_numbers(segment: Segment) -> NDArray[np.int64]:
    """Return the rows of a segment that are trained on: a low-passed signal holds no more."""
    stride = 1 if segment.low_pass is None else max(1, int(1 / (ROWS_PER_CUTOFF * segment.low_pass.cutoff_hz * segment.dt)))
    return np.flatnonzero(segment.keep)[::stride]


def _of_segment(segment: Segment, arm: Arm, config: TrainingConfig, floor: Tensor, base: TorqueModel | None,
                with_linear: bool, free: FreeRange | None = None) -> tuple[Rows, Linear | None]:
    motion = Motion.of(segment)
    view = view_of(arm, motion, floor)
    target = tensor(segment.tau if segment.tau is not None else 0.0)
    if base is not None:
        target = target - tensor(segment.filter(base.torque(motion).numpy()))
    chosen = row_numbers(segment)
    rows = torch.from_numpy(chosen.copy())
    x = features(view, config.features)
    found = Rows(x.matrix()[rows].float(), x.parity().float(), view.scale[rows].float(), target[rows].float(), torch.zeros(len(rows)))
    return found, linear_columns(view, x, law_of(config, arm), segment, chosen, free) if with_linear and len(rows) else None


def _store_rows(chosen: Sequence[Unit], arm: Arm, config: TrainingConfig, floor: Tensor, base: TorqueModel | None, store: RowStore,
                with_linear: bool, free: FreeRange | None = None) -> tuple[Tensor, Linear | None]:
    """Append every unit's rows to `store`; returns the parity and the last segment's linear part, with what all of them span."""
    parity, last = torch.zeros(0), None
    for number, unit in enumerate(chosen):
        unit_arm = arm_of(unit, arm)
        unit_base = None if base is None else on_arm(base, unit_arm)
        for segment in unit.segments():
            rows, linear = _of_segment(segment, unit_arm, config, floor, unit_base, with_linear, free)
            if len(rows.x):
                columns = [] if linear is None else [linear.columns]
                store.append((rows.x, rows.scale, rows.target, torch.full((len(rows.x),), number), *columns))
                parity = rows.parity
                last = linear if linear is None or last is None else replace(linear, seen=linear.seen.and_of(last.seen))
    return parity, last


def base_rows(chosen: Sequence[Unit], arm: Arm, base: TorqueModel) -> Tensor:
    """Return the torque (n, joints) N m of a baseline in the rows of the units `chosen`, as the sensor sees it, float32."""
    parts = []
    for unit in chosen:
        unit_base = on_arm(base, arm_of(unit, arm))
        for segment in unit.segments():
            seen = tensor(segment.filter(unit_base.torque(Motion.of(segment)).numpy()))
            parts.append(seen[torch.from_numpy(row_numbers(segment))].float())
    return torch.cat(parts)


def training_rows(chosen: Sequence[Unit], arm: Arm, config: TrainingConfig, floor: Tensor, base: TorqueModel | None,
                  store: RowStore | None = None) -> Rows:
    """Return the rows of the units `chosen`, kept in `store` (in memory by default); a hybrid's target is what its baseline leaves."""
    store = store or RowStore(budget=2**62)
    parity, _ = _store_rows(chosen, arm, config, floor, base, store, False)
    x, scale, target, unit = store.columns()
    return Rows(x, parity, scale, target, unit)


def rows_and_linear(chosen: Sequence[Unit], arm: Arm, config: TrainingConfig, floor: Tensor, base: TorqueModel | None,
                    store: RowStore, free: FreeRange | None = None) -> tuple[Rows, Linear]:
    """Return the rows as `training_rows` does, and the columns of their linear part."""
    parity, last = _store_rows(chosen, arm, config, floor, base, store, True, free)
    x, scale, target, unit, columns = store.columns()
    assert last is not None
    return Rows(x, parity, scale, target, unit), replace(last, columns=columns)


def standardise(rows: Rows) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Give the inputs of `rows` zero mean and unit spread, in place and in pieces; returns centre, spread, lowest, highest (k,) float64.

    Odd features keep their zero, and the range (lowest, highest) of the standardised inputs holds the mirror images too.
    """
    odd, n = rows.parity < 0, len(rows.x)
    pieces = [slice(i, i + CHUNK) for i in range(0, n, CHUNK)]
    centre = torch.where(odd, 0.0, sum((rows.x[p].double().sum(dim=0) for p in pieces), start=torch.zeros(len(odd)).double()) / n)
    square = sum(((rows.x[p].double() - centre).pow(2).sum(dim=0) for p in pieces), start=torch.zeros(len(odd)).double())
    spread = (square / n).sqrt()
    spread = torch.where(spread > FLAT, spread, torch.full_like(spread, 1 / FLAT))
    lowest, highest = torch.full_like(centre, torch.inf), torch.full_like(centre, -torch.inf)
    for p in pieces:
        x = (rows.x[p].double() - centre) / spread
        lowest, highest = torch.minimum(lowest, x.amin(dim=0)), torch.maximum(highest, x.amax(dim=0))
        rows.x[p] = x.float()
    reach = torch.maximum(-lowest, highest)
    return centre, spread, torch.where(odd, -reach, lowest), torch.where(odd, reach, highest)


def watched_units(chosen: Sequence[Unit], config: TrainingConfig, arm: Arm | None = None) -> Tensor:
    """Return (members, units) bool: which units each member watches for early stopping instead of training on them.

    Without an `arm` they are drawn at random. With one, a hybrid's members in turn watch a block of the units ordered by how their motions
    swing, and by how far they get (kinds.py), from the first to the last: with shares that are large enough every unit is watched twice.
    Every other member of a network, which has nothing to fade to, watches units drawn at random.
    """
    watched = torch.zeros(config.members, len(chosen), dtype=torch.bool)
    share, even = config.watched_share, swing if config.model == "hybrid" else None
    for member in range(config.members):
        order = progress if member % 2 else even
        if arm is None or order is None:
            _, watch = validation_split(range(len(chosen)), chosen, share, config.seed + member)
        else:
            last = (config.members - 1 - member % 2) // 2
            watch = of_one_kind(chosen, arm, share, member // 2 / max(last, 1), order)
        watched[member, list(watch)] = True
    return watched
