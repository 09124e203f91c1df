"""How far and how long each link end has moved since it last turned back, and its speed through slow eyes: causal, from rows before alone.

    travel    s/(s + D c), c = 1 and 5, and t/(t + 1 s), at both ends of every link; s, t since the last reversal of that end
    low-pass  m/sqrt(m^2 + V^2 + STILL^2), dm/dt = (w - m)/T, T = 0.1 and 0.5 s, at both ends

An end has turned back once it has come back by BACK diameters from the farthest point of its way; s and t count from there. Runs that
begin under tow, and steady ones, have long moved at that speed: s and t are infinite, m = w.

Source: McLain & Rock (1998), eq. (1) (s/D); the rest is ours.
"""

import numpy as np
import torch
from torch import Tensor

from nnhydro.features.feature_set import Features, View, feature_set
from nnhydro.features.scaling import speed_scale
from nnhydro.features.wake import STILL, each_under_way, under_way
from nnhydro.physics.carried import StepMemory
from nnhydro.physics.flow import Flow
from nnhydro.physics.travel.step import FOREVER
from nnhydro.physics.travel.travel import BACK
from nnhydro.physics.travel.wake_memory import relax

SPANS = (1.0, 5.0)  # diameters
WHILE = 1.0  # s
LAGS = (0.1, 0.5)  # s


def end_speeds(flow: Flow) -> Tensor:
    """Return the normal speed of the inner and the outer end of every link, (n, links, 2) m/s."""
    return torch.stack([flow.B, flow.A * flow.L + flow.B], dim=2)


def since_reversal(flow: Flow) -> tuple[Tensor, Tensor]:
    """Return travel (m) and time (s) since each link end last turned back, (n, links, 2); infinite before, where it was under way."""
    w = end_speeds(flow)
    if flow.motion.carried is not None:
        return _carried_since(flow, flow.motion.carried, w)
    if flow.motion.steady or len(w) < 2:
        return torch.full_like(w, torch.inf), torch.full_like(w, torch.inf)
    steps = torch.diff(flow.motion.t, prepend=flow.motion.t[:1]).numpy()
    moved, back = w.numpy() * steps[:, None, None], BACK * flow.D.numpy()[:, None]
    s, t = np.empty_like(moved), np.empty_like(moved)
    place = farthest = heading = np.zeros_like(moved[0])
    now = ago = np.zeros_like(moved[0])  # travel and time since the farthest point
    travelled = since = np.full_like(moved[0], np.inf if under_way(flow) else 0.0)
    for k, (step, dt) in enumerate(zip(moved, steps, strict=True)):
        place, travelled, since, now, ago = place + step, travelled + np.abs(step), since + dt, now + np.abs(step), ago + dt
        turned = (heading * (farthest - place) > back) & (heading != 0)
        travelled, since = np.where(turned, now, travelled), np.where(turned, ago, since)
        heading = np.where(turned, -heading, np.where((heading == 0) & (np.abs(place) > back), np.sign(place), heading))
        ahead = heading * (place - farthest) >= 0
        farthest, now, ago = np.where(ahead, place, farthest), np.where(ahead, 0.0, now), np.where(ahead, 0.0, ago)
        s[k], t[k] = travelled, since
    return torch.from_numpy(s), torch.from_numpy(t)


def _carried_since(flow: Flow, carried: StepMemory, w: Tensor) -> tuple[Tensor, Tensor]:
    """Travel and time since each link end of arms that are stepped through time last turned back, (n, links, 2)."""
    dt, back = carried.steps(3), BACK * flow.D[:, None]

    def start() -> Tensor:
        """Return the memory (n, links, 2, 6) of a run's first instant: what moves has long moved at that speed."""
        none = torch.zeros_like(w)
        moved = torch.where(each_under_way(flow)[:, None, None], torch.full_like(w, FOREVER), none)
        return torch.stack([moved, moved, none, none, none, none], dim=-1)

    def next_memory(old: Tensor) -> Tensor:
        """Return the memory (n, links, 2, 6) after a step of `dt` s with the speeds `w` m/s of the links' ends."""
        step = w * dt
        s, t, ahead, heading, now, ago = old.unbind(-1)  # ahead: how far the end is beyond its farthest point, 0 or less
        along = torch.where(heading == 0, step, heading * step)
        s, t, now, ago, ahead = s + step.abs(), t + dt, now + step.abs(), ago + dt, ahead + along
        turned = (heading != 0) & (ahead < -back)
        s, t = torch.where(turned, now, s), torch.where(turned, ago, t)
        begins = (heading == 0) & (ahead.abs() > back)
        heading = torch.where(turned, -heading, torch.where(begins, torch.sign(ahead), heading))
        ahead = torch.where(turned, -ahead, torch.where(begins, ahead.abs(), ahead))
        farthest = (heading != 0) & (ahead >= 0)
        ahead, now, ago = (torch.where(farthest, torch.zeros_like(x), x) for x in (ahead, now, ago))
        return torch.stack([s, t, ahead, heading, now, ago], dim=-1)

    found = carried.value("reversal", start, next_memory)
    return found[..., 0], found[..., 1]


@feature_set("travel")
def travel(view: View) -> Features:
    """Return 6 even ones a link."""
    flow = view.flow
    s, t = since_reversal(flow)
    D = flow.D[:, None]
    even = [*(1 - c * D / (s + c * D) for c in SPANS), 1 - WHILE / (t + WHILE)]
    joined = torch.cat([x.flatten(1) for x in even], dim=1)
    return Features(joined[:, :0], joined)


def _carried_low_pass(flow: Flow, carried: StepMemory, w: Tensor, lag: float) -> Tensor:
    moves = each_under_way(flow)[:, None, None]
    return carried.value(f"low-pass/{lag}", lambda: torch.where(moves, w, torch.zeros_like(w)),
                         lambda old: w + (old - w) * torch.exp(-carried.steps(3) / lag))


@feature_set("low-pass")
def low_pass(view: View) -> Features:
    """Return 4 odd ones a link."""
    flow = view.flow
    w = end_speeds(flow)
    V = speed_scale(flow)[:, :, None]
    odd = []
    for lag in LAGS:
        m = w
        if flow.motion.carried is not None:
            m = _carried_low_pass(flow, flow.motion.carried, w, lag)
        elif not flow.motion.steady and len(w) > 1:
            step = torch.diff(flow.motion.t, prepend=flow.motion.t[:1])[:, None, None].expand_as(w)
            m = relax(w, step / lag, w[0] if under_way(flow) else torch.zeros_like(w[0]))
        odd.append((m / torch.sqrt(m**2 + V**2 + STILL**2)).flatten(1))
    joined = torch.cat(odd, dim=1)
    return Features(joined, joined[:, :0])
