"""Known motions as loggers record them: angles alone with noise or steps, or rates and accelerations that come late."""

from dataclasses import replace

import numpy as np
from campaigns import multi_sine

from nnhydro.recordings.recording import Recording

STEP = 0.01  # s


def run_at(t, seed=1, step=0.0):
    """Angles alone at the times t, read by an encoder of that step."""
    q, qd, qdd = multi_sine(t, 2, seed)
    if step:
        q = np.round(q / step) * step
    return Recording("run", t, q, np.zeros_like(q)), qd, qdd


def noisy_run(noise, seed=1):
    """Ten seconds of angles with white noise."""
    r, _, _ = run_at(np.arange(0, 10, 0.005), seed)
    return replace(r, q=r.q + noise * np.random.default_rng(seed).standard_normal(r.q.shape))


def recorded(late=0.0, later=0.0, noise=(0.0, 0.0, 0.0), seed=5, seconds=8.0):
    """A motion of sines whose rates lag the angles by `late` s and accelerations by `later` s, with noise."""
    t = np.arange(round(seconds / STEP)) * STEP
    rng = np.random.default_rng(seed)
    exact = [multi_sine(t - lag, 2, seed)[k] for k, lag in enumerate((0.0, late, later))]
    q, qd, qdd = (x + s * rng.standard_normal(x.shape) for x, s in zip(exact, noise, strict=True))
    return Recording(f"run{seed}", t, q, np.zeros_like(q), qd, qdd)
