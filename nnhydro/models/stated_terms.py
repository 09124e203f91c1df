"""What arm.yaml states of friction and drives beforehand, as load terms: from a data sheet, or from a run in air.

    friction: [{coulomb_Nm: 0.12, viscous_Nm_s: 0.05, known_to: 0.2}, {}]        one entry per joint; what is left out is not stated
    drive: {rotor_inertia_kg_m2: [0.02, 0.01], known_to: 0.1}

Every baseline holds them, a calibrated one within what is known of them (fitting/linear/prior.py): each value is one standard deviation
of `known_to` times itself.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from nnhydro.physics.joints import DRY_WIDTH
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LoadTerm
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.rotor_inertia import RotorTerm
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.recordings.arm import Arm

Array = NDArray[np.float64]
STATED_COULOMB = "stated_coulomb_friction"
STATED_VISCOUS = "stated_viscous_friction"
STATED_INERTIA = "stated_rotor_inertia"
STATED: dict[str, Callable[[tuple[float, ...]], LoadTerm]] = {
    STATED_COULOMB: lambda level: CoulombTerm(level, DRY_WIDTH),
    STATED_VISCOUS: ViscousTerm,
    STATED_INERTIA: RotorTerm}


def stated_values(arm: Arm) -> dict[str, tuple[Array, Array]]:
    """Return value and standard deviation, each (joints,), of every term that arm.yaml states, by the term's name."""
    found: dict[str, tuple[Array, Array]] = {}
    for name, key in ((STATED_COULOMB, "coulomb"), (STATED_VISCOUS, "viscous")):
        values = np.array([getattr(joint, key) or 0.0 for joint in arm.friction or ()])
        if values.any():
            found[name] = (values, values * np.array([joint.known_to for joint in arm.friction or ()]))
    inertia = np.array(arm.drive.rotor_inertia_kg_m2 or ())
    if inertia.any():
        found[STATED_INERTIA] = (inertia, inertia * arm.drive.known_to)
    return found


def with_stated(loads: Loads, arm: Arm) -> Loads:
    """Return `loads` and the terms that arm.yaml states."""
    for name, (values, _) in stated_values(arm).items():
        loads = loads.plus(name, STATED[name](tuple(values.tolist())))
    return loads
