"""Planar arms with their true values, and what arm.yaml states of them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = float | list[float] | Array
GRAVITY = 9.81


@dataclass
class Arm:
    """A planar serial arm with its true values; what arm.yaml states is drawn around them."""

    length: Array
    diameter: Array
    mass: Array
    com: Array
    inertia: Array
    cd: Array
    cm: Array
    known_to: Array
    density: float = 1000.0
    viscosity: float = 1.0e-6
    gravity: float = 0.0
    friction: list[tuple[float, float]] | None = None  # of each joint: Coulomb's, N m, and viscous, N m s
    friction_known_to: float = 0.1
    remote: bool = False
    gear: tuple[float, float] | None = None  # ratio and efficiency

    @property
    def links(self) -> int:
        """How many links there are."""
        return len(self.length)


def arm(length: Numbers, diameter: Numbers, mass: Numbers, com: Numbers, inertia: Numbers, cd: Numbers = 1.1, cm: Numbers = 0.9,
        known_to: Numbers = 0.01, **more: Any) -> Arm:
    """An arm from numbers or lists; one number for C_D, C_M or the uncertainty counts for all links."""
    sizes = [np.atleast_1d(np.asarray(value, float)) for value in (length, diameter, mass, com, inertia)]
    shared = [np.broadcast_to(np.atleast_1d(np.asarray(value, float)), sizes[0].shape).copy() for value in (cd, cm, known_to)]
    return Arm(*sizes, *shared, **more)


def tank_arm(**more: Any) -> Arm:
    """The two-link arm of most campaigns in water."""
    return arm([0.55, 0.45], [0.07, 0.06], [1.9, 1.4], [0.27, 0.22], [0.058, 0.026],
               **{"cd": [1.05, 0.95], "cm": [0.85, 0.8], "known_to": 0.02, **more})


def rod_inertia(length: float, diameter: float, mass: float) -> float:
    """The inertia of a full cylinder about its centre, across its axis."""
    return mass * (length * length / 12 + diameter * diameter / 16)


def short(value: float) -> str:
    """A number with six digits."""
    return repr(float(f"{value:.6g}"))


def yaml_of(machine: Arm, name: str, rng: np.random.Generator) -> str:
    """The text of arm.yaml: every stated value lies within 1.7 standard uncertainties of the truth."""
    def stated_values(values: Array) -> Array:
        return values * (1 + machine.known_to * np.clip(rng.normal(size=machine.links), -1.7, 1.7))
    mass, com, inertia = (stated_values(values) for values in (machine.mass, machine.com, machine.inertia))
    lines = ["schema: nnhydro/arm/1", f"name: {name}",
             f"fluid: {{density_kg_m3: {short(machine.density)}, kinematic_viscosity_m2_s: {machine.viscosity:.3e}}}"]
    if machine.gravity:
        lines.append(f"gravity_m_s2: {machine.gravity}")
    lines.append("drive: {kind: remote, pulley_ratio: 1.0, angle2: absolute}" if machine.remote else "drive: direct")
    if machine.gear:
        lines.append(f"gear: {{ratio: {machine.gear[0]}, efficiency: {machine.gear[1]}, torque_at: motor}}")
    if machine.friction:
        lines += ["friction:", *friction_lines(machine.friction, machine.friction_known_to, rng)]
    lines.append("links:")
    for i in range(machine.links):
        lines.append(f"  - {{length_m: {short(machine.length[i])}, diameter_m: {short(machine.diameter[i])}, mass_kg: {short(mass[i])}, "
                     f"com_m: {short(com[i])}, inertia_kg_m2: {short(inertia[i])}, known_to: {machine.known_to[i]}}}")
    return "\n".join(lines) + "\n"


def friction_lines(friction: list[tuple[float, float]], known_to: float, rng: np.random.Generator) -> list[str]:
    """What arm.yaml states of the friction of each joint."""
    lines = []
    for coulomb, viscous in friction:
        off = np.clip(rng.normal(size=2), -1.5, 1.5) * known_to
        lines.append(f"  - {{coulomb_Nm: {short(coulomb * (1 + off[0]))}, viscous_Nm_s: {short(viscous * (1 + off[1]))}, "
                     f"known_to: {known_to}}}")
    return lines
