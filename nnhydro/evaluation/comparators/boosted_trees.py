"""Gradient-boosted trees on the features of network and hybrid.

Source: Friedman (2001), Ann. Statist. 29(5), with histograms of the inputs; scikit-learn's HistGradientBoostingRegressor.
"""

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
MOST = 50_000  # rows


@comparator("boosted-trees", "gradient-boosted trees on the same features")
def boosted_trees(chosen: Sequence[Unit], arm: Arm, how: Preparation, config: TrainingConfig) -> TorqueModel:
    """Return boosted trees a joint, fitted to rows of the units `chosen`."""
    from sklearn.ensemble import HistGradientBoostingRegressor

    inputs, x, y = feature_rows(chosen, arm, config, MOST)
    fitted = [HistGradientBoostingRegressor(early_stopping=False, random_state=config.seed).fit(x, column) for column in y.T]

    def regression(rows: Array) -> tuple[Array, Array | None]:
        return np.column_stack([tree.predict(rows) for tree in fitted]), None

    return ComparatorTorque(arm, how, {}, "boosted-trees", inputs, regression)
