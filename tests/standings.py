"""Benchmarks written by hand: models with known errors on three recordings, held out in two folds."""

import numpy as np
from campaigns import GIVEN

from nnhydro.evaluation.benchmark_result import BenchmarkResult, Standing
from nnhydro.evaluation.metrics import Misfit
from nnhydro.evaluation.protocols.protocol import Fold, Split
from nnhydro.fitting.config import TrainingConfig
from nnhydro.recordings.splitting import Unit

SPLIT = Split(tuple(Unit(name, name, False, tuple) for name in "abc"), (Fold("first", (1, 2), (0,)), Fold("second", (0,), (1, 2))))


def misfit(error):
    """A torque of 1 N m that is missed by `error`."""
    return Misfit.of(np.ones((4, 1)), np.full((4, 1), 1 - error))


def standing(name, *errors):
    """A model with one error a unit, in two folds."""
    a, b, c = (misfit(error) for error in (errors * 3)[:3])
    return Standing(name, [{"a": a}, {"b": b, "c": c}], 1.0)


def benchmark_of(campaigns=(), protocol="p", split=SPLIT, floor=None, **errors):
    """A benchmark of models with one error each, or with one per unit."""
    standings = {name: standing(name, *np.atleast_1d(e).tolist()) for name, e in errors.items()}
    return BenchmarkResult(campaigns, GIVEN, protocol, split, standings, floor, 0, TrainingConfig())
