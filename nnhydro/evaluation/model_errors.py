"""The errors of one model on recordings, through the same filter as the measurement, and how its intervals cover them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nnhydro.evaluation.interval_coverage import Coverage
from nnhydro.evaluation.metrics import Misfit
from nnhydro.fitting.linear.several_arms import arm_of, on_arm
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.memo import RecentMemo
from nnhydro.physics.motion import Motion
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit

Array = NDArray[np.float64]
_RECENT = RecentMemo(3_000_000)  # bytes: what a benchmark has judged it draws


def _torque_and_std(model: TorqueModel, segment: Segment) -> tuple[Array, Array | None]:
    """The model's torque (n, joints) N m on a segment, through the same filter as the measured one, and its standard deviation."""
    def compute() -> tuple[Array, Array | None]:
        """Return both."""
        tau, std = model.torque_and_std(Motion.of(segment))
        return segment.filter(tau.numpy()), None if std is None else std.numpy()

    return _RECENT.of((model, segment), compute, lambda both: 2 * both[0].nbytes)


def model_torque(model: TorqueModel, segment: Segment) -> Array:
    """Return the model's torque (n, joints) N m on a segment, through the same filter as the measured one."""
    return _torque_and_std(model, segment)[0]


def misfit_and_coverage(model: TorqueModel, unit: Unit) -> tuple[Misfit | None, Coverage | None]:
    """Return the misfit of `model` on the compared rows of `unit`, None where it has none, and how its intervals cover them.

    The coverage is None where the model knows no standard deviation.
    """
    model = on_arm(model, arm_of(unit, model.arm))
    misfits, covered = [], []
    for segment in unit.segments():
        if segment.tau is None or not segment.keep.any():
            continue
        keep, measured = segment.keep, segment.tau[segment.keep]
        found, std = _torque_and_std(model, segment)
        misfits.append(Misfit.of(measured, found[keep]))
        covered += [] if std is None else [Coverage.of(measured, found[keep], std[keep])]
    return Misfit.total(misfits) if misfits else None, total_coverage(covered)


def misfit_of(model: TorqueModel, unit: Unit) -> Misfit | None:
    """Return the misfit of `model` on the compared rows of `unit`; None where it has none."""
    return misfit_and_coverage(model, unit)[0]


def coverage_of(model: TorqueModel, chosen: Sequence[Unit]) -> Coverage | None:
    """Return how the intervals of `model` cover the compared rows of the units `chosen`; None where it knows no std."""
    return total_coverage([coverage for unit in chosen if (coverage := misfit_and_coverage(model, unit)[1]) is not None])


def total_coverage(parts: Sequence[Coverage]) -> Coverage | None:
    """Return the coverage of all `parts` together; None where there are none."""
    return sum(parts[1:], start=parts[0]) if parts else None
