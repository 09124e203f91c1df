"""Predicted torques of one motion."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import TIME, column, joint_text
from nnhydro.models import prediction
from nnhydro.models.prediction import write_prediction
from nnhydro.sheet import Column, ResultView, Sheet

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
SHOWN = 5  # rows in text


@final
@dataclass(frozen=True, eq=False, repr=False)
class Prediction(ResultView):
    """Sensor torques `tau` (n, joints) N m at the times `t` (n,) s; `std` is their standard deviation where the model knows it."""

    name: str
    t: Array
    tau: Array
    std: Array | None
    sliding: bool = False
    outside: Array | None = None  # (n,) 0 to 1, how far each row lies outside what the model was trained on
    cutoff_hz: float | None = None  # at which the motion was smoothed; None: it was taken as given
    notes: tuple[str, ...] = ()  # where the torques are less certain, and why

    @staticmethod
    def of(found: prediction.PredictedTorque) -> "Prediction":
        """Return what the model computed, ready to be shown."""
        return Prediction(found.name, found.t, found.tau, found.std, found.sliding, found.outside, found.cutoff_hz, found.notes)

    def __len__(self) -> int:
        return len(self.t)

    def verdict(self) -> str:
        """Return the range of each torque in one sentence."""
        ranges = ", ".join(f"joint {j} {low:.3g} to {high:.3g} N m" for j, (low, high) in
                           enumerate(zip(self.tau.min(axis=0), self.tau.max(axis=0), strict=True), 1))
        return joint_text(f"{self.name}, {len(self)} rows: {ranges}.", self.sliding)

    def _sheet(self, rows: int | None) -> Sheet:
        """Torques row by row, of the first `rows` where given, with standard deviations and shares outside the training where known."""
        joints = range(self.tau.shape[1])
        columns = [Column(TIME, self.t[:rows].tolist(), "{:.6g}"),
                   *(Column(column("tau", j + 1, self.sliding), self.tau[:rows, j].tolist(), "{:.5g}") for j in joints)]
        if self.std is not None:
            columns += [Column(column("tau_std", j + 1, self.sliding), self.std[:rows, j].tolist(), "{:.3g}") for j in joints]
        if self.outside is not None:
            columns.append(Column("outside", self.outside[:rows].tolist(), "{:.2g}"))
        return Sheet("" if rows is None else f"first {min(rows, len(self))} rows", tuple(columns))

    def sheets(self) -> tuple[Sheet, ...]:
        """Return the first rows."""
        return (self._sheet(SHOWN),)

    def to_frame(self) -> "pd.DataFrame":
        """Return all rows as a data frame with the columns of the CSV that `nnhydro predict` writes."""
        return self._sheet(None).frame()

    def save(self, path: str | Path) -> Path:
        """Write the torques to the CSV file `path`, whole or not at all; returns the path."""
        found = prediction.PredictedTorque(self.name, self.t, self.tau, self.std, self.sliding, self.outside, self.cutoff_hz, self.notes)
        return write_prediction(found, Path(path))
