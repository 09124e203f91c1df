"""Hypothesis: a link that moves obliquely through the water is turned across the flow."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.added_mass import attached_flow


@effect
@final
@dataclass(frozen=True)
class MunkMoment(LoadEffect):
    """The part of the water's inertia that depends on speed along a link: attached flow has all of it, a separated wake less."""

    id = "munk_moment"
    family = "inertia"
    name = "Munk moment"
    mechanism = ("Water that flows obliquely past a link turns it across the flow, because the pressure differs between its ends. Strips, "
                 "each with its own flow, do not show this. A separated wake takes most of it away.")
    equation = "tau_j = s sum_i rho pi D_i^2/4 (A_i L_i^2/2 + B_i L_i) (u_x,i - A_i a_ji),  a_ji the lever of an axial load"
    source = ("moment on a body in steady translation (Munk moment): MIT fluids modules, lecture 12, after Newman (1977), section 4.13, "
              "http://web.mit.edu/fluids-modules/www/potential_flows/LecturesHTML/lec12/node1.html; links that turn: "
              "Lagrange's equations on the energy of the strips (the energy reading of added mass), ours")
    signature = Signature(
        depends_on=("q", "qd", "u0"), parity="odd", region="oblique motion: speed along a link and across it at once",
        excited_by="towing with the links at 30 to 60 degrees to the flow",
        mistaken_for=("wall_proximity", "axial_drag", "link_interference"),
    )
    acts = "arm"
    needs_water = True

    share: Values = parameter("1", 0.2, (-1.5, 1.5), "of the moment in attached flow (C_M = 1)", per="arm")

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d share, (n, joints, 1) N m."""
        return attached_flow(flow).sum(-1, keepdim=True)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"Oblique flow turns the links (Munk moment): {text['share']} of that of attached flow."
