"""Hypothesis: the boundary layer remembers past accelerations."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.history_force import HistoryForce


@effect
@final
@dataclass(frozen=True)
class HistoryForceEffect(LoadEffect):
    """Basset's force across every link, one coefficient for the arm."""

    id = "history_force"
    family = "wake"
    cause = "viscous_history"
    name = "viscous memory (Basset force)"
    mechanism = "Friction drags a thickening layer of water along: past accelerations still act much later, and fade slowly."
    equation = "f = C_H 2 rho D sqrt(pi nu) int dw/dt' exp(-lambda (t - t')) / sqrt(t - t') dt'"
    source = ("Stokes' first problem, its wall friction summed over past steps: http://cryer.org.uk/Basset_force; a kernel that fades: "
              "Mei & Adrian (1992), as in Jaganathan et al. (2023), Front. Phys., "
              "https://frontiersin.org/articles/10.3389/fphy.2023.1167338/full, section 2.1; the rest is ours "
              "(physics/loads/history_force.py)")
    signature = Signature(
        depends_on=("dw", "t"), parity="odd", region="after quick starts and stops, fading with 1/sqrt(t)",
        excited_by="quick starts and stops with long holds between",
        mistaken_for=("added_mass", "wake_development", "flow_memory", "viscous_friction"),
    )
    acts = "arm"
    needs_water = True

    C_H: Values = parameter("1", 1.0, (0.0, 200.0), "history coefficient (1: thin laminar boundary layer)", per="arm")
    decay: Values = parameter("1/s", 0.0, (0.0, 100.0), "rate lambda at which the flow carries the memory away (0: Basset's)", per="arm",
                              linear=False, grid=(0.0, 1.0, 8.0))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d C_H, (n, joints, 1)."""
        return HistoryForce(self.C_H, self.decay).columns(flow).sum(-1, keepdim=True)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        fades = f" It fades at a rate of {text['decay']}." if any(self.decay) else ""
        return f"The Basset history force acts on the links, with C_H = {text['C_H']} (1 for a laminar boundary layer).{fades}"
