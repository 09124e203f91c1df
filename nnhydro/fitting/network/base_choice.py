"""Which physics a hybrid stands on where nobody says: a richer baseline than `constant` has to be the better one twice.

    error_b = sum |tau - model_b| / sum |tau|        over each half of the recordings (of few: over each), fitted to the others
    left_b  = sum_j sum |tau - model_b - linear_b|_j / s_j      over the recordings that members watch, s_j rms torque

`linear_b` is the linear part (linear_part.py) learned beside the baseline on the other recordings. A baseline that predicts recordings
well by itself may leave what is hard to learn: a curve over s/D starts anew at every reversal, and what is learned has to take that back.
`constant` is kept unless another is better by CLEAR_RATIO in both: the plainer baseline extrapolates better. Source: cross-
validation, Stone (1974); the rule is ours.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from torch import Tensor

from nnhydro.fitting.linear.normal_equations import Grams
from nnhydro.fitting.linear.several_arms import arm_of, calibrated_on, on_arm
from nnhydro.fitting.network.linear_columns import Linear
from nnhydro.fitting.network.linear_part import LinearPart, left_over, linear_part
from nnhydro.fitting.network.rows import Rows, base_rows
from nnhydro.models.baselines import baseline
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.splitting import Unit

PLAIN, RICHER = "constant", ("state",)
CLEAR_RATIO = 0.9  # of the error of the plainer baseline: a tenth is more than choosing by three motions errs by
FEWEST, HALVED = 3, 6  # motions to choose by; of fewer than HALVED a half says too little: one after the other is held out
Parts = tuple[LinearPart, LinearPart]


def _misfit(model: TorqueModel, units: Sequence[Unit]) -> float:
    """Sum of |tau - model| over the rows of `units`, each joint in units of its mean |tau|."""
    left, whole = 0.0, 0.0
    for unit in units:
        of_unit = on_arm(model, arm_of(unit, model.arm))
        for segment in unit.segments():
            assert segment.tau is not None
            modelled = segment.filter(of_unit.torque(Motion.of(segment)).numpy())
            left = left + np.abs(segment.tau - modelled)[segment.keep].sum(axis=0)
            whole = whole + np.abs(segment.tau)[segment.keep].sum(axis=0)
    return float(np.mean(left / np.maximum(whole, 1e-300)))


def baseline_choice(chosen: Sequence[Unit], arm: Arm, how: Preparation) -> tuple[str, ...]:
    """Return the names of the baselines that come into question for units `chosen` of an arm in water, the plainest first."""
    moving = [unit for unit in chosen if not unit.steady]
    groups = sorted({unit.group for unit in moving})
    if len(groups) < FEWEST:
        return (PLAIN,)
    count = 2 if len(groups) >= HALVED else len(groups)

    def error(name: str) -> float:
        """Return the misfit of the baseline `name` on groups held out, summed over folds."""
        total = 0.0
        for k in range(count):
            held_out = [unit for unit in moving if groups.index(unit.group) % count == k]
            total += _misfit(calibrated_on(baseline(name), [unit for unit in moving if unit not in held_out], arm, how), held_out)
        return total

    plain = error(PLAIN)
    return (PLAIN, *(name for name in RICHER if error(name) < CLEAR_RATIO * plain))


def on_best_base(bases: Sequence[TorqueModel | None], rows: Rows, linear: Linear, watched: Tensor, stated: int, s: Tensor,
                 chosen: Sequence[Unit], arm: Arm, grams: Grams | None = None) -> tuple[TorqueModel | None, Rows, Parts]:
    """Return the baseline beside which least remains to be learned, the rows with what it leaves as target, and their linear parts.

    `rows` are those of the first of the `bases`, `s` (joints,) N m is the rms torque. Where nobody watches, the first is kept. `grams` are
    those of the columns, where they are known.
    """
    first, *others = bases
    best = (first, rows, linear_part(rows, linear, watched, stated, first is not None, grams))
    if first is None or not others or not bool(watched[:, rows.unit].any()):
        return best
    torque, (least,) = base_rows(chosen, arm, first), left_over(rows, best[2][:1], linear.columns, watched, s)
    for other in others:
        assert other is not None
        moved = replace(rows, target=rows.target + torque - base_rows(chosen, arm, other))
        parts = linear_part(moved, linear, watched, stated, True, grams)
        left, = left_over(moved, parts[:1], linear.columns, watched, s)
        if left < CLEAR_RATIO * least:
            best, least = (other, moved, parts), left
    return best
