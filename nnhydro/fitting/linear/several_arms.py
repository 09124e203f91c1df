"""Recordings of several arms together: coefficients of the water are shared, each arm keeps its own stated masses.

    tau_a = rigid_a + X_a theta + e,     theta common to all arms a

A coefficient is dimensionless, so one fitted on some arms can be tried on another; masses cannot. Source: ours.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import CampaignError, require
from nnhydro.fitting.identify import calibrate, start_terms
from nnhydro.fitting.linear.least_squares import fit
from nnhydro.fitting.linear.prior import prior
from nnhydro.fitting.linear.statistics import Statistics, block, columns_and_offset, total
from nnhydro.models.baselines import NamedBaseline
from nnhydro.models.learned.learned import LearnedTorque
from nnhydro.models.seen import SEEN, seen_record
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit

Array = NDArray[np.float64]


def arm_of(unit: Unit, arm: Arm) -> Arm:
    """Return the arm that `unit` was recorded on: its own, else `arm`, the campaign's."""
    return arm if unit.arm is None else unit.arm


def of_several_arms(chosen: Sequence[Unit]) -> bool:
    """Return True where the units carry arms of their own, so that masses cannot be shared."""
    return any(unit.arm is not None for unit in chosen)


def loads_on(loads: Loads, arm: Arm) -> Loads:
    """Return `loads` with the rigid body that `arm` states; everything else is kept."""
    return Loads({name: RigidBody.of_arm(arm) if isinstance(term, RigidBody) else term for name, term in loads.terms.items()})


def on_arm(model: TorqueModel, arm: Arm) -> TorqueModel:
    """Return `model` for another arm of as many links: coefficients and weights kept, masses and sizes those of `arm`.

    Raises CampaignError where the arms have different numbers of joints.
    """
    if arm == model.arm:
        return model
    require(arm.n_links == model.arm.n_links, f"{arm.name}: has {arm.n_links} joint(s), the arm of the model has {model.arm.n_links}: "
            "only arms with equally many joints can share a model", CampaignError)
    if isinstance(model, StripTheory):
        return replace(model, arm=arm, loads=loads_on(model.loads, arm))
    if isinstance(model, LearnedTorque):
        return replace(model, arm=arm, baseline=None if model.baseline is None else on_arm(model.baseline, arm))
    return replace(model, arm=arm)


def _statistics(loads: Loads, segment: Segment, arm: Arm) -> Statistics:
    """Sums of one segment with the rigid body as a known torque."""
    X, c0 = columns_and_offset(loads_on(loads, arm), segment, arm)
    mine, known, start = [], c0, 0
    for term in loads_on(loads, arm).linear().values():
        values = term.linear_values().numpy()
        part = slice(start, start + len(values))
        if isinstance(term, RigidBody):
            known = known + X[..., part] @ values
        else:
            mine.append(X[..., part])
        start += len(values)
    columns = np.concatenate(mine, axis=2) if mine else np.zeros((*known.shape, 0))
    assert segment.tau is not None
    return block(columns[segment.keep], (segment.tau - known)[segment.keep])


def fit_shared(loads: Loads, chosen: Sequence[Unit], arm: Arm) -> Loads:
    """Return `loads` with the coefficients fitted to units of several arms, and the rigid body of `arm`.

    Raises CampaignError where no recording holds rows to fit.
    """
    water = Loads({name: term for name, term in loads.terms.items() if not isinstance(term, RigidBody)})
    if not water.linear():
        return loads_on(loads, arm)
    blocks = [_statistics(loads, segment, arm_of(unit, arm)) for unit in chosen for segment in unit.segments()]
    require(bool(blocks), "no recording holds a stretch of finite rows long enough to fit: see nnhydro check", CampaignError)
    theta = fit(total(blocks), prior(water, arm), np.ones(arm.n_links)).theta
    return Loads({**loads_on(loads, arm).terms, **water.with_linear(theta).terms})


def calibrated_on(chosen_baseline: NamedBaseline, chosen: Sequence[Unit], arm: Arm, how: Preparation) -> StripTheory:
    """Return the baseline fitted to units of one arm, masses within what is known of them, or of several, coefficients alone.

    A travel scale is searched on the recordings of the first arm.
    """
    if not of_several_arms(chosen):
        return calibrate(chosen_baseline, chosen, arm, how)
    first = arm_of(chosen[0], arm)
    loads = start_terms(chosen_baseline, [unit for unit in chosen if arm_of(unit, arm) == first], first)
    return StripTheory(arm, how, {SEEN: seen_record(chosen if chosen_baseline.calibrated else ())}, chosen_baseline.name,
                       fit_shared(loads, chosen, arm) if chosen_baseline.calibrated else loads_on(loads, arm))
