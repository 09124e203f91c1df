"""Columns of hypotheses and of doubtful accelerations on the rows of one stretch.

Load columns pass belt and gears like the baseline's own; instrument columns are taken at the reading of the working model.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.diagnosis.problem.baseline import Baseline
from nnhydro.diagnosis.problem.hypothesis import AnyEffect, Hypothesis
from nnhydro.diagnosis.problem.problem import Stretch
from nnhydro.effects.effect import InstrumentEffect, LoadEffect, at_joint
from nnhydro.effects.sensor_view import SensorView
from nnhydro.fitting.linear.statistics import columns_and_offset
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.transmission import gear_factor, to_drives
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
AT_ONCE = 16  # flows of which the torque is computed in one pass: more save no time


def columns_on(hypotheses: Sequence[Hypothesis], model: StripTheory, stretch: Stretch, predicted: bool = False) -> Array:
    """Return the columns (n, joints, K) of `hypotheses` on one stretch, instruments at the reading of `model`.

    `predicted`: without a look at the measured torque.
    """
    segment, arm = stretch.segment, model.arm
    flow = stretch.memo.of(("flow", id(arm)), lambda: Flow(arm, Motion.of(segment))).again()  # its memo goes with this call
    measured = None if predicted else segment.tau
    factor = gear_factor(tensor(measured if measured is not None else 0 * segment.q), flow.motion.qd, arm)[..., None]
    geared = bool((factor != 1).any())
    place = None if stretch.place is None else tensor(stretch.place)

    def view_of(working: StripTheory) -> SensorView:
        """Return what the sensors see of the stretch where `working` is the truth, made once a model."""
        _, view = stretch.memo.of((id(working), predicted), lambda: (working, SensorView.of(  # kept, so that no other has its id
            working.loads, flow.again(), place, None if measured is None else tensor(measured))))
        return view

    def columns(number: int, hypothesis: Hypothesis, effect: AnyEffect) -> Tensor:
        """Return the columns (n, joints, width) of a hypothesis: loads through the drives, instruments at their working model."""
        if isinstance(effect, LoadEffect):
            made = to_drives(effect.columns(flow), arm)
            made = made * factor if geared else made
        else:
            view = view_of(hypothesis.working_model or model)
            made = (effect.columns(view) if hypothesis.working_model is None else
                    effect.rough_secant(view) if hypothesis.rough else effect.secant(view, readings.get(number)))
            if effect.random_intercept:
                made = torch.cat([made, at_joint(torch.ones(len(flow.motion), 1, dtype=torch.float64), effect.joint, arm.n_links)], dim=2)
        return made if hypothesis.activity is None else made * tensor(hypothesis.activity.mask(segment))[:, None, None]

    effects = [hypothesis.effect_in(stretch.group) for hypothesis in hypotheses]
    _prepare(flow, [effect for effect in effects if isinstance(effect, LoadEffect)])
    readings = _readings({number: (effect, view_of(hypothesis.working_model))
                          for number, (hypothesis, effect) in enumerate(zip(hypotheses, effects, strict=True))
                          if isinstance(effect, InstrumentEffect) and hypothesis.working_model is not None and not hypothesis.rough})
    made, start = np.empty((sum(hypothesis.width for hypothesis in hypotheses), *segment.q.shape[::-1])).T, 0  # a column lies side by side
    for number, (hypothesis, effect) in enumerate(zip(hypotheses, effects, strict=True)):
        made[..., start:start + hypothesis.width] = columns(number, hypothesis, effect).numpy()
        start += hypothesis.width
    return made if np.isfinite(made).all() else np.nan_to_num(made, copy=False)


def _readings(effects: Mapping[int, tuple[InstrumentEffect, SensorView]]) -> dict[int, Tensor]:
    """The reading (n, joints) N m with each of `effects`, by number: those of one view that move the flow alone in one pass."""
    made = dict[int, Tensor]()
    for view in dict.fromkeys(view for _, view in effects.values()):
        moved = {number: effect.moved_flow(view) for number, (effect, its) in effects.items() if its is view}
        alone = {number: how for number, how in moved.items() if how is not None}
        for some in (list(alone)[i:i + AT_ONCE] for i in range(0, len(alone), AT_ONCE)):
            torques = view.torques_of([alone[number][0] for number in some])
            made |= {number: torque + alone[number][1] for number, torque in zip(some, torques, strict=True)}
    return made


def _prepare(flow: Flow, loads: Sequence[LoadEffect]) -> None:
    """Let the laws of each kind among `loads` compute on `flow` what they can together."""
    alike: dict[type[LoadEffect], list[LoadEffect]] = {}
    for effect in loads:
        alike.setdefault(type(effect), []).append(effect)
    for kind, effects in alike.items():
        kind.prepare([flow], effects)


def disagreement(base: Baseline, segment: Segment, torque: Array, count: int) -> Array:
    """Return how the baseline's `torque` (n, joints) changes where one joint accelerates as some channels say, (n, joints, count) N m.

    Where an acceleration and the slope of a rate differ by more than their noise, either may be right.
    """
    made = np.zeros((*torque.shape, count))
    for i, (other, j) in enumerate(product(() if segment.other_qdd is None else segment.other_qdd, range(torque.shape[1]))):
        qdd = segment.qdd.copy()
        qdd[:, j] = other[:, j]
        Y, c0 = columns_and_offset(base.physics.loads, replace(segment, qdd=qdd), base.physics.arm)
        made[..., i] = c0 + Y @ base.prior.mean - torque
    return made
