"""The baseline with every finding as one more term or as a fault of the instruments: every claim is in the model."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.findings.finding import Finding
from nnhydro.diagnosis.problem.baseline import Baseline
from nnhydro.diagnosis.problem.hypothesis import AnyEffect
from nnhydro.diagnosis.problem.problem import Problem
from nnhydro.effects.effect import InstrumentEffect, LoadEffect
from nnhydro.effects.in_sector import InSector, ReadInSector
from nnhydro.fitting.identify import versions
from nnhydro.models.domain import DOMAIN, domain_of
from nnhydro.models.seen import SEEN, seen_campaign
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LoadTerm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit

Array = NDArray[np.float64]


def _term(effect: LoadEffect, finding: Finding) -> LoadTerm:
    """The effect as a term, which acts in a sector only where that was found."""
    sector = None if finding.activity is None else finding.activity.sector
    return effect if sector is None else InSector(sector.joint, sector.low, sector.high, effect)


def _instrument(effect: InstrumentEffect, finding: Finding) -> InstrumentEffect:
    sector = None if finding.activity is None else finding.activity.sector
    return effect if sector is None else ReadInSector(sector.low, sector.high, effect, joint=sector.joint)


def _term_name(effect: LoadEffect, loads: Loads) -> str:
    """The finding's id and joint; distinct from a term of the baseline with the same name."""
    name = f"{effect.id}_{effect.joint}" if effect.joint else effect.id
    while name in loads.terms:
        name = f"found_{name}"
    return name


def _for_prediction(finding: Finding) -> AnyEffect:
    return finding.law.for_prediction(finding.offset) if isinstance(finding.law, InstrumentEffect) else finding.law


def corrected_model(baseline: Baseline, z_before: Array, z_after: Array, found: Sequence[Finding]) -> TorqueModel:
    """Return the baseline, recalibrated to `z_after` (r,) beside the findings, with every finding in it.

    It omits what cannot be predicted: the phase in the next recording, and when a gap is crossed, are unknown. It also omits effects that
    have ended.
    """
    before = baseline.at(z_before)
    after = baseline.at(z_after)
    loads, instruments = after.loads, []
    for finding in found:
        if not (finding.predicted and finding.persists):
            continue
        effect = _for_prediction(finding)
        if isinstance(effect, LoadEffect):
            loads = loads.plus(_term_name(effect, loads), _term(effect, finding))
        else:
            instruments.append(_instrument(effect, finding))
    record = {"kind": "corrected model of a diagnosis", "findings": [finding.statement for finding in found], "versions": versions()}
    model = StripTheory(before.arm, before.preparation, record, f"{baseline.name} corrected", loads, tuple(instruments))
    if baseline.is_physics:
        return model
    from nnhydro.models.corrected_simulation import CorrectedSimulation

    plain = StripTheory(before.arm, before.preparation, {}, baseline.name,
                        baseline.physics.loads.with_linear(baseline.prior.mean))
    return CorrectedSimulation(model.arm, model.preparation, model.fit, baseline.simulated, plain, model)


def _units(problem: Problem) -> tuple[Unit, ...]:
    """Every recording with all its stretches, and every steady table."""
    parts: dict[int, list[Segment]] = {}
    for stretch in problem.stretches:
        parts.setdefault(stretch.group, []).append(stretch.segment)
    return tuple(Unit(found[0].recording, found[0].recording, found[0].steady, partial(tuple, found)) for found in parts.values())


def trained_on(campaign: Campaign, problem: Problem, known: TorqueModel) -> dict[str, Any]:
    """Return what a model's record says that was made from `problem`: what it has seen, the model `known` included, and its domain."""
    domain = domain_of(_units(problem), problem.arm)
    return {SEEN: seen_campaign(campaign, known, names=problem.names), DOMAIN: None if domain is None else domain.document()}


def with_record(model: TorqueModel, record: dict[str, Any]) -> TorqueModel:
    """Return `model` with `record` added to the description of its fit."""
    return replace(model, fit={**model.fit, **record})
