"""The cut-off that the data choose."""

import numpy as np
from filtered_motions import noisy_run, run_at

from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation, plan, prepare
from nnhydro.recordings.recording import Recording


def test_the_chosen_cutoff_rises_as_the_noise_falls_and_never_exceeds_25_hz():
    chosen = [plan(iter([noisy_run(noise)])).low_pass.cutoff_hz for noise in (1e-2, 1e-3, 1e-4, 1e-6)]
    assert chosen == sorted(chosen)
    assert chosen[0] < 0.7 * chosen[2]
    assert 1.0 <= chosen[0] <= chosen[-1] <= 25.0


def test_the_chosen_cutoff_is_near_the_best_one():
    r, errors = noisy_run(1e-4), {}
    _, _, qdd = run_at(np.arange(0, 10, 0.005))
    chosen = plan(iter([r])).low_pass.cutoff_hz
    for cutoff in (chosen, *np.geomspace(1, 25, 15)):
        (segment,) = prepare(r, Preparation(LowPass(float(cutoff))))
        errors[float(cutoff)] = float(((segment.filter(segment.qdd) - qdd)[400:-400] ** 2).mean() ** 0.5)
    assert errors[chosen] < 0.01 * (qdd**2).mean() ** 0.5
    assert errors[chosen] < 4 * min(errors.values())


def test_the_noise_of_a_joint_at_rest_takes_nothing_from_a_predicted_motion():
    """A slew of 0.6 s, the other joint held: by the joints' own errors the noise of the held joint chooses the lowest cut-off."""
    t = np.arange(0.0, 4.0, 0.01)
    s = np.clip((t - 1.7) / 0.6, 0.0, 1.0)
    slew, qdd = s**3 * (10 - 15 * s + 6 * s**2), (60 * s - 180 * s**2 + 120 * s**3) / 0.6**2
    q = np.stack([slew, np.zeros_like(t)], axis=1) + 2e-5 * np.random.default_rng(1).standard_normal((len(t), 2))
    r = Recording("slew", t, q)
    kept = {}
    for predicted in (False, True):
        (segment,) = prepare(r, plan(iter([r]), predicted=predicted), with_torque=False)
        kept[predicted] = 1 - np.sqrt(np.mean((segment.qdd[:, 0] - qdd) ** 2) / np.mean(qdd**2))
    assert kept[True] > 0.9
    assert kept[True] > kept[False]
