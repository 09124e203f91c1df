"""A model as a file for a controller: ONNX, C or CasADi, with all that it remembers."""

from pathlib import Path
from typing import Any

from nnhydro.deployment.c_header import export_c
from nnhydro.deployment.casadi_step import export_casadi
from nnhydro.deployment.onnx.onnx_file import export_onnx
from nnhydro.deployment.step import without_instruments
from nnhydro.models.domain import DOMAIN, Domain
from nnhydro.models.torque_model import TorqueModel


def without_inputs(model: TorqueModel) -> tuple[str, ...]:
    """Return a line on what moved in the recordings of `model` and is no input of a step; none where nothing did, or none is known."""
    domain = Domain.parse(model.fit.get(DOMAIN))
    if domain is None or not domain.surroundings:
        return ()
    return (f"{', '.join(domain.surroundings)}: the model's recordings hold this, a step has no input for it: its torques are those of a "
            "base that moves along +Y alone, in water at rest; nnhydro predict takes all of it, nnhydro.Dynamics(...) base=",)


def export_step(model: TorqueModel, out: Path, kind: str, precision: str = "double", digest: str = "",
                bare: bool = False) -> dict[str, Any]:
    """Write one step of `model` to `out`; `kind` is onnx, c or casadi, `bare` leaves out faults of sensors and drives.

    Returns what it is told of, with `left_out`: what the file lacks of the model. Raises ModelError where the model cannot be stepped,
    ConfigError for another precision or a place that cannot be written to, MissingExtraError without the library onnx or casadi.
    """
    made, faults = without_instruments(model) if bare else (model, ())
    left_out = [*faults, *without_inputs(model)]
    if kind == "c":
        written = export_c(made, out, precision, digest, [f"left out: {line}" for line in left_out])
    elif kind == "casadi":
        written = export_casadi(made, out)
    else:
        written = export_onnx(made, out, precision, digest, left_out)
    return written | {"left_out": left_out}
