"""The law of a finding as the recordings show it: its torque with 95 % interval, and what the rest of the model leaves for it.

    law       x      = tau(model) - tau(model without the finding)                                       (n,) N m
    rest      y      = measured - tau(model without the finding), the partial residual                   (n,) N m
    interval  1.96 s,  s^2 = sum_k (x(v + sqrt(lambda_k) e_k) - x(v))^2,   lambda_k, e_k of the covariance of the values v

Parameters that are not linear stay at their values; what the others lose by that is part of their covariance. All are means over bins of
the state variable that the effect's card names first.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.conventions import Z95
from nnhydro.diagnosis.findings.finding import Finding
from nnhydro.effects.effect import InstrumentEffect, LoadEffect
from nnhydro.effects.in_sector import InSector, ReadInSector
from nnhydro.evaluation.model_errors import model_torque
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LoadTerm
from nnhydro.physics.motion import Motion
from nnhydro.report.widgets.residual_map import STATES
from nnhydro.report.widgets.trace import Trace, bin_edges

Array = NDArray[np.float64]
BINS = 25
FEWEST = 5  # rows in a bin that is shown


@final
@dataclass(frozen=True, eq=False)
class DrawnLaw:
    """Torque of a finding at one joint (from 1) over bins of what drives it."""

    joint: int
    driver: str
    rows: Array  # (m, 2) driver and partial residual of single rows
    x: Array  # (bins,) mean of the driver
    rest: Array  # (bins,) N m, mean of the partial residual
    law: Array  # (bins,) N m
    half: Array  # (bins,) N m, half of the 95 % interval of `law`


def _physics(corrected: TorqueModel) -> StripTheory | None:
    """The part of a corrected model that holds the findings."""
    inner = corrected.after if isinstance(corrected, CorrectedSimulation) else corrected
    return inner if isinstance(inner, StripTheory) else None


def _with(model: StripTheory, old: LoadEffect | InstrumentEffect, new: LoadEffect | InstrumentEffect | None) -> StripTheory:
    """The model with `new`, or nothing, in the place of `old`."""
    terms: dict[str, LoadTerm] = {}
    for name, term in model.loads.terms.items():
        if isinstance(term, InSector) and term.term is old:
            terms |= {} if not isinstance(new, LoadEffect) else {name: replace(term, term=new)}
        elif term is not old:
            terms[name] = term
        elif isinstance(new, LoadEffect):
            terms[name] = new
    instruments: list[InstrumentEffect] = []
    for instrument in model.instruments:
        if isinstance(instrument, ReadInSector) and instrument.effect is old:
            instruments += [replace(instrument, effect=new)] if isinstance(new, InstrumentEffect) else []
        elif instrument is not old:
            instruments.append(instrument)
        elif isinstance(new, InstrumentEffect):
            instruments.append(new)
    return replace(model, loads=Loads(terms), instruments=tuple(instruments))


def _perturbations(effect: LoadEffect | InstrumentEffect, covariance: Array) -> Iterator[LoadEffect | InstrumentEffect]:
    """The effect one standard deviation away, along each principal direction of the covariance of its linear values."""
    size, direction = np.linalg.eigh(covariance)
    for k in range(len(size)):
        if size[k] > 0:
            yield effect.with_linear(effect.linear_values() + torch.from_numpy(np.sqrt(size[k]) * direction[:, k]))


def driver(effect: LoadEffect | InstrumentEffect, joint: int, traces: Sequence[Trace], model: StripTheory) -> tuple[str, Array]:
    """Return label and values of the first of `depends_on` that rows have: state, torque of the model, or the order of the rows."""
    j, links = joint - 1, model.arm.n_links

    def over(name: str, of: int) -> Array:
        return np.concatenate([getattr(trace.segment, name)[trace.segment.keep, of] for trace in traces])

    for word in effect.signature.depends_on:
        if word in STATES:
            return STATES[word].format(joint), over(word, j)
        if word in ("tau", "tau of the other joint") and (word == "tau" or links == 2):
            of = j if word == "tau" else 1 - j
            return f"measured torque of joint {of + 1} [N m]", np.concatenate([trace.tau[trace.segment.keep, of] for trace in traces])
        if word in ("w", "dw"):
            flows = [Flow(model.arm, Motion.of(trace.segment)) for trace in traces]
            speed = [(flow.A * flow.L / 2 + flow.B if word == "w" else flow.M * flow.L / 2 + flow.N).numpy()[trace.segment.keep, j]
                     for flow, trace in zip(flows, traces, strict=True)]
            what, unit = ("speed", "m/s") if word == "w" else ("acceleration", "m/s²")
            return f"normal {what} of link {joint} at its middle [{unit}]", np.concatenate(speed)
    return "rows in the order of the recordings", np.arange(sum(int(trace.segment.keep.sum()) for trace in traces), dtype=float)


def _active_rows(finding: Finding, traces: Sequence[Trace]) -> NDArray[np.bool_]:
    """Which compared rows lie wholly in the part of the campaign in which the finding acts."""
    window, parts = finding.activity, []
    for trace in traces:
        rows = trace.segment.keep
        parts.append(np.ones(int(rows.sum()), dtype=bool) if window is None else window.mask(trace.segment)[rows] > 0)
    return np.concatenate(parts)


def law_of(finding: Finding, corrected: TorqueModel, traces: Sequence[Trace], name: str) -> DrawnLaw | None:
    """Return the law of `finding` on the compared rows of `traces`, whose model `name` is `corrected`.

    None if it is not a law of the state: a phase per recording, or a drift with the time of day.
    """
    model, effect = _physics(corrected), finding.law
    if model is None or effect.per_recording or not traces:
        return None

    def torque(of: StripTheory) -> Array:
        return np.concatenate([model_torque(of, trace.segment)[trace.segment.keep] for trace in traces])

    rows = _active_rows(finding, traces)
    full = torque(model)
    law = full - torque(_with(model, effect, None))
    if not law[rows].any():
        return None
    joint = effect.joint or 1 + int(np.argmax((law**2).sum(axis=0)))
    moved = [torque(_with(model, effect, variant))[:, joint - 1] - full[:, joint - 1]
             for variant in _perturbations(effect, finding.covariance)]
    rest = np.concatenate([trace.residual(name)[trace.segment.keep, joint - 1] for trace in traces]) + law[:, joint - 1]
    label, x = driver(effect, joint, traces, model)
    found = _bin(joint, label, x[rows], rest[rows], law[rows, joint - 1], [change[rows] for change in moved])
    return found if len(found.x) else None  # nothing that drives it ever changed


def _bin(joint: int, label: str, x: Array, rest: Array, law: Array, moved: Sequence[Array]) -> DrawnLaw:
    """The law of a finding at one joint: means over bins of its driver, of what is left for it and of what it says."""
    edges = bin_edges(x, BINS, 0.002)
    order = np.argsort(x, kind="stable")
    bounds = np.searchsorted(x[order], edges)
    bins = [order[a:b] for a, b in pairwise(bounds) if b - a >= FEWEST]

    def means(y: Array) -> Array:
        return np.array([y[rows].mean() for rows in bins])

    half = Z95 * np.sqrt(sum((means(change) ** 2 for change in moved), start=np.zeros(len(bins))))
    return DrawnLaw(joint, label, np.column_stack([x, rest]), means(x), means(rest), means(law), half)
