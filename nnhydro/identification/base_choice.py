"""Which physics a hybrid stands on where none is named: the baseline that predicts the other half of the recordings best.

    error_b = sum |tau - model_b| / sum |tau|   over each half of the recordings, fitted to the other half

`constant` unless another is better by CLEARLY: the plainer baseline extrapolates better. Source: cross-validation, Stone (1974); the rule
is ours.
"""

from collections.abc import Sequence

import numpy as np

from nnhydro.identification.several_arms import arm_of, calibrated_on, on_arm
from nnhydro.models.baselines import baseline
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.preprocessing import Preparation
from nnhydro.recordings.splitting import Unit

PLAIN, RICHER = "constant", ("state",)
CLEARLY = 0.9
FEWEST = 6  # motions: of fewer, a half says too little


def _left(model: TorqueModel, units: Sequence[Unit]) -> float:
    """Sum of |tau - model| over the rows of `units`, each joint in units of its mean |tau|."""
    left, whole = 0.0, 0.0
    for unit in units:
        own = on_arm(model, arm_of(unit, model.arm))
        for segment in unit.segments():
            assert segment.tau is not None
            modelled = segment.seen(own.torque(Motion.of(segment)).numpy())
            left = left + np.abs(segment.tau - modelled)[segment.keep].sum(axis=0)
            whole = whole + np.abs(segment.tau)[segment.keep].sum(axis=0)
    return float(np.mean(left / np.maximum(whole, 1e-300)))


def baseline_choice(chosen: Sequence[Unit], arm: Arm, how: Preparation) -> str:
    """Return the name of the baseline for a hybrid on the units `chosen` of an arm in water."""
    moving = [unit for unit in chosen if not unit.steady]
    groups = sorted({unit.group for unit in moving})
    if len(groups) < FEWEST:
        return PLAIN
    halves = [[unit for unit in moving if groups.index(unit.group) % 2 == k] for k in (0, 1)]

    def error(name: str) -> float:
        return sum(_left(calibrated_on(baseline(name), halves[k], arm, how), halves[1 - k]) for k in (0, 1))

    found = {name: error(name) for name in (PLAIN, *RICHER)}
    best = min(found, key=lambda name: found[name])
    return best if found[best] < CLEARLY * found[PLAIN] else PLAIN
