"""Instruments about other values than none, from which the search starts, too."""

from collections.abc import Sequence
from dataclasses import replace

from nnhydro.diagnosis.problem.hypothesis import Hypothesis
from nnhydro.diagnosis.problem.problem import Problem
from nnhydro.effects.effect import InstrumentEffect
from nnhydro.effects.sensor_view import SensorView
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.physics.transmission import sensor_torque


def extra_starts(hypotheses: Sequence[Hypothesis], problem: Problem, model: StripTheory) -> tuple[Hypothesis, ...]:
    """Return hypotheses linearised about the values from which an instrument's card wants to be tried, too, on the longest stretch."""
    moving = [s for s in problem.stretches if not s.segment.steady]
    if not moving:
        return ()
    longest = max(moving, key=lambda stretch: len(stretch.segment))
    flow = Flow(model.arm, Motion.of(longest.segment))
    view = SensorView(flow, lambda f: sensor_torque(model.loads.torque(f), f.motion.qd, model.arm))
    return tuple(replace(h, effect=start, working_model=model, rough=True) for h in hypotheses if isinstance(h.effect, InstrumentEffect)
                 for start in h.effect.extra_starts(view))
