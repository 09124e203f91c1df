"""Planar arms with their true values, and what arm.yaml states of them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
WATER = 998.0  # density of fresh water, kg/m3
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
    density: float = WATER
    viscosity: float = 1.0e-6
    gravity: float = 0.0
    known_to: float = 0.01
    remote: bool = False
    coulomb: Array | None = None
    viscous: Array | None = None
    rotor: Array | None = None
    friction_known_to: float = 0.1

    @property
    def links(self) -> int:
        """How many links there are."""
        return len(self.length)


def arm(length: list[float], diameter: list[float], mass: list[float], cd: list[float] | None = None,
        cm: list[float] | None = None, com_share: float = 0.5, **more: Any) -> Arm:
    """An arm of slender links whose inertia is that of a rod with some end fittings."""
    lengths, diameters, masses = (np.array(v, float) for v in (length, diameter, mass))
    inertia = masses * (lengths**2 / 12 * 1.08 + diameters**2 / 16)
    n = len(lengths)
    return Arm(lengths, diameters, masses, com_share * lengths, inertia, np.array(cd or [1.0] * n), np.array(cm or [0.9] * n), **more)


def tank_arm(rng: np.random.Generator, **more: Any) -> Arm:
    """A two-link arm for a tow tank, its sizes drawn around those of the published ones."""
    length, diameter = rng.uniform([0.45, 0.38], [0.68, 0.55]), rng.uniform([0.06, 0.05], [0.085, 0.07])
    mass = WATER * np.pi * diameter**2 / 4 * length * rng.uniform(0.6, 1.3, 2)
    return arm(list(length), list(diameter), list(mass), list(rng.uniform(0.8, 1.15, 2)), list(rng.uniform(0.65, 1.0, 2)),
               com_share=float(rng.uniform(0.46, 0.54)), **more)


def yaml_of(machine: Arm, name: str, rng: np.random.Generator) -> str:
    """The text of arm.yaml: every stated value lies within 1.7 standard uncertainties of the truth."""
    def stated_value(value: float, known: float) -> float:
        return float(value * (1 + known * np.clip(rng.normal(), -1.7, 1.7)))
    lines = ["schema: nnhydro/arm/1", f"name: arm of {name}",
             f"fluid: {{density_kg_m3: {machine.density}, kinematic_viscosity_m2_s: {machine.viscosity}}}"]
    if machine.gravity:
        lines.append(f"gravity_m_s2: {machine.gravity}")
    if machine.remote:
        lines.append("drive: {kind: remote, pulley_ratio: 1.0, angle2: absolute}")
    elif machine.rotor is not None:
        rotor = ", ".join(f"{stated_value(v, machine.friction_known_to):.6g}" for v in machine.rotor)
        lines.append(f"drive: {{kind: direct, rotor_inertia_kg_m2: [{rotor}], known_to: {machine.friction_known_to}}}")
    else:
        lines.append("drive: direct")
    if machine.coulomb is not None and machine.viscous is not None:
        known = machine.friction_known_to
        entries = [f"{{coulomb_Nm: {stated_value(c, known):.6g}, viscous_Nm_s: {stated_value(v, known):.6g}, known_to: {known}}}"
                   for c, v in zip(machine.coulomb, machine.viscous, strict=True)]
        lines.append(f"friction: [{', '.join(entries)}]")
    lines.append("links:")
    for i in range(machine.links):
        m, c, j = (stated_value(v[i], machine.known_to) for v in (machine.mass, machine.com, machine.inertia))
        lines.append(f"  - {{length_m: {machine.length[i]:.4f}, diameter_m: {machine.diameter[i]:.4f}, mass_kg: {m:.5g}, com_m: {c:.5g}, "
                     f"inertia_kg_m2: {j:.5g}, known_to: {machine.known_to}}}")
    return "\n".join(lines) + "\n"
