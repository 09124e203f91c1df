"""What the load terms share whose coefficients depend on the travel of each strip.

    C_D(x, t) = sum_k c_k phi_k(s/D) g(x, t),    columns: d tau / d c_k                  [N m]
    f_D = 1/2 rho D |w| w,   f_M = rho pi D^2/4 dw                                      [N/m for coefficient 1]

The ordinates c_k are shared by all links (a curve of the arm, as McLain & Rock's global average curve) or, where a parameter has a value a
link, each link's own. g is the product of the coefficient laws in `laws`.
Source: McLain & Rock (1998), eqs. (28) to (32), with the opposite sign (LOAD).
"""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar
from weakref import WeakKeyDictionary

import torch
from torch import Tensor

from nnhydro.errors import ModelError, require
from nnhydro.physics.coefficients.law import StripState, factors, law_of
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LoadTerm
from nnhydro.physics.loads.added_mass import displaced_mass
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.step import carried_travel
from nnhydro.physics.travel.travel import TravelRule, travel

PIECE = 1024  # rows: the basis of all strips in them stays in the cache, and memory does not grow with the basis of a long recording
_TRAVELS: WeakKeyDictionary[Flow, dict[tuple[int, TravelRule], Tensor]] = WeakKeyDictionary()  # the terms of a sum share it


def travel_of(strips: Strips, rule: TravelRule) -> Tensor:
    """Return s/D (n, links, s) of every strip, computed once a flow."""
    found = _TRAVELS.setdefault(strips.flow, {})
    key = (strips.per_link, rule)
    if key not in found:
        carried = strips.flow.motion.carried
        path = travel(strips, rule) if carried is None else carried_travel(strips, rule, carried)
        found[key] = path / strips.flow.D[:, None]
    return found[key]


def unit_drag(strips: Strips) -> Tensor:
    """Return f_D (n, links, s) N/m for C_D = 1."""
    return 0.5 * strips.flow.rho * strips.flow.D[:, None] * strips.w.abs() * strips.w


def unit_inertia(strips: Strips) -> Tensor:
    """Return f_M (n, links, s) N/m for C_M = 1 (document reading of the acceleration)."""
    return displaced_mass(strips.flow)[:, None] * strips.dw


def _to_joints(strips: Strips, both: Tensor) -> Tensor:
    """Joint torques (n, joints, links, p) of the sums over strips `both` (n, links, 2, p) of f phi_k and f x phi_k [N/m, N]."""
    scaled = both * strips.ds[:, None, None]
    force, moment = scaled[:, None, :, 0], scaled[:, None, :, 1]
    return strips.flow.outboard[..., None] * moment + strips.flow.lever_normal[..., None] * force


def strip_columns(strips: Strips, f: Tensor, phi: Tensor) -> Tensor:
    """Return the joint torques (n, joints, links, p) of the loads f phi_k, `f` (n, links, s) N/m and `phi` (n, links, s, p)."""
    return _to_joints(strips, torch.stack([f, f * strips.x], dim=2) @ phi)


@dataclass(frozen=True)
class TravelTerm(LoadTerm):
    """A term with coefficients over the travel: the options of strips, travel rule and laws. See `TravelRule` for the last three."""

    added_mass: ClassVar[bool]  # True: the coefficient is C_M; False: C_D
    per_link: int = field(default=10, kw_only=True)  # strips per link
    laws: tuple[str, ...] = field(default=(), kw_only=True)
    at_reversal: str = field(default="reset", kw_only=True)
    memory: float = field(default=5.0, kw_only=True)
    dwell_s: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "laws", tuple(self.laws))
        TravelRule(self.at_reversal, self.memory, self.dwell_s)
        for law in self.laws:
            law_of(law)

    @abstractmethod
    def curve(self, s_over_D: Tensor, link: int = 0) -> Tensor:
        """Return the term's part of the coefficient (...) at the travels `s_over_D` (...) of `link` (from 0), before any law."""

    @abstractmethod
    def pieces(self) -> tuple[float, int]:
        """Return the travel in diameters from which the curve is constant, and of how many equal cubic pieces it is made up to there."""

    def state(self, flow: Flow) -> StripState:
        """Return strips and their travel."""
        strips = Strips.of(flow, self.per_link)
        return StripState(strips, travel_of(strips, TravelRule(self.at_reversal, self.memory, self.dwell_s)))

    def unit_load(self, state: StripState, added_mass: bool) -> Tensor:
        """Return f_D or f_M times the laws' factors, (n, links, s) N/m."""
        drag, inertia = factors(self.laws, state)
        return unit_inertia(state.strips) * inertia if added_mass else unit_drag(state.strips) * drag

    def basis_columns(self, flow: Flow, basis: Callable[[Tensor], Tensor]) -> Tensor:
        """Return the joint torques (n, joints, links, p) of the term's load times each of `basis`(s/D) (..., p), rows piece by piece."""
        state = self.state(flow)
        f = self.unit_load(state, self.added_mass)
        weights = torch.stack([f, f * state.strips.x], dim=2)  # (n, links, 2, s)
        pieces = zip(torch.split(weights, PIECE), torch.split(state.s_over_D, PIECE), strict=True)
        both = torch.cat([rows @ basis(s_over_D) for rows, s_over_D in pieces])
        return _to_joints(state.strips, both)

    def arrange_columns(self, columns: Tensor, sizes: tuple[int, ...]) -> Tensor:
        """Return columns (n, joints, p) of (n, joints, links, K), K parameters of `sizes` values: 1 for the arm, else one per link."""
        links = columns.shape[2]
        wrong = [size for size in sizes if size not in (1, links)]
        require(not wrong, f"term {self.kind!r}: a parameter has {wrong[:1]} values: give 1, or {links}, one per link", ModelError)
        parts = [columns[..., k].sum(2, keepdim=True) if size == 1 else columns[..., k] for k, size in enumerate(sizes)]
        return torch.cat(parts, dim=2)
