"""The mechanics in a model: torques at the joints, without the faults of sensors and drives that a diagnosis may have found.

    tau_joint = (belt and gears)^-1 [ model without instruments ]            [N m]

What is kept of a model's instruments acts on the arm itself: water that flows past it, friction that grows with the load. What is left out
is listed, with the reason. Terms with a coefficient over the travel give the same torques in fewer operations, a few rows at a time.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Final, final

import torch
from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect
from nnhydro.effects.in_sector import InSector
from nnhydro.errors import ModelError
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.learned.learned import LearnedTorque
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LoadTerm
from nnhydro.physics.motion import Motion
from nnhydro.physics.transmission import joint_torque
from nnhydro.physics.travel.term import TravelTerm

MECHANICAL: Final = ("ambient_current", "load_friction")
REASONS: Final = {"wave_orbital": "its phase belongs to one recording", "joint_elasticity": "the drive is taken to be rigid",
                  "backlash": "the drive is taken to be rigid",
                  "flexible_mount": "the mount is taken to stand still", "sensor_timing": "a delay of the sensors, not of the arm"}
FOLLOWS: Final = 2e-5  # of the rms torque: run of steps against run as a whole; only Basset's force, a sum of exponentials, is not exact
SENSOR: Final = "a fault of the sensors, not of the arm"


def _mechanical(model: StripTheory, left_out: list[str], retained: Sequence[str]) -> StripTheory:
    """`model` with terms that can be stepped, without its instruments but for those `kept`; what goes is noted in `left_out`."""
    terms = {}
    for name, term in model.loads.terms.items():
        if getattr(term, "per_recording", False):
            left_out.append(f"{name}: its phase belongs to one recording")
        else:
            terms[name] = fast_stepper(term)
    instruments: list[InstrumentEffect] = []
    for instrument in model.instruments:
        if instrument.id in retained:
            instruments.append(instrument)
        else:
            left_out.append(f"{instrument.id}: {REASONS.get(instrument.id, SENSOR)}")
    return replace(model, loads=Loads(terms), instruments=tuple(instruments))


def mechanics(model: TorqueModel, left_out: list[str], retained: Sequence[str] = MECHANICAL) -> TorqueModel:
    """Return the part of `model` that is mechanics, as its sensors would read it; raises ModelError where that is not all of a torque.

    What of its instruments is not `kept` is noted in `left_out`.
    """
    if isinstance(model, StripTheory):
        return _mechanical(model, left_out, retained)
    if isinstance(model, LearnedTorque):
        return model if model.baseline is None else replace(model, baseline=mechanics(model.baseline, left_out, retained))
    if isinstance(model, CorrectedSimulation):
        if model.simulation is None:
            raise ModelError("this model is a correction of torques that were simulated elsewhere: it has no dynamics of its own; diagnose "
                             "against a baseline of ours (--baseline constant), or add it to your own simulation")
        before, after = _mechanical(model.before, [], retained), _mechanical(model.after, left_out, retained)
        return replace(model, simulation=mechanics(model.simulation, left_out, retained), before=before, after=after)
    return model


def steppable(model: TorqueModel) -> TorqueModel:
    """Return `model` with all its instruments, its terms such that they can be stepped through time."""
    if isinstance(model, StripTheory):
        return replace(model, loads=Loads({name: fast_stepper(term) for name, term in model.loads.terms.items()}))
    if isinstance(model, JointModel):
        return model
    if isinstance(model, LearnedTorque) and model.baseline is not None:
        return replace(model, baseline=steppable(model.baseline))
    if isinstance(model, CorrectedSimulation):
        before, after = steppable(model.before), steppable(model.after)
        assert isinstance(before, StripTheory)
        assert isinstance(after, StripTheory)
        return replace(model, simulation=None if model.simulation is None else steppable(model.simulation), before=before, after=after)
    return model


@final
@dataclass(frozen=True, eq=False)
class JointModel(TorqueModel):
    """The torques at the joints; `left_out` says what of the model is no mechanics. Made by `joint_model`, never stored."""

    kind: ClassVar[str] = "joint_model"
    model: TorqueModel
    left_out: tuple[str, ...]

    def torque(self, motion: Motion) -> Tensor:
        """Return the torques at the joints (n, joints) N m."""
        if isinstance(self.model, StripTheory) and not self.model.instruments:
            return self.model.loads.torque(Flow(self.arm, motion))
        return joint_torque(self.model.torque(motion), motion.qd, self.arm)

    def document(self) -> dict[str, Any]:
        """Return the model's own document."""
        return self.model.document()


def joint_model(model: TorqueModel) -> JointModel:
    """Return the mechanics of `model`; raises ModelError for a correction of a simulation outside."""
    left_out: list[str] = []
    inner = mechanics(model, left_out)
    return JointModel(model.arm, model.preparation, model.fit, inner, tuple(dict.fromkeys(left_out)))


FEW = 1024  # rows: longer runs are worked off piece by piece, by the term itself


@final
@dataclass(frozen=True)
class SteppedTravel(LoadTerm):
    """Any term with a coefficient over the travel: the curve first, then one load a strip, instead of a column for every ordinate."""

    kind: ClassVar[str] = ""
    term: TravelTerm

    def torque(self, flow: Flow) -> Tensor:
        """Return the joint torques (n, joints) N m."""
        if flow.motion.carried is None and len(flow.motion) > FEW:
            return self.term.torque(flow)
        state = self.term.state(flow)
        curves = torch.stack([self.term.curve(s, link) for link, s in enumerate(state.s_over_D.unbind(1))], dim=1)
        return state.strips.to_joints(self.term.unit_load(state, self.term.added_mass) * curves).sum(-1)


def fast_stepper(term: LoadTerm) -> LoadTerm:
    """Return `term`, or what gives the same torques faster where a few rows are asked for."""
    if isinstance(term, InSector):
        return replace(term, term=fast_stepper(term.term))
    return SteppedTravel(term) if isinstance(term, TravelTerm) else term
