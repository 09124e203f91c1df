"""How the dry friction that arm.yaml states builds up: a data sheet gives its level, and says nothing of contacts that bend.

    tau_j = T_C,j z_j,   dz_j/dt = (sign(qd_j) - z_j) |qd_j| / z_0           z_0 by the likelihood of what the recalibrated baseline leaves:
    sum_j n / 2 log(S_j(0) / S_j(z_0)),   S_j its sum of squares at joint j in n rows                                                 [nats]

Without it, friction of the stated size would be found missing, and the stated one superfluous, wherever a joint comes to rest.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import LEAST_GAIN
from nnhydro.diagnosis.problem.baseline import Baseline, baseline_of
from nnhydro.diagnosis.problem.design import Design, design_of
from nnhydro.diagnosis.problem.problem import Problem
from nnhydro.effects.dry_contact import DryContact
from nnhydro.fitting.linear.statistics import columns_and_offset
from nnhydro.models.stated_terms import STATED_COULOMB
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation

Array = NDArray[np.float64]
NEAR = 0.05  # of ln z_0: the distance over which a contact bends is found to 5 %


def _bend(loads: Loads, angle: float) -> Loads:
    """The loads whose stated contacts bend over `angle` rad before they slip."""
    term = loads.terms[STATED_COULOMB]
    assert isinstance(term, CoulombTerm)
    return Loads({**loads.terms, STATED_COULOMB: replace(term, bending_rad=angle)})


def design_on(problem: Problem, baseline: str | None) -> Design:
    """Return the rows of `problem` against the baseline by name or from a file, its stated contacts bent as is most likely."""
    moving = any(not stretch.segment.steady for stretch in problem.stretches)
    how = Preparation(LowPass(problem.edge) if moving else None)
    base = baseline_of(baseline, problem.arm, problem.units(), how)
    return _bend_stated_contacts(base, design_of(problem, base))


def _bend_stated_contacts(base: Baseline, first: Design) -> Design:
    """The design whose stated contacts bend over the most likely angle; `first`, in which they are rigid, where that is as likely."""
    from scipy.optimize import minimize_scalar

    loads, arm = base.physics.loads, first.problem.arm
    if first.undriven or STATED_COULOMB not in loads.terms:
        return first
    levels = [i for i, (name, *_) in enumerate(loads.linear_parameters()) if name == STATED_COULOMB]
    level, F = base.prior.mean[levels], first.baseline.prior.F[levels]

    def columns(angle: float) -> Array:
        """Return the columns of the levels (n, joints, joints) where contacts bend over `angle` rad."""
        friction = Loads({STATED_COULOMB: _bend(loads, angle).terms[STATED_COULOMB]})
        return first.rows(lambda stretch: columns_and_offset(friction, stretch.segment, arm)[0])

    rigid, before = columns(0.0), (first.excess**2).sum(axis=0)
    tried: dict[float, float] = {}

    def gain(angle: float) -> float:
        """Return the nats that contacts gain which bend over `angle` rad."""
        more = columns(angle) - rigid
        after = (replace(first, Y=first.Y + more @ F, y=first.y - more @ level).excess ** 2).sum(axis=0)
        tried[angle] = float(len(first.y) / 2 * np.log(np.maximum(before, 1e-300) / np.maximum(after, 1e-300)).sum())
        return tried[angle]

    angles = sorted(DryContact.details()["bending"])
    best = int(np.argmax([gain(angle) for angle in angles]))
    low, high = (float(np.log(angles[min(max(at, 0), len(angles) - 1)])) for at in (best - 1, best + 1))
    minimize_scalar(lambda x: -gain(float(np.exp(x))), bounds=(low, high), method="bounded", options={"xatol": NEAR})
    angle = max(tried, key=lambda angle: tried[angle])
    if tried[angle] <= LEAST_GAIN:
        return first
    return design_of(first.problem, replace(base, physics=replace(base.physics, loads=_bend(loads, angle))))
