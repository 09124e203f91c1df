"""Runs of a two-link arm under a controller."""

from typing import Any

import numpy as np
from rigs import arm

from nnhydro.physics.load_sum import Loads
from nnhydro.simulation.controller import Controller
from nnhydro.simulation.forward import run_controlled
from nnhydro.simulation.motions.motion_kind import Setting, TimedMotion, motion_of
from nnhydro.simulation.plant import Plant
from nnhydro.simulation.run import Run

SLEW = {"kind": "slew", "name": "m", "q_rad": [[0.0, 0.2], [0.8, -0.5]], "duration_s": 0.8, "rest_s": 0.0}
RATE, HOLD = 100.0, 1


def run(loads: Loads, folder=None, motion: dict[str, Any] = SLEW, rate: float = RATE, **settings: Any) -> Run:
    """The run of `loads` along `motion` under a controller of these `settings`."""
    of = arm(2)
    made = motion_of(motion, "recipe")
    assert isinstance(made, TimedMotion)
    reference = made.reference(Setting(of, np.random.default_rng(0), None))
    law = Controller(**settings).torque_law(of, rate / HOLD, folder)
    return run_controlled({"m": reference}, Plant(of, loads), law, rate, HOLD)[0]
