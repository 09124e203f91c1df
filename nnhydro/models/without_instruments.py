"""A model for a controller: what the drives must supply, without what the rig's torque sensors add to it.

Faults of the torque sensors (offset, drift, scale, crosstalk, clipping) and of the timing between channels say what was read, not what the
arm needs. An angle that is read with an offset stays: the controller's angles come from the same encoder.
"""

from dataclasses import replace

from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.learned.learned import LearnedTorque
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel

SENSORS = ("torque_sensor", "timing")  # families of effects (effects/*.py) that are no part of the arm


def _parts(model: TorqueModel) -> list[StripTheory]:
    """Every sum of terms inside a model."""
    if isinstance(model, StripTheory):
        return [model]
    if isinstance(model, CorrectedSimulation):
        return [model.before, model.after, *([] if model.simulation is None else _parts(model.simulation))]
    if isinstance(model, LearnedTorque) and model.baseline is not None:
        return _parts(model.baseline)
    return []


def sensor_faults(model: TorqueModel) -> tuple[str, ...]:
    """Return the ids of the sensors' faults that are part of `model`."""
    return tuple(dict.fromkeys(instrument.id for part in _parts(model) for instrument in part.instruments if instrument.family in SENSORS))


def without_instruments(model: TorqueModel) -> TorqueModel:
    """Return `model` without the faults of its rig's torque sensors; as it is where it holds none."""
    if isinstance(model, StripTheory):
        return replace(model, instruments=tuple(instrument for instrument in model.instruments if instrument.family not in SENSORS))
    if isinstance(model, CorrectedSimulation):
        before, after = (replace(part, instruments=tuple(instrument for instrument in part.instruments if instrument.family not in SENSORS))
                         for part in (model.before, model.after))
        inner = None if model.simulation is None else without_instruments(model.simulation)
        return replace(model, simulation=inner, before=before, after=after)
    if isinstance(model, LearnedTorque) and model.baseline is not None:
        return replace(model, baseline=without_instruments(model.baseline))
    return model
