"""Hypothesis: the inertia of the water is missing."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.added_mass import AddedMass


@effect
@final
@dataclass(frozen=True)
class AddedMassEffect(LoadEffect):
    """Added mass across each link, one coefficient per link."""

    id = "added_mass"
    family = "inertia"
    name = "added mass"
    mechanism = "A link that accelerates must accelerate the water around it, too, and so feels heavier across its axis than along it."
    equation = "tau_j = sum_i C_M,i rho pi D_i^2/4 int (M_i x + N_i) b_ji dx"
    source = "Rivera (1995), eqs. 3-1-31 to 3-1-39; McLain & Rock (1998), eq. (1)"
    signature = Signature(
        depends_on=("q", "qd", "qdd", "u0", "du0"), parity="odd", region="strong acceleration across the link",
        excited_by="quick starts and stops", mistaken_for=("rotor_inertia", "payload_mass", "wake_development", "history_force"),
    )
    acts = "arm"
    needs_water = True

    C_M: Values = parameter("1", 0.8, (0.0, 5.0), "added-mass coefficient across the link (ideal 1)")

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d C_M, (n, joints, links)."""
        return AddedMass(self.C_M).columns(flow)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"The links accelerate the water around them: added mass {', '.join(f'{name} = {value}' for name, value in text.items())}."
