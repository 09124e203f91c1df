"""A model as a file for a controller: ONNX, C or CasADi, with all that it remembers."""

from pathlib import Path
from typing import Any

from nnhydro.deployment.c_header import export_c
from nnhydro.deployment.casadi_step import export_casadi
from nnhydro.deployment.onnx.onnx_file import export_onnx
from nnhydro.deployment.step import without_instruments
from nnhydro.models.torque_model import TorqueModel


def export_step(model: TorqueModel, out: Path, kind: str, precision: str = "double", digest: str = "",
                bare: bool = False) -> dict[str, Any]:
    """Write one step of `model` to `out`; `kind` is onnx, c or casadi, `bare` leaves out faults of sensors and drives.

    Returns what it is told of. Raises ModelError where the model cannot be stepped, ConfigError for another precision or a place that
    cannot be written to, MissingExtraError without the library onnx or casadi.
    """
    made, left_out = without_instruments(model) if bare else (model, ())
    if kind == "c":
        written = export_c(made, out, precision, digest, [f"left out: {line}" for line in left_out])
    elif kind == "casadi":
        written = export_casadi(made, out)
    else:
        written = export_onnx(made, out, precision, digest)
    return written | {"left_out": list(left_out)} if bare else written
