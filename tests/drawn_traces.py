"""Traces of a true and of a poor model, and a joint that rubs with the finding of that."""

from dataclasses import replace

import numpy as np
import torch
from campaigns import GIVEN, campaign, planted
from rigs import arm

from nnhydro.diagnosis.findings.finding import Finding
from nnhydro.effects.catalogue import candidates, catalogue
from nnhydro.models.strip_theory import StripTheory
from nnhydro.report.widgets.trace import traces_of


def poor_and_whole():
    """A campaign, its true model and one with half the drag."""
    a = arm()
    c = campaign(a, planted(a), count=3)
    whole = StripTheory(a, GIVEN, {}, "whole", planted(a))
    return c, whole, StripTheory(a, GIVEN, {}, "poor", planted(a, C_D=(0.45, 0.65)))


def all_traces(c, **models):
    """All recordings of a campaign, with the torques of these models."""
    return [t for name in c.names for t in traces_of(name, c.segments(name, GIVEN), models)]


def rubbing(level=0.3, std=0.01):
    """A campaign whose second joint rubs, the model with that, the model without, and the finding."""
    a = arm()
    without = StripTheory(a, GIVEN, {}, "constant", planted(a))
    effect = candidates(catalogue()["coulomb_friction"], a)[1].with_linear(torch.tensor([level], dtype=torch.float64))
    true = replace(without, loads=without.loads.plus("coulomb_friction_2", effect))
    c = campaign(a, true.loads, count=3)
    rest = dict.fromkeys(("family", "equivalence_set", "confidence", "parameters", "rivals"))
    return c, without, true, Finding(law=effect, statement="Joint 2 rubs.", number=0, covariance=np.array([[std**2]]), **rest)
