"""Slews whose acceleration jumps, logged at 1 kHz: corners are no mismatch, and of channels that disagree either may be right."""

import numpy as np
import pytest
from campaigns import planted, sensor_torque
from rigs import arm

from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.design import design_of
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.recording import Recording

ARM, EDGE, DT, EARLY = arm(1), 5.0, 1e-3, 0.005  # Hz, s, s
NOISE = (1e-4, 1e-3, 1e-2)


def slews(seed, torque_early=0.0, measured_early=0.0):
    """Slews to and fro of one joint, the acceleration a square wave; torque and measured acceleration may lead the angle by some time."""
    rng = np.random.default_rng(seed)
    edges = 0.4 + np.cumsum(rng.uniform(0.25, 0.5, 9))
    level = 6.0 * np.array([0, 1, -1, 0, -1, 1, 0, 1, -1, 0])
    t = np.arange(round((edges[-1] + 0.4) / DT)) * DT

    jump = np.diff(level)

    def states(shift):
        since = np.maximum(t[:, None] + shift - edges, 0.0)
        return tuple(x[:, None] for x in (since**2 / 2 @ jump, since @ jump, level[np.searchsorted(edges, t + shift)]))

    exact, shown = states(0.0), states(measured_early)
    zero = tensor(np.zeros(len(t)))
    q, qd, qdd = (tensor(x) for x in (*exact[:2], states(torque_early)[2]))
    tau = sensor_torque(ARM, planted(ARM), Motion(tensor(t), q, qd, qdd, zero, zero))
    q, qd, qdd = (x + s * rng.standard_normal(x.shape) for x, s in zip((*exact[:2], shown[2]), NOISE, strict=True))
    return Recording(f"slew{seed}", t, q, tau, qd, qdd)


def left(recordings, disagree=True):
    """What the baseline at its best leaves of the torque (shares of its rms), with or without the columns of channels that disagree."""
    problem = problem_of(Campaign.of(ARM, recordings), edge=EDGE)
    how = Preparation(LowPass(EDGE))
    design = design_of(problem, baseline_of("constant", ARM, problem.units(), how))
    Y = design.Y[:, 0] if disagree else design.Y[:, 0, :-2 * ARM.n_links]
    remains = design.y[:, 0] - Y @ np.linalg.lstsq(Y, design.y[:, 0])[0]
    return float(np.sqrt((remains**2).sum() / (design.tau**2).sum()))


def test_steps_of_the_acceleration_are_followed_to_a_thousandth_of_the_torque_at_1_khz():
    assert left([slews(seed) for seed in range(4)]) < 1e-3


@pytest.mark.parametrize(("torque_early", "measured_early"), [(EARLY, EARLY), (0.0, EARLY)])
def test_where_a_measured_acceleration_leads_the_rate_the_torque_may_follow_either(torque_early, measured_early):
    recordings = [slews(seed, torque_early, measured_early) for seed in range(4)]
    assert left(recordings) < 0.5 * left(recordings, disagree=False)


def test_a_torque_that_leads_all_channels_is_still_a_mismatch():
    recordings = [slews(seed, torque_early=EARLY) for seed in range(4)]
    assert left(recordings) > 0.9 * left(recordings, disagree=False) > 0.01
