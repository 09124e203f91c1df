"""The arm: geometry, masses, fluid and drive, as arm.yaml states them beforehand."""

from math import pi
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from nnhydro.conventions import SCHEMA_ARM, column, joint_text
from nnhydro.errors import ArmError, count_text
from nnhydro.recordings.readers.validation import Settings, validate
from nnhydro.recordings.readers.yaml_file import read_yaml

NonNegative = Field(ge=0, le=1e6)
LIGHTEST, DENSEST = 0.1, 25_000.0  # a hollow link, of the density of its fluid; osmium, kg/m3
LONG, NOTHING = 10.0, 1e-3  # m; of the density of its fluid: a link longer and lighter than so is in cm or mm


class Fluid(Settings):
    """The water: density rho in kg/m^3 (0: a dry arm) and kinematic viscosity nu in m^2/s."""

    density_kg_m3: float = NonNegative
    kinematic_viscosity_m2_s: float = Field(default=1e-6, gt=0, le=1.0)


class Gear(Settings):
    """A gear train between motor and joint: what a torque sensor on the motor side reads is scaled and loses by friction.

    A lossless sensor on the motor side reads T / ratio; with efficiency eta it reads T / (ratio eta) while the motor drives
    and T eta / ratio while it is driven. Source: Rivera (1995), section 4.1 (physics of the losses: ours).
    """

    ratio: float = Field(default=1.0, gt=0, le=1e4)
    efficiency: float = Field(default=1.0, gt=0, le=1.0)
    torque_at: Literal["motor", "output"] = "output"


NO_GEAR = Gear()


class Drive(Settings):
    """How the joints are driven: each by its own motor (`direct`), or the outer ones by a belt from the base (`remote`).

    `pulley_ratio` r (teeth at the base / teeth at the elbow) gives q_2 = r (psi_2 - psi_1). `angle2: absolute` says that the
    second angle channel is the motor's psi_2 (for r = 1 the absolute angle phi_2). Source: Rivera (1995), section 3.3.
    """

    kind: Literal["direct", "remote"] = "direct"
    pulley_ratio: float = Field(default=1.0, gt=0, le=100)
    angle2: Literal["relative", "absolute"] = "relative"
    rotor_inertia_kg_m2: tuple[Annotated[float, NonNegative], ...] | None = None  # one per joint, as felt there; None: not stated
    known_to: float = Field(default=0.1, ge=0, le=1)  # relative standard uncertainty of the rotor inertias

    @model_validator(mode="after")
    def _belt_only_where_remote(self) -> "Drive":
        if self.kind == "direct" and (self.angle2 == "absolute" or self.pulley_ratio != 1.0):
            raise ValueError("pulley_ratio and angle2: absolute belong to a belt: write 'kind: remote', or remove them")
        return self


class Friction(Settings):
    """Friction of one joint, known beforehand: Coulomb level in N m and viscous coefficient in N m s/rad (N and N s/m where it slides).

    `known_to` is their relative standard uncertainty: calibration may move them within it.
    """

    coulomb_torque: float | None = Field(default=None, alias="coulomb_Nm", ge=0, le=1e6)
    viscous_torque: float | None = Field(default=None, alias="viscous_Nm_s", ge=0, le=1e6)
    coulomb_force: float | None = Field(default=None, alias="coulomb_N", ge=0, le=1e6)
    viscous_force: float | None = Field(default=None, alias="viscous_N_s_m", ge=0, le=1e6)
    known_to: float = Field(default=0.1, ge=0, le=1)

    @property
    def coulomb(self) -> float | None:
        """The Coulomb level, None where it is not stated."""
        return self.coulomb_torque if self.coulomb_torque is not None else self.coulomb_force

    @property
    def viscous(self) -> float | None:
        """The viscous coefficient, None where it is not stated."""
        return self.viscous_torque if self.viscous_torque is not None else self.viscous_force


class Joint(Settings):
    """How a joint moves: it turns (`revolute`), or slides along the direction `direction_rad` from +X (`prismatic`: a linear axis)."""

    type: Literal["revolute", "prismatic"] = "revolute"
    direction_rad: float = Field(default=0.0, ge=-10, le=10)


class Link(Settings):
    """One link: length L, diameter D, mass m, distance of its mass centre from its joint, inertia about the mass centre; SI.

    `known_to` is the relative standard uncertainty of mass, mass centre and inertia: calibration may move them within it.
    """

    length_m: float = Field(gt=0, le=100)
    diameter_m: float = Field(gt=0, le=10)
    mass_kg: float = NonNegative
    com_m: float = Field(ge=-100, le=100)
    inertia_kg_m2: float = NonNegative
    known_to: float = Field(default=0.01, ge=0, le=1)
    gear: Gear | None = None

    def fits_mass(self, length_m: float, diameter_m: float, fluid_kg_m3: float) -> bool:
        """Return whether the mass fits a body of this length and diameter: between a tenth of its fluid's density and osmium's."""
        volume = pi / 4 * diameter_m**2 * length_m
        return LIGHTEST * fluid_kg_m3 * volume <= self.mass_kg <= DENSEST * volume


def _slides(joints: Any) -> bool:
    """Whether one of the joints, as they are stated or as they were read, is prismatic."""
    stated = joints if isinstance(joints, list | tuple) else ()
    return any((joint.get("type") if isinstance(joint, dict) else getattr(joint, "type", "")) == "prismatic" for joint in stated)


class Arm(Settings):
    """A planar serial arm of revolute links (or one carriage on a linear axis), the water it moves in and its drive."""

    schema_: Literal["nnhydro/arm/1"] = Field(default=SCHEMA_ARM, alias="schema")
    name: str = Field(default="arm", max_length=200)
    fluid: Fluid
    gravity_m_s2: float = Field(default=0.0, ge=0, le=100)
    drive: Drive = Drive()
    gear: Gear | None = None
    parallel_distance_m: float = Field(default=0.0, ge=0, le=100)
    joints: tuple[Joint, ...] | None = Field(default=None, max_length=10)
    friction: tuple[Friction, ...] | None = Field(default=None, max_length=10)
    links: tuple[Link, ...] = Field(min_length=1, max_length=10)

    @classmethod
    def keys_of_others(cls, document: dict[str, Any]) -> frozenset[str]:
        """Return the keys of friction that belong to joints of the other kind."""
        return frozenset(("coulomb_Nm", "viscous_Nm_s") if _slides(document.get("joints")) else ("coulomb_N", "viscous_N_s_m"))

    @model_validator(mode="before")
    @classmethod
    def _carriage_needs_no_shape(cls, value: Any) -> Any:
        """Fill in what a carriage on a linear axis has no use for: mass centre and inertia, whatever they are, and in air the shape."""
        if not (isinstance(value, dict) and _slides(value.get("joints")) and isinstance(value.get("links"), list | tuple)):
            return value
        fluid = value.get("fluid")
        dry = isinstance(fluid, dict) and fluid.get("density_kg_m3") == 0
        shape = {"length_m": 1.0, "diameter_m": 0.1} if dry else {}
        useless = {"com_m": 0.0, "inertia_kg_m2": 0.0}

        def axis_link(link: dict[str, Any]) -> dict[str, Any]:
            """Return a link whose mass alone counts; what is no number is left to be refused."""
            numbers = {key: x for key, x in useless.items() if isinstance(link.get(key, x), int | float)}
            return {**shape, **useless, **link, **numbers}

        return {**value, "links": [axis_link(link) if isinstance(link, dict) else link for link in value["links"]]}

    @field_validator("name")
    @classmethod
    def _printable(cls, value: str) -> str:
        """The name goes to terminals, pages and exported files: no control characters."""
        if not value.isprintable():
            raise ValueError("holds a line break or a control character: give one line of text")
        return value

    @field_validator("drive", mode="before")
    @classmethod
    def _drive_by_name(cls, value: Any) -> Any:
        return {"kind": value} if isinstance(value, str) else value

    @model_validator(mode="after")
    def _belt_needs_two_links(self) -> "Arm":
        if self.drive.kind == "remote" and len(self.links) != 2:
            raise ValueError(f"a remote (belt) drive is defined for two links, this arm has {len(self.links)}: use 'drive: direct'")
        return self

    @model_validator(mode="after")
    def _no_link_is_next_to_nothing(self) -> "Arm":
        """A long link that weighs less than a thousandth of the fluid in its place is one in cm or mm."""
        for number, link in enumerate(self.links, 1):
            displaced = self.fluid.density_kg_m3 * pi / 4 * link.diameter_m**2 * link.length_m
            if link.length_m <= LONG or not 0 < link.mass_kg < NOTHING * displaced:
                continue
            sizes = {key: getattr(link, key) for key in ("length_m", "diameter_m", "com_m")}
            for unit, ratio in (("cm", 1e-2), ("mm", 1e-3)):
                if link.fits_mass(ratio * link.length_m, ratio * link.diameter_m, self.fluid.density_kg_m3):
                    written = ", ".join(f"{key}: {ratio * value:.6g}" for key, value in sizes.items())
                    raise ValueError(f"link {number} is {link.length_m:g} m long and {link.diameter_m:g} m in diameter, but has "
                                     f"{link.mass_kg:g} kg, where the fluid would have {displaced:.3g} kg: probably in {unit}: "
                                     f"write {written}")
        return self

    @model_validator(mode="after")
    def _one_entry_a_joint(self) -> "Arm":
        """Lists that hold one value per joint have as many entries as links."""
        for key, given in (("joints", self.joints), ("friction", self.friction),
                           ("drive.rotor_inertia_kg_m2", self.drive.rotor_inertia_kg_m2)):
            if given is not None and len(given) != len(self.links):
                raise ValueError(f"{key} has {count_text(len(given), 'entry')} for {count_text(len(self.links), 'joint')}: give one for "
                                 "each, in order")
        return self

    @model_validator(mode="after")
    def _linear_axis_alone(self) -> "Arm":
        """A prismatic joint is the only joint, and has no keys of a revolute one."""
        if not _slides(self.joints):
            if any(joint.coulomb_force is not None or joint.viscous_force is not None for joint in self.friction or ()):
                raise ValueError("friction of a joint that turns is coulomb_Nm and viscous_Nm_s: rename coulomb_N and viscous_N_s_m")
            return self
        if any(joint.coulomb_torque is not None or joint.viscous_torque is not None for joint in self.friction or ()):
            raise ValueError("friction of a linear axis is coulomb_N and viscous_N_s_m: rename coulomb_Nm and viscous_Nm_s")
        if len(self.links) != 1:
            raise ValueError("a prismatic joint must be the only one (a linear axis): describe each axis as an arm of "
                             "its own")
        if self.drive.kind == "remote":
            raise ValueError("a linear axis has no belt to a second joint: use 'drive: direct'")
        return self

    @property
    def sliding(self) -> bool:
        """True for a linear axis: its joint reads m and N."""
        return _slides(self.joints)

    @property
    def direction_rad(self) -> float:
        """Direction of travel of a linear axis, from +X."""
        return self.joints[0].direction_rad if self.joints else 0.0

    def column(self, channel: str, joint: int | None = None) -> str:
        """Name of the column of `channel` in recordings of this arm, `joint` counted from 1."""
        return column(channel, joint, self.sliding)

    def text(self, text: str) -> str:
        """Return `text` (a unit, a sentence) about this arm's joints in their own units."""
        return joint_text(text, self.sliding)

    @property
    def n_links(self) -> int:
        """Number of links (and joints)."""
        return len(self.links)

    def _column(self, key: str) -> NDArray[np.float64]:
        return np.array([getattr(link, key) for link in self.links], dtype=float)

    @property
    def L(self) -> NDArray[np.float64]:  # (links,) m
        """Lengths."""
        return self._column("length_m")

    @property
    def D(self) -> NDArray[np.float64]:  # (links,) m
        """Outer diameters."""
        return self._column("diameter_m")

    def gear_of(self, joint: int) -> Gear:
        """Gear of the drive of `joint` (counted from 0): the link's own, else the arm's, else none (ratio 1)."""
        return self.links[joint].gear or self.gear or NO_GEAR

    @property
    def dry(self) -> bool:
        """True where the fluid has no density."""
        return self.fluid.density_kg_m3 == 0.0

    def document(self) -> dict[str, Any]:
        """Return the arm as the mapping that arm.yaml holds."""
        return self.model_dump(by_alias=True, exclude_none=True, mode="json")


def parse_arm(document: dict[str, Any], where: str) -> Arm:
    """Return the arm that `document` describes; raise `ArmError` naming `where` and the key."""
    return validate(Arm, document, where, ArmError)


def read_arm(path: Path) -> Arm:
    """Return the arm in the file `path` (arm.yaml); raise `ArmError` with one line naming file and key."""
    return parse_arm(read_yaml(path, ArmError), str(path))
