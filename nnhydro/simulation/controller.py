"""Joint controllers: they see angles and rates at their own rate and hold the torque in between.

    pd               tau = kp e + kd de                                                 kp [N m/rad], kd [N m s/rad]
    pid              tau = kp e + kd de + ki int e dt                                   ki [N m/(rad s)]
    computed_torque  tau = model(q, qd, qdd_ref + kp e + kd de)                         kp [1/s^2],   kd [1/s]
    sliding_mode     tau = model(q, qd, qdd_ref + slope de) + kp sat(s / boundary),     s = de + slope e
                                                                                        kp [N m], slope [1/s], boundary [rad/s]
    e = q_ref - q,  de = qd_ref - qd

`model` is the dry arm as arm.yaml states it, a baseline as fits begin it, or the folder of any model: its torque at the joints, with the
memory that the motion seen so far has left. The torques are those at the joints, whatever drives them; `torque_limit_Nm` clips each, the
integral stands still meanwhile. With `encoder_counts_per_rev` the controller sees angles in steps and takes rates from them itself;
what it decides acts `delay_s` later. Source: sat in place of the sign within a boundary: Slotine & Li (1991), as restated
at https://www.scubadivingchicago.us/underwater-vehicles/vr-vd.html; pd, pid and computed torque: from general knowledge, not checked;
McLain & Rock (1998) for models of the water in a controller.
"""

from pathlib import Path
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from nnhydro.dynamics.joint_model import JointModel, joint_model
from nnhydro.errors import ConfigError, require
from nnhydro.models.baselines import BASELINES
from nnhydro.models.storage import load_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import tensor
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.readers.validation import Settings
from nnhydro.simulation.recipe.per_joint import PerJointMagnitude, spread
from nnhydro.simulation.torque_law import Inside, TorqueLaw

WITH_MODEL = ("computed_torque", "sliding_mode")


def model_inside(name: str, arm: Arm, folder: Path | None) -> JointModel:
    """Return the mechanics of the model that a controller holds: dry, a baseline, or a folder (relative to `folder`).

    Raises ConfigError where the model is of an arm with other joints, ModelError where it cannot be used.
    """
    known = {"dry": "rigid", **{key: key for key in BASELINES}}
    if name in known:
        return joint_model(StripTheory(arm, Preparation(None), {}, name, BASELINES[known[name]].start(arm)))
    path = Path(name) if folder is None else folder / name
    require(path.is_dir(), f"controller.model: {name!r} is neither dry, {', '.join(BASELINES)} nor the folder of a model")
    loaded = load_model(path)
    require(loaded.arm.n_links == arm.n_links, f"controller.model: {name}: is of an arm with {loaded.arm.n_links} joint(s), this one has "
            f"{arm.n_links}")
    return joint_model(loaded)


class Controller(Settings):
    """Gains (one, or one per joint), the largest torque, what is seen, and how often the controller acts (default: once a sample)."""

    kind: Literal["pd", "pid", "computed_torque", "sliding_mode"]
    kp: PerJointMagnitude
    kd: PerJointMagnitude = (0.0,)
    ki: PerJointMagnitude = (0.0,)
    slope: PerJointMagnitude = (10.0,)
    boundary: PerJointMagnitude = (0.1,)
    model: str = Field(default="dry", max_length=1000)
    torque_limit_Nm: PerJointMagnitude | None = None
    rate_hz: float | None = Field(default=None, gt=0, le=1e5)
    delay_s: float = Field(default=0.0, ge=0, le=10)
    encoder_counts_per_rev: int | None = Field(default=None, ge=16, le=2**32)
    rate_filter_hz: float = Field(default=50.0, gt=0, le=1e5)

    @model_validator(mode="after")
    def _fits_its_kind(self) -> Self:
        """A model and a boundary layer belong to the kinds of controller that use them."""
        if self.kind not in WITH_MODEL and self.model != "dry":
            raise ValueError(f"model belongs to {' and '.join(WITH_MODEL)}: a {self.kind} holds none")
        if self.kind == "sliding_mode" and not all(width > 0 for width in self.boundary):
            raise ValueError("boundary must be positive: without a boundary layer the torque chatters")
        return self

    def torque_law(self, arm: Arm, rate_hz: float | None = None, folder: Path | None = None) -> TorqueLaw:
        """Return the law for `arm`, which acts at `rate_hz`; raise ConfigError where a gain does not fit its joints or its rate."""
        n = arm.n_links
        rate = self.rate_hz or rate_hz or 100.0
        limit = np.full(n, np.inf) if self.torque_limit_Nm is None else spread(self.torque_limit_Nm, n, "controller.torque_limit_Nm")
        gains = {name: tensor(spread(getattr(self, name), n, f"controller.{name}")) for name in ("kp", "kd", "ki", "slope", "boundary")}
        late = self.delay_s * rate
        require(abs(late - round(late)) < 1e-6 * max(1.0, late), f"controller.delay_s: {self.delay_s:g} s is not a whole number of periods "
                f"of {rate:g} Hz", ConfigError)
        inside = Inside(model_inside(self.model, arm, folder)) if self.kind in WITH_MODEL else None
        step = None if self.encoder_counts_per_rev is None else 2 * np.pi / self.encoder_counts_per_rev
        return TorqueLaw(self.kind, **gains, limit=tensor(limit), inside=inside, period=1 / rate, late=round(late), step=step,
                         smoothing=float(1 - np.exp(-2 * np.pi * self.rate_filter_hz / rate)))
