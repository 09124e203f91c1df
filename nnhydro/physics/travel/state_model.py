"""The state-dependent model as a sum of load terms: rigid body + C_D(s/D) + C_M(s/D), one travel scale tau_s for both curves.

    tau = rigid body + state_drag + (state_at_rest + state_added_mass)         [N m]

Linear in the twelve ordinates (and the rigid body) for a given tau_s. Source: McLain & Rock (1998), eqs. (32), (33).
"""

from dataclasses import replace
from typing import Any

import torch
from torch import Tensor

from nnhydro.errors import ModelError, require
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LoadTerm
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.loads.travel_added_mass import BsplineAddedMass, StateAddedMass, StateAtRest
from nnhydro.physics.loads.travel_drag import BsplineDrag, StateDrag
from nnhydro.physics.travel.term import TravelTerm
from nnhydro.recordings.arm import Arm


def _per_link(term: LoadTerm, links: int) -> LoadTerm:
    """The term with each ordinate repeated a link."""
    return replace(term, **{field.name: getattr(term, field.name) * links for field in term.parameters() if field.metadata["linear"]})


def state_loads(arm: Arm, tau_s: float = 8.0, curve_per_link: bool = False, **options: Any) -> Loads:
    """Return the model with the start values of figure 7; `options` go to every travel term (per_link, laws, at_reversal, ...).

    `curve_per_link` gives each link curves of its own instead of one pair for the arm.
    """
    drag: LoadTerm = replace(StateDrag.at_start(arm, **options), tau_s=(tau_s,))
    added: LoadTerm = replace(StateAddedMass.at_start(arm, **options), tau_s=(tau_s,))
    if curve_per_link:
        drag, added = _per_link(drag, arm.n_links), _per_link(added, arm.n_links)
    return Loads({"rigid_body": RigidBody.of_arm(arm), "state_drag": drag, "state_added_mass": added,
                  "state_at_rest": replace(StateAtRest.at_start(arm, **options), tau_s=(tau_s,))})


def bspline_loads(arm: Arm, count: int = 8, tau_s: float = 10.0, **options: Any) -> Loads:
    """Return the model with `count` B-splines a curve instead of the paper's six points."""
    require(count >= 1, f"{count} B-splines: give at least 1", ModelError)
    return Loads({"rigid_body": RigidBody.of_arm(arm), "bspline_drag": BsplineDrag((0.8,) * count, (tau_s,), **options),
                  "bspline_added_mass": BsplineAddedMass((0.4,) * count, (tau_s,), **options),
                  "state_at_rest": StateAtRest((1.0,), (tau_s,), count, **options)})


def with_tau_s(loads: Loads, tau_s: float, added_mass: float | None = None) -> Loads:
    """Return `loads` with the travel scale of every term that has one set to `tau_s`; `added_mass` gives C_M a scale of its own."""
    def at_scale(term: LoadTerm) -> LoadTerm:
        """Return `term` with its travel scale, where it has one."""
        if not any(declaration.name == "tau_s" for declaration in term.parameters()):
            return term
        scale = added_mass if added_mass is not None and "drag" not in term.kind else tau_s
        changed: dict[str, Any] = {"tau_s": (scale,)}
        return replace(term, **changed)

    return Loads({name: at_scale(term) for name, term in loads.terms.items()})


def has_travel_scale(loads: Loads) -> bool:
    """Return True where a term has a travel scale tau_s to be searched."""
    return any(declaration.name == "tau_s" for term in loads.terms.values() for declaration in term.parameters())


def _curve(loads: Loads, s_over_D: Tensor, link: int, added_mass: bool) -> Tensor | None:
    parts = [term.curve(s_over_D, link) for term in loads.terms.values() if isinstance(term, TravelTerm) and term.added_mass == added_mass]
    return torch.stack(parts).sum(0) if parts else None


def drag_curve(loads: Loads, s_over_D: Tensor, link: int = 0) -> Tensor:
    """Return C_D at the travels `s_over_D` (...) of `link` (from 0); raises ModelError where `loads` has no such curve."""
    curve = _curve(loads, s_over_D, link, added_mass=False)
    if curve is None:
        raise ModelError("the model has no drag curve over the travel: state_loads(arm) makes one")
    return curve


def added_mass_curve(loads: Loads, s_over_D: Tensor, link: int = 0) -> Tensor:
    """Return C_M at the travels `s_over_D` (...) of `link` (from 0), its known start included; raises ModelError where there is none."""
    curve = _curve(loads, s_over_D, link, added_mass=True)
    if curve is None:
        raise ModelError("the model has no added-mass curve over the travel: state_loads(arm) makes one")
    return curve
