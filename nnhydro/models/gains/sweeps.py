"""Effective damping and inertia of every joint against its speed and against the last joint's angle, model beside baseline and textbook.

    damping of joint j    d tau_j / d qd_j          [N m s/rad]
    inertia of joint j    d tau_j / d qdd_j         [kg m^2], the link's own included; the dry arm's alone is shown beside it

One joint moves, the others are locked, the carriage runs at a constant speed, every state has lasted long (models/gains/matrix.py).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any, final

import torch
from torch import Tensor

from nnhydro.errors import count_text, require
from nnhydro.models.baselines import BASELINES
from nnhydro.models.gains.matrix import INPUTS, UNITS, Gains, gain_matrix
from nnhydro.models.learned.learned import LearnedTorque
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion, tensor

SCHEMA = "nnhydro/gains/1"
POINTS = 81  # of a sweep: both directions, rest in the middle


@final
@dataclass(frozen=True)
class Around:
    """Where the sweeps are made: greatest joint speed [rad/s], carriage speed [m/s], posture [rad], one angle a joint."""

    speed_rad_s: float = 2.0
    tow_m_s: float = 0.0
    posture_rad: tuple[float, ...] = ()


@final
@dataclass(frozen=True, eq=False)
class Sweep:
    """Gains of several models along one line of states: joint `joint` (from 0) over its speed, or at a fixed speed over an angle."""

    joint: int
    over: str  # "speed_rad_s" or "angle_rad"
    values: Tensor  # (n,) rad/s or rad
    states: Motion
    gains: dict[str, Gains]

    def damping(self, label: str) -> Tensor:
        """Return d tau_j / d qd_j (n,) N m s/rad of the model `label`."""
        return self.gains[label].of_joint("qd", self.joint)

    def inertia(self, label: str) -> Tensor:
        """Return d tau_j / d qdd_j (n,) kg m^2 of the model `label`."""
        return self.gains[label].of_joint("qdd", self.joint)

    def document(self) -> dict[str, Any]:
        """Return the curves of all models and the whole matrices of the first, as gains.json holds them."""
        first = next(iter(self.gains.values()))
        return {"joint": self.joint + 1, "over": self.over, "values": self.values.tolist(), "q_rad": self.states.q.tolist(),
                "dq_rad_s": self.states.qd.tolist(),
                "damping_Nm_s_rad": {label: self.damping(label).tolist() for label in self.gains},
                "inertia_kg_m2": {label: self.inertia(label).tolist() for label in self.gains}, "matrices": first.document()}


def reference_models(model: TorqueModel) -> dict[str, TorqueModel]:
    """Return `model`, the calibrated baseline of a hybrid, the textbook (where there is water) and the dry arm, by label."""
    arm = model.arm
    found: dict[str, TorqueModel] = {"model": model}
    if isinstance(model, LearnedTorque) and model.baseline is not None:
        found["baseline"] = model.baseline
    for label, name in (("textbook", "textbook"), ("dry arm", "rigid")):
        if label == "dry arm" or not arm.dry:
            found[label] = StripTheory(arm, model.preparation, {}, name, BASELINES[name].start(arm))
    return found


def _states(around: Around, links: int, n: int) -> Motion:
    q = tensor(around.posture_rad or (0.0,) * links).expand(n, links)
    return Motion.at(q, torch.zeros(n, links), torch.zeros(n, links), around.tow_m_s)


def _with_rate(states: Motion, joint: int, rate: Tensor) -> Motion:
    qd = states.qd.clone()
    qd[:, joint] = rate
    return replace(states, qd=qd)


def sweeps(model: TorqueModel, around: Around | None = None) -> list[Sweep]:
    """Return one sweep over speed a joint and, for two links or more, one over the last angle a joint at half the greatest speed.

    Raises ConfigError where the posture has another number of angles than the arm has joints.
    """
    around, links = around or Around(), model.arm.n_links
    how, example = "one" if links == 1 else f"all {links}", ",".join(["0.3", "-0.5", "0.1"][:links])
    require(len(around.posture_rad) in (0, links), f"--posture: {count_text(len(around.posture_rad), 'angle')} for an arm of "
            f"{count_text(links, 'joint')}: give {how}, as in --posture {example}")
    models, made = reference_models(model), []
    still = _states(around, links, POINTS)
    speed = around.speed_rad_s * torch.arange(-(POINTS // 2), POINTS // 2 + 1, dtype=torch.float64) / (POINTS // 2)
    angle = torch.linspace(-pi / 2, pi / 2, POINTS, dtype=torch.float64)
    q = still.q.clone()
    q[:, -1] = angle
    for joint in range(links):
        lines = [("speed_rad_s", speed, _with_rate(still, joint, speed))]
        if links > 1:
            lines.append(("angle_rad", angle, _with_rate(replace(still, q=q), joint, torch.full_like(angle, around.speed_rad_s / 2))))
        made += [Sweep(joint, over, values, states, {label: gain_matrix(model, states) for label, model in models.items()})
                 for over, values, states in lines]
    return made


def document(model: TorqueModel, around: Around, made: Sequence[Sweep]) -> dict[str, Any]:
    """Return gains.json."""
    return {"schema": SCHEMA, "model": getattr(model, "name", model.kind), "kind": model.kind, "inputs": list(INPUTS), "units": dict(UNITS),
            "conventions": "torques are what the drives supply, as the sensors see them; angles joint-relative; [state][drive][joint]",
            "wake": "developed: every state has lasted long", "speed_rad_s": around.speed_rad_s, "u0_m_s": around.tow_m_s,
            "sweeps": [sweep.document() for sweep in made]}
