"""Write predicted torques as the contract's CSV."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import TIME, column
from nnhydro.errors import ConfigError
from nnhydro.files import write_text
from nnhydro.models.prediction import Prediction


def write_prediction(prediction: Prediction, path: Path, more: dict[str, NDArray[np.float64]] | None = None) -> Path:
    """Write t_s, tau1_Nm, ... (tau1_std_Nm, ... where known) and `more` columns to `path`, whole or not at all; times keep every digit."""
    joints = range(1, prediction.tau.shape[1] + 1)
    names = [TIME, *(column("tau", j) for j in joints)]
    values = [prediction.t, *prediction.tau.T]
    if prediction.std is not None:
        names += [column("tau_std", j) for j in joints]
        values += [*prediction.std.T]
    names += [*(more or {})]
    values += [*(more or {}).values()]
    rows = (",".join([repr(float(row[0])), *(f"{x:.9g}" for x in row[1:])]) for row in np.column_stack(values))
    try:
        write_text(path, "\n".join([",".join(names), *rows]) + "\n")
    except OSError as cause:
        raise ConfigError(f"{path}: cannot be written ({cause.strerror or cause}): name a folder that you may write to") from cause
    return path
