"""What the concealed tank holds: the arm as it really is, one run of it, and a hidden cause.

Units: SI, rad. Angles are joint-relative, q_1 from +X, the carriage moves along +Y. Torques are what the drive supplies (LOAD).
Arrays: n times, L links (= joints), s strips of a link.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from nnhydro.blind_tests.truth.flow import LinkFlow

Array = NDArray[np.float64]
Generator = np.random.Generator
FAMILIES = {
    "wake": ("wake_development", "flow_memory", "wake_reentry", "history_force", "vortex_shedding"),
    "drag_law": ("reynolds_drag", "axial_drag", "tip_drag", "drag_form"),
    "interference": ("link_interference", "wall_proximity"),
    "water": ("ambient_current", "wave_orbital"),
    "inertia": ("added_mass", "rotor_inertia", "payload_mass"),
    "dry_friction": ("coulomb_friction", "stribeck_friction", "load_friction"),
    "viscous": ("viscous_friction",),
    "restoring": ("buoyancy_tilt", "umbilical_stiffness"),
    "transmission": ("joint_elasticity", "oscillating_mass", "flexible_mount", "backlash", "torque_ripple"),
    "torque_sensor": ("torque_bias", "torque_gain", "torque_drift", "torque_crosstalk", "torque_saturation"),
    "timing": ("sensor_timing",),
    "angle_sensor": ("encoder_offset",),
}
FAMILY = {effect: family for family, effects in FAMILIES.items() for effect in effects}


@dataclass(frozen=True)
class TrueLink:
    """One link: length and diameter in m, mass in kg, mass centre in m from its joint, inertia about it in kg m2, coefficients."""

    length: float
    diameter: float
    mass: float
    com: float
    inertia: float
    C_D: float = 1.0
    C_M: float = 1.0


@dataclass(frozen=True)
class TrueArm:
    """The arm in its water. `belt`: both motors sit at the base and the second turns link 2 through a 1:1 belt."""

    links: tuple[TrueLink, ...]
    rho: float = 1000.0  # kg/m3
    nu: float = 1e-6  # m2/s
    belt: bool = False

    @property
    def reach(self) -> float:
        """Length of the stretched arm in m."""
        return sum(link.length for link in self.links)


@dataclass(frozen=True)
class TrueRun:
    """What the links really did, on an even grid; `start` is the time of day in s, `seed` what chance causes draw from.

    `way` is how far the carriage had come along +Y at the first instant, in m.
    """

    name: str
    t: Array  # (n,) s
    q: Array  # (n, L) rad
    qd: Array  # (n, L) rad/s
    qdd: Array  # (n, L) rad/s2
    u0: Array  # (n,) m/s
    du0: Array  # (n,) m/s2
    start: float = 0.0
    seed: int = 0
    way: float = 0.0

    @property
    def dt(self) -> float:
        """Step of time in s."""
        return float(self.t[1] - self.t[0]) if len(self.t) > 1 else 1.0

    @property
    def clock(self) -> Array:
        """Time of day (n,) in s."""
        return self.start + self.t


JointLaw = Callable[[TrueRun, Array], Array]  # run, torque (n, L) so far -> (n, L)


@dataclass(frozen=True)
class Cause:
    """One hidden cause at one size: where it acts, in words, numbers and code. A stage that it leaves alone is None.

    water   changes the flow about a link                       before the water's load is summed
    load    extra joint torque, N m                             given run and load so far
    drive   angle of the drive against the link, rad            given run and transmitted torque
    sense   what the torque sensors read, N m                   given run and torque at the drives
    angle   what the encoders add, rad                          given run and torque
    """

    id: str
    joint: int | None  # from 1; None for what loads the whole arm or both channels
    shape: str
    law: str
    parameters: dict[str, tuple[float, str]] = field(default_factory=dict)
    water: Callable[[LinkFlow], LinkFlow] | None = None
    load: JointLaw | None = None
    drive: JointLaw | None = None
    sense: JointLaw | None = None
    angle: JointLaw | None = None
    chance: bool = False  # it differs from run to run by chance, so that no model can predict it
    order: int = 0  # water stages act in this order: the water's motion first, forces that lag last
    near: tuple[str, ...] = ()  # for what is on no list: names that would not be wrong
    share: Callable[[TrueRun], Array] | None = None  # how much of it acts (n,), in a part of the campaign only; all of it where None

    @property
    def family(self) -> str | None:
        """The effect's family, None for what is on no list."""
        return FAMILY.get(self.id)


@dataclass(frozen=True)
class Draft:
    """A cause whose size is still open: `make(amount)`, with amounts from `low` to `high` that physics allows."""

    make: Callable[[float], Cause]
    low: float
    high: float


def on_joint(torque: Array, joint: int, links: int) -> Array:
    """Return (n, links) with `torque` (n,) at `joint` (from 1) and zero elsewhere."""
    result = np.zeros((len(torque), links))
    result[:, joint - 1] = torque
    return result
