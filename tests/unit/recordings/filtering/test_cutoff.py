"""The cut-off that the data choose."""

import numpy as np
from filtered_motions import noisy_run, run_at

from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation, plan, prepare


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
