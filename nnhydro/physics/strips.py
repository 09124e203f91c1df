"""Each link cut into equal strips: loads that vary along the span are summed at the middles of the strips.

    F_i  = sum_s f_is ds_i                                  [N], along n_i
    Mo_i = sum_s f_is x_is ds_i                             [N m], about the link's own joint
    x_is = (s + 1/2) ds_i,  ds_i = L_i / S                  [m]

    f_is  normal force per length at the middle of strip s, as the drive must supply it                 [N/m]
    w_is, dw_is  normal velocity A_i x + B_i and its derivative in the link's frame, M_i x + N_i       [m/s, m/s^2]

The sum converges at second order in 1/S where f is smooth along the link. Where the velocity changes sign on the link, drag has a kink in
its slope there; the error stays of second order in size but no longer falls smoothly. A load that is constant along the link is exact in
force and moment, one that is linear is exact in force. Use it where a coefficient differs from strip to strip; the closed forms in
physics/loads are exact for constant ones. Source: McLain & Rock (1998), eqs. 28 to 32 (midpoints: ours).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import final

import torch
from torch import Tensor

from nnhydro.errors import require
from nnhydro.physics.flow import Flow


@final
@dataclass(frozen=True, eq=False)
class Strips:
    """`per_link` equal strips on every link of the arm of `flow`."""

    flow: Flow
    per_link: int = 10

    def __post_init__(self) -> None:
        require(self.per_link >= 1, f"{self.per_link} strips per link: at least 1 is needed, 10 are usual")

    @staticmethod
    def of(flow: Flow, per_link: int = 10) -> "Strips":
        """Return the strips of `flow`."""
        return Strips(flow, per_link)

    @cached_property
    def ds(self) -> Tensor:  # (links,) m
        """Length of a strip of each link."""
        return self.flow.L / self.per_link

    @cached_property
    def x(self) -> Tensor:  # (links, s) m
        """Distance of each strip's middle from the link's own joint."""
        places = torch.arange(self.per_link, dtype=torch.float64) + 0.5
        return self.flow.memo.of((Strips, "x", self.per_link), lambda: self.ds[:, None] * places)

    @cached_property
    def w(self) -> Tensor:  # (n, links, s) m/s
        """Normal velocity A x + B of each strip."""
        return self.flow.memo.of((Strips, "w", self.per_link), lambda: self.flow.A[..., None] * self.x + self.flow.B[..., None])

    @cached_property
    def dw(self) -> Tensor:  # (n, links, s) m/s^2
        """Normal acceleration M x + N of each strip, in the link's frame."""
        return self.flow.memo.of((Strips, "dw", self.per_link), lambda: self.flow.M[..., None] * self.x + self.flow.N[..., None])

    def force_moment(self, f: Tensor) -> tuple[Tensor, Tensor]:  # (n, links) N, (n, links) N m
        """Return the force along n_i and the moment about the link's own joint of `f` (n, links, s) N/m."""
        return f.sum(-1) * self.ds, (f * self.x).sum(-1) * self.ds

    def to_joints(self, f: Tensor) -> Tensor:  # (n, joints, links) N m
        """Return the joint torques of `f` (n, links, s) N/m, one column per link."""
        return self.flow.normal_columns(*self.force_moment(f))
