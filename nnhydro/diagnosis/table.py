"""The rows that count, recording by recording: baseline columns, torque and the columns of every hypothesis, computed once and kept.

Load columns pass the belt, the gears and the comparison's filter like the baseline's own; instrument columns are taken at the reading of
the model that is believed. Rows are thinned to about two a period of the cut-off; past a size the columns are kept in a temporary file.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.diagnosis.blocks import kept_rows
from nnhydro.diagnosis.case import Case
from nnhydro.diagnosis.instances import Instance
from nnhydro.diagnosis.store import Store
from nnhydro.effects.effect import InstrumentEffect, LoadEffect, at_joint
from nnhydro.effects.sensor_view import SensorView
from nnhydro.identification.statistics import columns_and_offset
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.transmission import gear_factor, sensed, to_drives
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Piece:
    """The rows of one segment that count: baseline columns Y (n, joints, p), a standard deviation each, and the torque."""

    number: int  # of the unit
    k: int  # of the segment in its unit
    Y: Array
    y: Array  # N m, the measured torque less the baseline's before it is recalibrated
    tau: Array  # (n, joints) N m, as measured
    state: dict[str, Array]  # angles, rates, accelerations and carriage speed by their column name, each (n,)
    dt: float  # s from row to row, 0 in steady runs
    recording: str
    t: Array  # (n,) s
    place: Array | None  # (n,) -1 to 1 over the campaign


Beside = Callable[[Piece], Array]


def states(segment: Segment) -> dict[str, Array]:
    """State variables by their column name, for the region where the residual lies."""
    named: dict[str, Array] = {}
    for j in range(segment.n_links):
        named |= {f"q{j + 1}_rad": segment.q[:, j], f"dq{j + 1}_rad_s": segment.qd[:, j], f"ddq{j + 1}_rad_s2": segment.qdd[:, j]}
    if segment.u0.any():
        named["u0_m_s"] = segment.u0
    return named


def view(model: StripTheory, flow: Flow, place: Tensor | None) -> SensorView:
    """Return what instruments look at: the reading of `model` along `flow`."""
    return SensorView(flow, lambda f: sensed(model.loads.torque(f), f.motion.qd, model.arm), place)


def columns_of(instances: Sequence[Instance], model: StripTheory, segment: Segment, place: Tensor | None,
               foretold: bool = False) -> Array:
    """Return the columns (n, joints, K) of `instances` on one segment, through the same filter as the torque.

    `foretold`: without a look at the measured torque, as where it is predicted.
    """
    arm, flow = model.arm, Flow(model.arm, Motion.of(segment))
    measured = segment.tau_raw if segment.tau_raw is not None else segment.tau
    factor = gear_factor(tensor(measured if measured is not None else 0 * segment.q), flow.motion.qd, arm)[..., None]
    views: dict[int, SensorView] = {}

    def view_of(believed: StripTheory) -> SensorView:
        if id(believed) not in views:
            seen = view(believed, flow, place)
            views[id(believed)] = seen if measured is None or foretold else replace(seen, measured=tensor(measured))
        return views[id(believed)]

    def columns(one: Instance) -> Tensor:
        effect = one.effect
        if isinstance(effect, LoadEffect):
            return to_drives(effect.columns(flow), arm) * factor
        view = view_of(one.believed or model)
        own = effect.columns(view) if one.believed is None else effect.secant(view)
        ones = torch.ones(len(flow.motion), 1, dtype=torch.float64)
        return torch.cat([own, at_joint(ones, effect.joint, arm.n_links)], dim=2) if effect.offset_of_its_own else own

    if not instances:
        return np.zeros((*segment.q.shape, 0))
    return segment.seen(torch.cat([columns(one) for one in instances], dim=2).numpy())


@final
@dataclass(eq=False)
class Table:
    """Pieces of all recordings and the columns of the instances asked for so far; `foretold`: no column looks at the measured torque."""

    case: Case
    foretold: bool = False
    _columns: dict[tuple[int, int, int, int], tuple[Array | Path, slice]] = field(default_factory=dict)
    _alive: dict[int, object] = field(default_factory=dict)  # instances and models whose id is a key: kept from being reused
    _store: Store = field(default_factory=Store)

    def of(self, case: Case) -> "Table":
        """Return the table of a `case` with the same motions and baseline but other torques: the columns computed so far are shared."""
        return Table(case, self.foretold, self._columns, self._alive, self._store)

    @cached_property
    def pieces(self) -> tuple[Piece, ...]:
        """The segments with at least 8 rows that count."""
        model, before, made = self.case.model, self.case.before, []
        for number, unit in enumerate(self.case.all_units):
            for k, segment in enumerate(unit.segments()):
                rows = kept_rows(segment)
                if segment.tau is None or len(rows) < (1 if unit.steady else 8):
                    continue
                Y, c0 = columns_and_offset(model.loads, segment, model.arm)
                y = self.case.reference.to_explain(segment, Y, c0)
                dt = 0.0 if segment.steady else float(np.median(np.diff(segment.t[rows]))) if len(rows) > 1 else segment.dt
                state = {name: x[rows] for name, x in states(segment).items()}
                place = self.case.places(unit, k)
                made.append(Piece(number, k, np.nan_to_num(Y @ before.F)[rows], np.nan_to_num(y)[rows], segment.tau[rows], state, dt,
                                  unit.name, segment.t[rows], None if place is None else place.numpy()[rows]))
        return tuple(made)

    def _key(self, piece: Piece, one: Instance, believed: StripTheory) -> tuple[int, int, int, int]:
        return piece.number, piece.k, id(one), id(self._read(one, believed))

    def _read(self, one: Instance, believed: StripTheory) -> StripTheory | None:
        """The model whose reading an instrument that is not settled changes; small ones of each recording's own stay at the baseline's."""
        if one.believed is not None or not isinstance(one.effect, InstrumentEffect):
            return None
        return self.case.model if one.effect.own_in_every_recording else believed

    def compute(self, piece: Piece, instances: Sequence[Instance], believed: StripTheory) -> None:
        """Compute the columns of those `instances` that are not there yet on one piece, all in one go."""
        unit = self.case.all_units[piece.number]
        for model in {id(m): m for m in (self.case.model, believed)}.values():
            new = [one for one in instances if (self._read(one, believed) or self.case.model) is model
                   and self._key(piece, one, believed) not in self._columns]
            if not new:
                continue
            segment = unit.segments()[piece.k]
            X = columns_of(new, model, segment, self.case.places(unit, piece.k), self.foretold)
            kept = self._store.kept(np.ascontiguousarray(np.nan_to_num(X)[kept_rows(segment)]))
            ends = np.cumsum([one.width for one in new])
            for one, end in zip(new, ends.tolist(), strict=True):
                self._columns[self._key(piece, one, believed)] = (kept, slice(end - one.width, end))
                self._alive |= {id(one): one, id(model): model}

    def forget(self, instances: Sequence[Instance], believed: StripTheory) -> None:
        """Drop the columns of all but `instances`, and those of readings other than the baseline's and that of `believed`."""
        keep, models = {id(one) for one in instances}, {id(None), id(self.case.model), id(believed)}
        self._columns = {key: X for key, X in self._columns.items() if key[2] in keep and key[3] in models}
        self._store.hold([X for X, _ in self._columns.values()])

    def columns(self, piece: Piece, instances: Sequence[Instance], believed: StripTheory) -> Array:
        """Return the columns (n, joints, K) of `instances` on the rows of a piece; `believed` is what unsettled instruments read."""
        self.compute(piece, instances, believed)
        found = [self._columns[self._key(piece, one, believed)] for one in instances]
        files = {kept: np.load(kept, mmap_mode="r") for kept, _ in found if isinstance(kept, Path)}  # mapped while they are read only
        parts = [(files[kept] if isinstance(kept, Path) else kept)[..., where] for kept, where in found]
        parts = [X if one.spell is None else X * one.spell.mask(piece.recording, piece.place, piece.state)[:, None, None]
                 for one, X in zip(instances, parts, strict=True)]
        return np.concatenate(parts, axis=2) if parts else np.zeros((*piece.y.shape, 0))

    def rows(self, instances: Sequence[Instance], believed: StripTheory, beside: Beside | None = None) -> Iterator[tuple[Piece, Array]]:
        """Yield each piece with [Y Z X y] (n, joints, p + m + K + 1), one at a time; Z = beside(piece), none where it is not given."""
        for piece in self.pieces:
            Z = [] if beside is None else [beside(piece)]
            yield piece, np.concatenate([piece.Y, *Z, self.columns(piece, instances, believed), piece.y[..., None]], axis=2)
