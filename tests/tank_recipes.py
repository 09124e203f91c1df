"""A recipe of a small tank, and how tests change it."""

import copy
from pathlib import Path
from typing import Any

from nnhydro.simulation.recipe.recipe import Recipe, parse_recipe

LINK = {"length_m": 0.5, "diameter_m": 0.06, "mass_kg": 1.2, "com_m": 0.25, "inertia_kg_m2": 0.025}
BASE: dict[str, Any] = {
    "schema": "nnhydro/recipe/1", "seed": 3, "sample_rate_hz": 100,
    "arm": {"fluid": {"density_kg_m3": 1000.0}, "links": [LINK, LINK]},
    "terms": {"normal_drag": {"C_D": [1.0, 0.9]}, "added_mass": {"C_M": 0.8}},
    "sensors": {"torque_noise_Nm": 0.02, "encoder_counts_per_rev": 65536},
    "motions": [
        {"kind": "slew", "name": "reach", "q_rad": [[0, 0], [1, -0.5]], "duration_s": 1.5},
        {"kind": "fourier", "name": "swim", "q_rad": [0, 0.3], "duration_s": 6, "reach_rad": 1.0, "rate_rad_s": 1.5,
         "carriage": {"u0_m_s": 0.3, "ramp_s": 0}},
        {"kind": "steady", "name": "grid", "u0_m_s": [0.3, 0.8], "q_rad": [[-0.5, 0.0, 0.5], [0.2]]},
        {"kind": "tow", "name": "last", "q_rad": [0.3, 0.1], "hold_s": 1, "carriage": {"u0_m_s": 0.5}},
    ],
    "unseen": ["last"],
}


def recipe(**changes: Any) -> Recipe:
    """The recipe with some keys changed."""
    return parse_recipe({**copy.deepcopy(BASE), **changes}, "recipe", Path())
