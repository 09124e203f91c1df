"""The travel of each strip (travel.py) from one instant to the next, for arms that are stepped through time.

Remembered of a strip: its path since its velocity last vanished and since s began, the direction of its last motion that counts, whether it
has moved for ever, s_0 of the rule `decay`, and how long it has stood still; of a link: phi, A and B. A strip faster than STILL at the
first instant is taken to have moved for ever: of its peak speed nothing is known yet.
"""

import torch
from torch import Tensor

from nnhydro.physics.carried import StepMemory
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.travel import BACK, STILL, TravelRule

FOREVER = 1e6  # m: instead of infinity, which matrices with zeros in them do not survive
Z, R, HEADING, EVER, S_0, PAUSE = range(6)


def _path(strips: Strips, link: Tensor, dt: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """w before, path since then, whether the velocity vanished on the way, and the path since it did; (n, links, s) each."""
    flow, w = strips.flow, strips.w
    phi, A, B = link.unbind(-1)
    w_before = A[..., None] * strips.x + B[..., None]
    straight = (strips.x * (flow.phi - phi)[..., None] + ((flow.B + B) / 2)[..., None] * dt).abs()
    before, after = w_before.abs(), w.abs()
    half = dt / 2 / (before + after + 1e-12)
    crossing = w_before * w < 0
    return w_before, torch.where(crossing, (before**2 + after**2) * half, straight), crossing, after**2 * half


def _strip(strips: Strips, rule: TravelRule, old: Tensor, link: Tensor, dt: Tensor) -> Tensor:
    """What a strip remembers (n, links, s, 6), from what it remembered."""
    w, D = strips.w, strips.flow.D[:, None]
    z, r, heading, ever, s_0, pause = old.unbind(-1)
    w_before, onward, crossing, since_crossing = _path(strips, link, dt)
    z = torch.where(crossing, since_crossing, torch.where(w_before == 0, onward, z + onward))
    r = r + onward
    moving = w.abs() > STILL
    turned = (w * heading <= 0) & moving & (z > BACK * D)
    first, back = turned & (heading == 0), turned & (heading != 0)
    restarts = first if rule.at_reversal == "keep" else turned
    if rule.at_reversal == "decay":
        stroke = r - torch.minimum(r, z)
        s_0 = torch.where(back, stroke + s_0 * torch.exp(-stroke / (rule.memory * D)), s_0)
    heading = torch.where(turned, torch.sign(w), heading)
    r = torch.where(restarts | (heading == 0), torch.minimum(r, z), r)
    ever = torch.where(back & restarts, torch.zeros_like(ever), ever)
    if rule.dwell_s > 0:
        pause = torch.where(moving, torch.zeros_like(pause), pause + dt)
        rests = pause > rule.dwell_s
        r, ever, s_0 = (torch.where(rests, torch.zeros_like(x), x) for x in (r, ever, s_0))
    return torch.stack([z, r, heading, ever, s_0, pause], dim=-1)


def carried_travel(strips: Strips, rule: TravelRule, carried: StepMemory) -> Tensor:
    """Return s (n, links, s) in metres of every strip; FOREVER where it has moved for ever."""
    name, flow, dt = f"travel/{strips.per_link}/{rule}", strips.flow, carried.steps(3)
    now = torch.stack([flow.phi, flow.A, flow.B], dim=-1)
    before = None if carried.before is None else carried.before[f"{name}/link"]

    def start() -> Tensor:
        none = torch.zeros_like(strips.w)
        return torch.stack([none, none, none, (strips.w.abs() > STILL).to(none.dtype), none, none], dim=-1)

    def next_memory(old: Tensor) -> Tensor:
        assert before is not None
        return _strip(strips, rule, old, before, dt)

    strip = carried.value(name, start, next_memory)
    carried.value(f"{name}/link", lambda: now, lambda _: now)
    _, r, _, ever, s_0, _ = strip.unbind(-1)
    since = torch.where(ever > 0, torch.full_like(r, FOREVER), r)
    return since + s_0 * torch.exp(-since / (rule.memory * flow.D[:, None])) if rule.at_reversal == "decay" else since
