"""Write predicted torques as the contract's CSV."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import TIME, column
from nnhydro.models.prediction import Prediction
from nnhydro.runtime.files import write_own


def write_prediction(prediction: Prediction, path: Path, inputs: Iterable[Path] = (),
                     more: dict[str, NDArray[np.float64]] | None = None) -> Path:
    """Write t_s, tau1_Nm, ... (tau1_std_Nm, ... and outside where known) and `more` to `path`, whole or not at all; times keep every digit.

    Raises ConfigError where `path` is one of the `inputs` or another file that nnhydro did not write.
    """
    joints = range(1, prediction.tau.shape[1] + 1)
    names = [TIME, *(column("tau", j, prediction.sliding) for j in joints)]
    values = [prediction.t, *prediction.tau.T]
    if prediction.std is not None:
        names += [column("tau_std", j, prediction.sliding) for j in joints]
        values += [*prediction.std.T]
    if prediction.outside is not None:
        names.append("outside")
        values.append(prediction.outside)
    names += [*(more or {})]
    values += [*(more or {}).values()]
    rows = (",".join([repr(float(row[0])), *(f"{x:.9g}" for x in row[1:])]) for row in np.column_stack(values))
    return write_own(path, "\n".join([",".join(names), *rows]) + "\n", inputs)
