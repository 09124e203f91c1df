"""A plain multilayer perceptron on raw states q, qd, qdd, u0, du0: what a network makes of the torque without any physics.

Source: scikit-learn's MLPRegressor (Adam, ReLU) on standardised inputs and outputs.
"""

import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nnhydro.evaluation.comparators.comparator import ComparatorTorque, comparator, raw_rows, raw_states
from nnhydro.fitting.config import TrainingConfig
from nnhydro.models.torque_model import TorqueModel
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.splitting import Unit

Array = NDArray[np.float64]
MOST = 50_000  # rows
EPOCHS = 100


@comparator("mlp-raw", "multilayer perceptron on raw states q, qd, qdd, u0, du0")
def mlp_raw(chosen: Sequence[Unit], arm: Arm, how: Preparation, config: TrainingConfig) -> TorqueModel:
    """Return a perceptron for all joints, fitted to rows of the units `chosen`."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.neural_network import MLPRegressor

    x, tau = raw_rows(chosen, arm, config, MOST)
    centre, spread, size = x.mean(axis=0), x.std(axis=0) + 1e-9, tau.std(axis=0) + 1e-9
    made = MLPRegressor(hidden_layer_sizes=config.hidden, early_stopping=True, max_iter=EPOCHS, random_state=config.seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # so many epochs and no more
        made.fit((x - centre) / spread, (tau / size) if tau.shape[1] > 1 else (tau / size).ravel())

    def regression(rows: Array) -> tuple[Array, Array | None]:
        return made.predict((rows - centre) / spread).reshape(len(rows), -1) * size, None

    return ComparatorTorque(arm, how, {}, "mlp-raw", raw_states, regression)
