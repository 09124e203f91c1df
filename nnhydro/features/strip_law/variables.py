"""Variables of a strip's state: what its wake remembers, its Reynolds number, where on the link it lies, how the arm is bent.

    memory    2 m w/(m^2 + w^2), (w^2 - m^2)/(m^2 + w^2)     for the short and the long memory m (wake.py): 1, 0 where the flow has lasted
    reynolds  log10(1 + |w| D/nu / 1e3) - 1
    span      exp(-(L - x)/D) near the outer end, x/L, and the place of the link in the arm, -1 first to 1 last
    bend      mean cosine of the angles with the links next to it

Source: McLain & Rock (1998), eq. (1) (travel), Rivera (1995), eqs. 3-1-24, 3-1-44 (Reynolds number, ends, planar angle); forms ours.
"""

import torch
from torch import Tensor

from nnhydro.features.groups import RE0
from nnhydro.features.strip_law.state import StripView, state_set
from nnhydro.features.wake import STILL, ends


@state_set("memory", degree=3)
def memory(view: StripView) -> Tensor:
    """Return two variables for the short and the long memory."""
    w, found = view.w, []
    for m in ends(view.wake):
        size = m**2 + w**2 + STILL**2
        found += [2 * m * w / size, (w**2 - m**2) / size]
    return torch.stack(found, dim=2)


@state_set("reynolds")
def reynolds(view: StripView) -> Tensor:
    """Return the logarithm of the Reynolds number."""
    return (torch.log10(1 + view.w.abs() * view.flow.D[:, None] / view.flow.nu / RE0) - 1)[:, :, None]


@state_set("span")
def span(view: StripView) -> Tensor:
    """Return three variables of the strip's place."""
    flow = view.flow
    outer = torch.exp(-(flow.L[:, None] - view.x) / flow.D[:, None])
    n = flow.arm.n_links
    link = torch.linspace(-1.0, 1.0, n, dtype=torch.float64) if n > 1 else torch.zeros(1, dtype=torch.float64)
    place = torch.stack([outer, view.x / flow.L[:, None], link[:, None].expand_as(view.x)], dim=1)
    return place.expand(len(view.w), -1, -1, -1)


@state_set("bend")
def bend(view: StripView) -> Tensor:
    """Return the mean cosine of the angles with the neighbours, 1 for an arm of one link."""
    cos = torch.cos(view.flow.motion.q)
    inner, outer = cos[:, 1:], torch.ones_like(cos[:, :1])
    before, after = torch.cat([inner[:, :1], inner], dim=1), torch.cat([inner, inner[:, -1:]], dim=1)
    mean = (before + after) / 2 if inner.shape[1] else outer
    return mean[:, :, None, None].expand(-1, -1, 1, view.x.shape[1])
