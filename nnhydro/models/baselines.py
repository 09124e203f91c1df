"""The analytic baselines by name, as the contract defines them; what arm.yaml states of friction and drives is part of each."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

from nnhydro.errors import ConfigError, ModelError
from nnhydro.models.stated_terms import with_stated
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.travel.state_model import state_loads
from nnhydro.recordings.arm import Arm
from nnhydro.runtime.registry import choices


@final
@dataclass(frozen=True)
class NamedBaseline:
    """A named starting sum of terms and whether its parameters are fitted to the campaign."""

    name: str
    meaning: str
    start: Callable[[Arm], Loads]
    calibrated: bool


def _dry(arm: Arm) -> Loads:
    return with_stated(Loads({"rigid_body": RigidBody.of_arm(arm)}), arm)


def _water(arm: Arm, C_D: float, C_M: float | None) -> Loads:
    loads = Loads({"rigid_body": RigidBody.of_arm(arm), "normal_drag": NormalDrag((C_D,) * arm.n_links)})
    return with_stated(loads if C_M is None else loads.plus("added_mass", AddedMass((C_M,) * arm.n_links)), arm)


BASELINES = {baseline.name: baseline for baseline in (
    NamedBaseline("rigid", "the dry arm: no water", _dry, calibrated=True),
    NamedBaseline("textbook", "strip theory with Cd = 1.2, Cm = 1", lambda arm: _water(arm, 1.2, 1.0), calibrated=False),
    NamedBaseline("drag-only", "strip theory with Cd = 1.1, no added mass", lambda arm: _water(arm, 1.1, None), calibrated=False),
    NamedBaseline("constant", "strip theory with one fitted Cd and Cm per link", lambda arm: _water(arm, 1.1, 0.8), calibrated=True),
    NamedBaseline("state", "strip theory with fitted Cd(s/D), Cm(s/D): McLain & Rock's state-dependent model",
             lambda arm: with_stated(state_loads(arm), arm), calibrated=True),
)}


def baseline(name: str) -> NamedBaseline:
    """Return the baseline called `name`; raises ConfigError listing the names."""
    if name not in BASELINES:
        raise ConfigError(f"unknown physics model {name!r}: {choices(name, BASELINES)}")
    return BASELINES[name]


def physics_model(model: TorqueModel, lacks: str) -> StripTheory:
    """Return `model` itself if it is a physics model; raises ModelError, with what others lack and the command that fits one, if not."""
    if isinstance(model, StripTheory):
        return model
    name = getattr(getattr(model, "baseline", None), "name", "")
    raise ModelError(f"a {getattr(model, 'name', model.kind)} has no {lacks}, a physics model has: fit one to the same recordings, "
                     f"nnhydro identify CAMPAIGN --model {name if name in BASELINES else 'constant'} --out PHYSICS, and export PHYSICS")
