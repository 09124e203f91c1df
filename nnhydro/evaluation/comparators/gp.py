"""A Gaussian process on the features of network and hybrid: one length scale, white noise, a thousand rows at most (its cost is cubic).

Source: Rasmussen and Williams (2006), Gaussian Processes for Machine Learning, algorithm 2.1; scikit-learn's GaussianProcessRegressor.
"""

import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nnhydro.evaluation.comparators.comparator import ComparatorTorque, comparator, feature_rows
from nnhydro.fitting.config import TrainingConfig
from nnhydro.models.torque_model import TorqueModel
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.splitting import Unit

Array = NDArray[np.float64]
MOST = 1000  # rows
FLAT = 1e-6


@comparator("gp", "Gaussian process on the same features, a thousand rows")
def gp(chosen: Sequence[Unit], arm: Arm, how: Preparation, config: TrainingConfig) -> TorqueModel:
    """Return a Gaussian process a joint, fitted to rows of the units `chosen`."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    inputs, x, y = feature_rows(chosen, arm, config, MOST)
    centre, spread = x.mean(axis=0), x.std(axis=0)
    spread = np.where(spread > FLAT, spread, 1 / FLAT)
    z = (x - centre) / spread
    kernel = ConstantKernel(1.0) * RBF(np.sqrt(z.shape[1]), (1e-1, 1e4)) + WhiteKernel(1e-3, (1e-8, 1.0))
    fitted = []
    for column in y.T:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)  # a length scale at its bound is an answer
            fitted.append(GaussianProcessRegressor(kernel, normalize_y=True, random_state=config.seed).fit(z, column))

    def regression(rows: Array) -> tuple[Array, Array | None]:
        found = [process.predict((rows - centre) / spread, return_std=True) for process in fitted]
        return np.column_stack([mean for mean, _ in found]), np.column_stack([std for _, std in found])

    return ComparatorTorque(arm, how, {}, "gp", inputs, regression)
