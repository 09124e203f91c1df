"""The arm: geometry, masses, fluid and drive, as arm.yaml states them beforehand."""

from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from nnhydro.conventions import SCHEMA_ARM
from nnhydro.errors import ArmError
from nnhydro.recordings.validation import Settings, validated
from nnhydro.recordings.yaml_file import read_yaml

Positive = Field(gt=0, le=1e6)
NonNegative = Field(ge=0, le=1e6)


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


class Drive(Settings):
    """How the joints are driven: each by its own motor (`direct`), or the outer ones by a belt from the base (`remote`).

    `pulley_ratio` r (teeth at the base / teeth at the elbow) gives q_2 = r (psi_2 - psi_1). `angle2: absolute` says that the
    second angle channel is the motor's psi_2 (for r = 1 the absolute angle phi_2). Source: Rivera (1995), section 3.3.
    """

    kind: Literal["direct", "remote"] = "direct"
    pulley_ratio: float = Field(default=1.0, gt=0, le=100)
    angle2: Literal["relative", "absolute"] = "relative"

    @model_validator(mode="after")
    def _belt_only_where_remote(self) -> "Drive":
        if self.kind == "direct" and (self.angle2 == "absolute" or self.pulley_ratio != 1.0):
            raise ValueError("pulley_ratio and angle2: absolute belong to a belt: write 'kind: remote', or remove them")
        return self


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


class Arm(Settings):
    """A planar serial arm of revolute links, the water it moves in and its drive."""

    schema_: Literal["nnhydro/arm/1"] = Field(default=SCHEMA_ARM, alias="schema")
    name: str = Field(default="arm", max_length=200)
    fluid: Fluid
    gravity_m_s2: float = Field(default=0.0, ge=0, le=100)
    drive: Drive = Drive()
    gear: Gear | None = None
    parallel_distance_m: float = Field(default=0.0, ge=0, le=100)
    links: tuple[Link, ...] = Field(min_length=1, max_length=10)

    @field_validator("drive", mode="before")
    @classmethod
    def _drive_by_name(cls, value: Any) -> Any:
        return {"kind": value} if isinstance(value, str) else value

    @model_validator(mode="after")
    def _belt_needs_two_links(self) -> "Arm":
        if self.drive.kind == "remote" and len(self.links) != 2:
            raise ValueError(f"a remote (belt) drive is defined for two links, this arm has {len(self.links)}: use 'drive: direct'")
        return self

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
        return self.links[joint].gear or self.gear or Gear()

    @property
    def dry(self) -> bool:
        """True where the fluid has no density."""
        return self.fluid.density_kg_m3 == 0.0

    def document(self) -> dict[str, Any]:
        """Return the arm as the mapping that arm.yaml holds."""
        return self.model_dump(by_alias=True, exclude_none=True, mode="json")


def parse_arm(document: dict[str, Any], where: str) -> Arm:
    """Return the arm that `document` describes; raise `ArmError` naming `where` and the key."""
    return validated(Arm, document, where, ArmError)


def read_arm(path: Path) -> Arm:
    """Return the arm in the file `path` (arm.yaml); raise `ArmError` with one line naming file and key."""
    return parse_arm(read_yaml(path, ArmError), str(path))
