"""What the models of a diagnosis were made from: the recordings that they have seen, and the region that these cover."""

from dataclasses import replace
from functools import partial
from typing import Any

from nnhydro.diagnosis.problem.problem import Problem
from nnhydro.models.domain import DOMAIN, domain_of
from nnhydro.models.seen import SEEN, seen_campaign
from nnhydro.models.torque_model import TorqueModel
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit


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
    """Return `model` with `record` in what it says of how it came about."""
    return replace(model, fit={**model.fit, **record})
