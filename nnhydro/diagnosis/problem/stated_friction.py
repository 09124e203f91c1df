"""How the dry friction that arm.yaml states builds up: a data sheet gives its level, and says nothing of contacts that bend.

    tau_j = T_C,j z_j,   dz_j/dt = (sign(qd_j) - z_j) |qd_j| / z_0           z_0 by the likelihood of what the recalibrated baseline leaves:
    sum_j n / 2 log(S_j(0) / S_j(z_0)),   S_j its sum of squares at joint j in n rows                                                 [nats]

Without it, friction of the stated size would be found missing, and the stated one superfluous, wherever a joint comes to rest.
"""

from dataclasses import replace

import numpy as np

from nnhydro.diagnosis.constants import LEAST_GAIN
from nnhydro.diagnosis.problem.baseline import Baseline, baseline_of
from nnhydro.diagnosis.problem.design import Design, design_of
from nnhydro.diagnosis.problem.problem import Problem
from nnhydro.effects.dry_contact import DryContact
from nnhydro.models.stated_terms import STATED_COULOMB
from nnhydro.physics.load_sum import Loads
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation

NEAR = 0.05  # of ln z_0: the distance over which a contact bends is found to 5 %


def _bend(base: Baseline, angle: float) -> Baseline:
    """The baseline whose stated contacts bend over `angle` rad before they slip."""
    terms = dict(base.physics.loads.terms)
    terms[STATED_COULOMB] = replace(terms[STATED_COULOMB], bending_rad=angle)  # type: ignore[call-arg]
    return replace(base, physics=replace(base.physics, loads=Loads(terms)))


def design_on(problem: Problem, baseline: str | None) -> Design:
    """Return the rows of `problem` against the baseline by name or from a file, its stated contacts bent as is most likely."""
    moving = any(not stretch.segment.steady for stretch in problem.stretches)
    how = Preparation(LowPass(problem.edge) if moving else None)
    base = baseline_of(baseline, problem.arm, problem.units(), how)
    return _bend_stated_contacts(base, design_of(problem, base))


def _bend_stated_contacts(base: Baseline, first: Design) -> Design:
    """The design whose stated contacts bend over the most likely angle; `first`, in which they are rigid, where that is as likely."""
    from scipy.optimize import minimize_scalar

    if first.undriven or STATED_COULOMB not in base.physics.loads.terms:
        return first
    tried: dict[float, tuple[float, Design]] = {}

    def gain(angle: float) -> float:
        """Return the nats that contacts gain which bend over `angle` rad."""
        if angle not in tried:
            design = design_of(first.problem, _bend(base, angle))
            left = [np.maximum((one.excess**2).sum(axis=0), 1e-300) for one in (first, design)]
            tried[angle] = float(len(first.y) / 2 * np.log(left[0] / left[1]).sum()), design
        return tried[angle][0]

    angles = sorted(DryContact.details()["bending"])
    best = int(np.argmax([gain(angle) for angle in angles]))
    low, high = (float(np.log(angles[min(max(at, 0), len(angles) - 1)])) for at in (best - 1, best + 1))
    minimize_scalar(lambda x: -gain(float(np.exp(x))), bounds=(low, high), method="bounded", options={"xatol": NEAR})
    most, design = max(tried.values(), key=lambda pair: pair[0])
    return design if most > LEAST_GAIN else first
