"""The bank: the columns of every hypothesis on every recording, filtered, thinned and summed to Gram matrices.

Load columns pass the belt, the gears and the comparison's filter like the baseline's own; instrument columns are taken at the reading of
the model that is believed so far. One recording is held at a time.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.diagnosis.blocks import PARTS, Blocks, block_grams, kept_rows
from nnhydro.diagnosis.tournament import Candidate
from nnhydro.effects.catalogue import candidates, catalogue
from nnhydro.effects.effect import InstrumentEffect, LoadEffect
from nnhydro.effects.sensor_view import SensorView, campaign_places
from nnhydro.identification.prior import Prior
from nnhydro.identification.statistics import columns_and_offset
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.transmission import gear_factor, sensed, to_drives
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit

Array = NDArray[np.float64]
KEPT_BYTES = 400_000_000


Hypothesis = LoadEffect | InstrumentEffect
Known = tuple[tuple[Hypothesis, ...], tuple[Candidate, ...]]


@final
@dataclass(frozen=True, eq=False)
class Bank:
    """Hypotheses (one instance a candidate) and the Gram matrices of their columns."""

    effects: tuple[Hypothesis, ...]
    candidates: tuple[Candidate, ...]
    blocks: Blocks
    torque: Array  # (joints,) (N m)^2, sum of squares of the measured torque over the rows of all blocks


@final
@dataclass(frozen=True, eq=False)
class Case:
    """What is diagnosed: the recordings, the calibrated baseline with the prior of its parameters, and the hypotheses."""

    all_units: tuple[Unit, ...]
    model: StripTheory
    before: Prior
    known: Known
    places: dict[tuple[str, int], Tensor]


def torque_peaks(all_units: Iterable[Unit]) -> tuple[float, ...]:
    """Return the largest torque measured at each joint, N m."""
    peaks = [np.abs(segment.tau[segment.keep]).max(axis=0) for unit in all_units for segment in unit.segments()
             if segment.tau is not None and segment.keep.any()]
    return tuple(float(x) for x in np.max(peaks, axis=0))


def hypotheses(
    campaign: Campaign, peaks: tuple[float, ...], without: Sequence[str] = ()
) -> Known:
    """Return every instance of every effect that makes sense for the arm, and the columns that it will have in the bank."""
    instances: list[Hypothesis] = []
    listed: list[Candidate] = []
    start = 0
    for cls in catalogue().values():
        if cls.id in without or cls.own_in_every_recording:
            continue
        found = [one for one in candidates(cls, campaign.arm, peaks) if isinstance(one, LoadEffect | InstrumentEffect)]
        grid: dict[int, int] = {}
        for instance in found:
            grid[instance.joint] = grid.get(instance.joint, 0) + 1
        place: dict[int, int] = {}
        for instance in found:
            width = len(instance.linear_names())
            place[instance.joint] = place.get(instance.joint, -1) + 1
            columns = tuple(range(start, start + width))
            listed.append(Candidate(cls.id, instance.joint, place[instance.joint], grid[instance.joint], columns))
            instances.append(instance)
            start += width
    return tuple(instances), tuple(listed)


def clock_places(campaign: Campaign, all_units: Sequence[Unit]) -> dict[tuple[str, int], Tensor]:
    """Return the place in the campaign, -1 to 1, of every row of every moving segment: by the clock, else by the order of recordings."""
    keys, times, offset = [], [], 0.0
    for unit in all_units:
        if unit.steady:
            continue
        clock = campaign.load(unit.name).clock
        for number, segment in enumerate(unit.segments()):
            keys.append((unit.name, number))
            start = offset if clock is None else float(clock[segment.start_row])
            times.append(start + segment.t - segment.t[0])
        offset += campaign.load(unit.name).duration + 1.0
    return dict(zip(keys, campaign_places(times), strict=True)) if times else {}


def effect_columns(effects: Sequence[Hypothesis], model: StripTheory, segment: Segment, place: Tensor | None,
                   loads: Array | None = None) -> Array:
    """Return the columns (n, joints, K) of all hypotheses on one segment, through the same filter as the torque.

    `loads` may hold these columns from an earlier call: only those of instruments, which depend on the model, are then computed anew.
    """
    arm = model.arm
    flow = Flow(arm, Motion.of(segment))
    measured = segment.tau_raw if segment.tau_raw is not None else segment.tau
    assert measured is not None
    factor = gear_factor(tensor(measured), flow.motion.qd, arm)[..., None]
    view = SensorView(flow, lambda f: sensed(model.loads.torque(f), f.motion.qd, arm), place)
    widths = [len(effect.linear_names()) for effect in effects]
    result = np.zeros((*segment.q.shape, sum(widths))) if loads is None else loads.copy()
    new = [i for i, effect in enumerate(effects) if loads is None or isinstance(effect, InstrumentEffect)]
    if not new:
        return result
    parts = [one.columns(view) if isinstance(one, InstrumentEffect) else to_drives(one.columns(flow), arm) * factor
             for one in (effects[i] for i in new)]
    ends = np.cumsum(widths)
    where = np.concatenate([np.arange(ends[i] - widths[i], ends[i]) for i in new])
    result[..., where] = segment.seen(torch.cat(parts, dim=2).numpy())
    return result


def build(case: Case, believed: StripTheory, kept: dict[tuple[int, int], Array]) -> Bank:
    """Return the bank of the case's hypotheses; instrument effects are taken at the reading of the model `believed`.

    `kept` holds the columns of an earlier call for the same case, and is filled for a later one while it stays small.
    """
    effects, listed = case.known
    before = case.before
    grams, rows, numbers, torque = [], [], [], np.zeros(case.model.arm.n_links)
    for number, unit in enumerate(case.all_units):
        for k, segment in enumerate(unit.segments()):
            keep = kept_rows(segment)
            if segment.tau is None or len(keep) < 8:
                continue
            Y, c0 = columns_and_offset(case.model.loads, segment, case.model.arm)
            X = effect_columns(effects, believed, segment, case.places.get((unit.name, k)), kept.get((number, k)))
            if sum(x.nbytes for x in kept.values()) + X.nbytes < KEPT_BYTES:
                kept[number, k] = X
            y = segment.tau - c0 - Y @ before.mean
            table = np.concatenate([Y @ before.F, X, y[..., None]], axis=2)[keep]
            G, n = block_grams(np.nan_to_num(table), 1 if unit.steady else PARTS)
            torque += (segment.tau[keep] ** 2).sum(axis=0)
            grams.append(G)
            rows.append(n)
            numbers.append(np.full(len(n), number))
    unit_number = np.unique(np.concatenate(numbers), return_inverse=True)[1]
    return Bank(effects, listed, Blocks(np.concatenate(grams), np.concatenate(rows), unit_number, before.F.shape[1]), torque)
