"""What the wake remembers: a causal average of the flow past each station of a link over the distance travelled.

    dm/ds = (w - m)/(lambda D),   ds = |w| dt,      lambda = 1, 2, 3 and 5 diameters         [m/s]

A station that starts from rest has m = 0 and reaches w after a few lambda; after a reversal m still has the old sign. It is the travel
s/D of McLain & Rock in a form that needs no rule for reversals: from rest at constant acceleration m/w is a function of s/D alone.
Steady runs, and runs that begin under tow, have m = w.

Source: McLain & Rock (1998), eq. (1) (coefficients depend on s/D); the average is ours.
"""

import torch
from torch import Tensor

from nnhydro.features.feature_set import Features, View, feature_set
from nnhydro.physics.carried import Carried
from nnhydro.physics.flow import Flow
from nnhydro.physics.transmission import to_drives
from nnhydro.physics.wake_memory import relaxed

STRIPS = 10  # a link; McLain & Rock found no gain beyond four
MEMORIES = (1.0, 2.0, 3.0, 5.0)  # diameters, from the vortex pair's growth to the street's
LARGE = 10.0  # bound of the scaled torques; steady flow gives up to about 3
STILL = 5e-3  # m/s: below it a station counts as at rest


def stations(flow: Flow, per_link: int = STRIPS) -> Tensor:
    """Return the middles x (links, s) m of equal strips."""
    return flow.L[:, None] * (torch.arange(per_link, dtype=torch.float64) + 0.5) / per_link


def under_way(flow: Flow) -> bool:
    """Return whether the arm was under way through the water before the recording began: under tow, on a moving base or in a current."""
    rx, ry = flow.through_water[:2]
    return bool(torch.hypot(rx[0], ry[0]).max() > STILL)


def each_under_way(flow: Flow) -> Tensor:
    """Return whether each row (n,) is of an arm whose base moves through the water: a run that begins so has begun earlier."""
    rx, ry = flow.through_water[:2]
    return torch.hypot(rx, ry).amax(dim=1) > STILL


def memories(flow: Flow, x: Tensor) -> tuple[Tensor, list[Tensor]]:
    """Return w (n, links, s) m/s at the stations x (links, s) m and m for each memory."""
    w = flow.A[:, :, None] * x + flow.B[:, :, None]
    if flow.motion.wake is not None:
        return w, list(flow.motion.wake)
    if flow.motion.carried is not None:
        return w, list(_carried_memories(flow, flow.motion.carried, w).unbind(1))
    if flow.motion.steady or len(flow.motion) < 2:
        return w, [w for _ in MEMORIES]
    dt = torch.diff(flow.motion.t, prepend=flow.motion.t[:1])
    every = w[:, None].expand(-1, len(MEMORIES), -1, -1)
    start = every[0] if under_way(flow) else torch.zeros_like(every[0])
    travel = (w.abs() * dt[:, None, None] / flow.D[:, None])[:, None] / torch.tensor(MEMORIES, dtype=torch.float64)[:, None, None]
    return w, list(relaxed(every, travel, start).unbind(1))


def _carried_memories(flow: Flow, carried: Carried, w: Tensor) -> Tensor:
    """m (n, memories, links, s) of arms that are stepped through time; w (n, links, s) m/s."""
    every = w[:, None].expand(-1, len(MEMORIES), -1, -1)
    lengths = torch.tensor(MEMORIES, dtype=torch.float64)[:, None, None]
    moves = each_under_way(flow)[:, None, None, None]

    def following(old: Tensor) -> Tensor:
        path = w.abs() * carried.steps(3) / flow.D[:, None]
        return every + (old - every) * torch.exp(-path[:, None] / lengths)

    return carried.value(f"wake/{w.shape[2]}", lambda: torch.where(moves, every, torch.zeros_like(every)), following)


def ends(remembered: list[Tensor]) -> tuple[Tensor, Tensor]:
    """Return the shortest and the longest memory."""
    return remembered[0], remembered[-1]


@feature_set("wake")
def wake(view: View) -> Features:
    """Return, for two memories, the scaled drag torques with one or both speeds taken from the wake, and m against w near the tips.

    odd:  x/sqrt(1 + (x/LARGE)^2), x the torques of 1/2 rho D {|m| w, |w| m, |m| m} over the links divided by the Morison scale, which
          knows nothing of the motion before: where a link stops in the wake of a fast motion x alone has no bound
    even: 2 m w/(m^2 + w^2) at 0.55 and 0.95 of each link
    """
    flow = view.flow
    x = stations(flow)
    w, remembered = memories(flow, x)
    pressure = 0.5 * flow.rho * flow.D[:, None] * flow.L[:, None] / STRIPS
    odd, even = [], []
    for m in ends(remembered):
        for product in (m.abs() * w, w.abs() * m, m.abs() * m):
            load = pressure * product
            torque = flow.normal_columns(load.sum(dim=2), (load * x).sum(dim=2)).sum(dim=2)
            scaled = to_drives(torque, flow.arm) / view.scale
            odd.append(scaled / torch.hypot(torch.ones_like(scaled), scaled / LARGE))
        tips = torch.tensor([STRIPS // 2, STRIPS - 1])
        agreement = 2 * m * w / (m**2 + w**2 + STILL**2)
        even.append(agreement[:, :, tips].flatten(1))
    return Features(torch.cat(odd, dim=1), torch.cat(even, dim=1))
