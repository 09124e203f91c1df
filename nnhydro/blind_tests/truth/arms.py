"""Random arms: what they are and what arm.yaml says of them. Masses, mass centres and inertias are drawn within `known_to`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from nnhydro.blind_tests.truth.world import Generator, TrueArm, TrueLink

MOST = 2.0  # standard deviations of `known_to` by which a true value may differ


def _link(rng: Generator, thick: float) -> TrueLink:
    """A random link of diameter `thick` m."""
    L, D = float(rng.uniform(0.2, 0.8)), thick
    D = float(np.clip(D, 0.03, min(0.1, L / 4)))
    mass = 1000 * np.pi * D**2 / 4 * L * rng.uniform(0.9, 2.2)
    return TrueLink(round(L, 3), round(D, 4), round(mass, 4), round(L * rng.uniform(0.38, 0.58), 4),
                    round(mass * L**2 / 12 * rng.uniform(0.8, 1.2), 6), float(rng.uniform(0.7, 1.3)), float(rng.uniform(0.5, 1.1)))


def draw_arm(rng: Generator, links: int, belt: bool) -> tuple[TrueArm, TrueArm, float]:
    """Return the true arm, the same as arm.yaml states it (its C_D and C_M mean nothing), and `known_to`."""
    thick = float(rng.uniform(0.035, 0.1))
    stated = [_link(rng, thick * 0.85**i) for i in range(links)]
    known_to = float(rng.choice([0.01, 0.02, 0.03, 0.05]))
    off = 1 + known_to * rng.standard_normal((links, 3)).clip(-MOST, MOST)
    true = [replace(link, mass=link.mass * o[0], com=link.com * o[1], inertia=link.inertia * o[2])
            for link, o in zip(stated, off, strict=True)]
    nu = float(rng.choice([1.0e-6, 1.14e-6, 1.3e-6]))
    return TrueArm(tuple(true), 1000.0, nu, belt), TrueArm(tuple(stated), 1000.0, nu, belt), known_to


def document(stated: TrueArm, known_to: float) -> dict[str, Any]:
    """Return what arm.yaml holds."""
    drive: Any = {"kind": "remote", "pulley_ratio": 1.0, "angle2": "absolute"} if stated.belt else "direct"
    links = [{"length_m": link.length, "diameter_m": link.diameter, "mass_kg": link.mass, "com_m": link.com, "inertia_kg_m2": link.inertia,
              "known_to": known_to} for link in stated.links]
    fluid = {"density_kg_m3": stated.rho, "kinematic_viscosity_m2_s": stated.nu}
    return {"schema": "nnhydro/arm/1", "name": "concealed-arm", "fluid": fluid, "drive": drive, "links": links}
