"""Units, signs, frames and channel names: the one page that all else cites.

Frame    X, Y in the plane of motion, Z out of it, at rest. Joint 1 sits on a carriage that moves along +Y at `u0`, or on a base that also
         moves along +X and turns with the heading psi, counter-clockwise; velocities are those of joint 1 along the axes at rest.
Angles   q_1 from +X to link 1, q_i (i > 1) from link i-1 to link i, counter-clockwise, rad; phi_i = q_1 + ... + q_i (+ psi; q_1 is then
         measured from the heading).
Link     e_i = (cos phi_i, sin phi_i) from joint i to joint i+1, n_i = (-sin phi_i, cos phi_i); x runs along e_i from 0 to L_i.
Water    at rest far away, or moving as `current` says, everywhere alike; velocities are those of the link through the water.
LOAD     a torque is what the drive must supply, positive along +q_j: rigid body + minus the water's torque + friction.
         Drag loads therefore carry the sign of the velocity, inertia loads the sign of the acceleration.
C_M      is the added-mass coefficient (ideal value 1), never Morison's inertia coefficient 1 + C_M.
Units    SI everywhere; a column or key name ends in its unit. A joint that slides (a linear axis) reads m and N where others read rad and
         N m: `SLIDING` and `joint_text` are the one place that says so.
Slide    the link of a prismatic joint stands across its travel, e_1 = d turned by -90 degrees, and moves along d = (cos a, sin a) at qd_1.

Source: Rivera (1995), section 3.1; McLain & Rock (1998), eq. (1) with the opposite sign (they report the water's torque on the arm).
"""

import re
from dataclasses import dataclass
from typing import Final

SCHEMA_ARM: Final = "nnhydro/arm/1"
SCHEMA_MODEL: Final = "nnhydro/model/1"
SCHEMA_BENCHMARK: Final = "nnhydro/benchmark/1"
SCHEMA_RECIPE: Final = "nnhydro/recipe/1"

TIME: Final = "t_s"
CLOCK: Final = "clock_s"

Z95: Final = 1.96  # standard deviations in half a 95 % interval

SLIDING: Final = {"rad": "m", "rad_s": "m_s", "rad_s2": "m_s2", "Nm": "N"}  # unit in column names of a joint that slides
_SLIDING_TEXT: Final = (  # units and words in sentences, longest first
    (r"_Nm\b", "_N"), (r"_rad_s2\b", "_m_s2"), (r"_rad_s\b", "_m_s"), (r"_rad\b", "_m"),
    (r"\bN m s\^2/rad\b", "kg"), (r"\bN m s/rad\b", "N s/m"), (r"\bN m/rad\b", "N/m"), (r"\bN m/s\b", "N/s"), (r"\bN m s\b", "N s"),
    (r"\bN m\b", "N"), (r"\bkg m(\^2|²|2)", "kg"), (r"\brad\b(?!( \([^)]*\))? from \+X)", "m"),  # a direction is an angle on any arm
    (r"\btorque", "force"), (r"\bTorque", "Force"), (r"\bangle\b", "position"), (r"\bangles\b", "positions"), (r"\bAngle\b", "Position"),
    (r"\bAngles\b", "Positions"))


def joint_text(text: str, sliding: bool) -> str:
    """Return `text` (a unit, a sentence) about a joint in the units and words of one that slides; as it is where it turns."""
    if sliding:
        for turning, straight in _SLIDING_TEXT:
            text = re.sub(turning, straight, text)
    return text


def with_units(page: str, sliding: bool) -> str:
    """Return a page or picture with the units in square brackets, [N m], [rad], [rad/s], as a joint that slides has them."""
    return re.sub(r"\[(?:N m|rad)[^\]\n]{0,12}\]", lambda unit: joint_text(unit[0], sliding), page)


@dataclass(frozen=True)
class Channel:
    """One kind of column of a recording: its stem, its unit suffix and whether there is one per joint."""

    stem: str
    unit: str
    per_joint: bool
    meaning: str

    def column(self, joint: int | None = None, sliding: bool = False) -> str:
        """Name of the column, `joint` counted from 1; of a joint that slides where `sliding`."""
        if self.per_joint != (joint is not None):
            raise ValueError(f"channel {self.stem} is {'' if self.per_joint else 'not '}one per joint")
        head, _, tail = self.stem.partition("_")
        number = "" if joint is None else str(joint)
        return f"{head}{number}{'_' + tail if tail else ''}_{SLIDING[self.unit] if sliding and self.per_joint else self.unit}"


CHANNELS: dict[str, Channel] = {
    "q": Channel("q", "rad", True, "joint angle"),
    "qd": Channel("dq", "rad_s", True, "joint rate"),
    "qdd": Channel("ddq", "rad_s2", True, "joint acceleration"),
    "tau": Channel("tau", "Nm", True, "drive torque"),
    "tau_sim": Channel("tau_sim", "Nm", True, "the user's own simulated torque"),
    "tau_std": Channel("tau_std", "Nm", True, "standard deviation of a torque"),
    "u0": Channel("u0", "m_s", False, "carriage speed"),
    "du0": Channel("du0", "m_s2", False, "carriage acceleration"),
    "base_x": Channel("base_x", "m_s", False, "velocity of the base along +X"),
    "base_y": Channel("base_y", "m_s", False, "velocity of the base along +Y: what u0 has always meant"),
    "base_yaw": Channel("base_yaw", "rad_s", False, "yaw rate of the base"),
    "dbase_x": Channel("dbase_x", "m_s2", False, "acceleration of the base along +X"),
    "dbase_y": Channel("dbase_y", "m_s2", False, "acceleration of the base along +Y"),
    "dbase_yaw": Channel("dbase_yaw", "rad_s2", False, "yaw acceleration of the base"),
    "heading": Channel("base_yaw", "rad", False, "heading of the base, from +X"),
    "current_x": Channel("current_x", "m_s", False, "velocity of the water along +X"),
    "current_y": Channel("current_y", "m_s", False, "velocity of the water along +Y"),
    "dcurrent_x": Channel("dcurrent_x", "m_s2", False, "acceleration of the water along +X"),
    "dcurrent_y": Channel("dcurrent_y", "m_s2", False, "acceleration of the water along +Y"),
}


def column(channel: str, joint: int | None = None, sliding: bool = False) -> str:
    """Name of the column of `channel` (a key of `CHANNELS`), `joint` counted from 1; e.g. column("qd", 2) = "dq2_rad_s".

    Of a joint that slides (`sliding`) it ends in m or N: column("tau", 1, True) = "tau1_N". Where an arm is at hand: `Arm.column`.
    """
    return CHANNELS[channel].column(joint, sliding)
