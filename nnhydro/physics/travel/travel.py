"""How far each strip has travelled through the water since its last start or reversal: the argument of McLain & Rock's curves.

    s(x, t) = int |w(x, t')| dt'   from the last start or reversal of that strip to t                    [m]

Each strip counts for itself, so the two sides of the zero-velocity point x = -B/A reverse at different times. A step of time without a
change of sign adds |x dphi + int B dt|, exact for pure rotation (the angle is known) and a trapezoid for the rest; a step with one is
split where the linearly interpolated velocity vanishes.

What happens at a reversal is an assumption, for the paper has none (rest to rest, one way):
    reset   s starts again from 0: the old wake is forgotten at once (the default)
    keep    s goes on: the old wake counts as much as a new one
    decay   s = r + s_0 exp(-r / (memory D)), r the travel since the reversal and s_0 the s just before it: from keep to reset

A reversal counts once the strip has come back by 0.03 D (a stop rings, an encoder jitters by less); s counts from where it turned.
A strip that stands still keeps its s, unless `dwell_s` is given: after so long the water counts as at rest again.
A recording begins at rest; a strip that moves in its first row (5 % of its own peak) is taken to have moved for ever: s is infinite until
its first reversal. In steady rows s is infinite: every row is a run that has lasted long.

Source: McLain & Rock (1998), eqs. (1), (28); the rules for reversals, pauses and running starts are ours.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import final

import torch
from torch import Tensor

from nnhydro.errors import ModelError, require
from nnhydro.physics.strips import Strips

RULES = ("reset", "keep", "decay")
STILL = 1e-3  # m/s: slower than that the sign of the velocity is noise and no reversal counts
BACK = 0.03  # diameters: a shorter way back is ringing or encoder noise at the end of a motion, and no reversal counts
RUNNING_START = 0.05  # of the strip's peak speed: faster than that in the first row it was under way before the recording


@final
@dataclass(frozen=True)
class TravelRule:
    """What happens to the travel at a reversal (`reset`, `keep`, `decay` over `memory` diameters) or in a pause (`dwell_s`; 0: nothing)."""

    at_reversal: str = "reset"
    memory: float = 5.0  # diameters
    dwell_s: float = 0.0

    def __post_init__(self) -> None:
        require(self.at_reversal in RULES, f"travel: rule {self.at_reversal!r} is not one of {', '.join(RULES)}", ModelError)
        require(self.memory > 0, f"travel: a memory of {self.memory} diameters: give a positive length", ModelError)
        require(self.dwell_s >= 0, f"travel: dwell_s = {self.dwell_s}: give seconds, 0 for never", ModelError)


def _path(strips: Strips) -> tuple[Tensor, Tensor]:
    """Path since the first row (n, links, s) m, and the path at the latest zero of the velocity up to each row."""
    flow, w = strips.flow, strips.w
    dt = torch.diff(flow.motion.t)[:, None, None]
    straight = (strips.x * torch.diff(flow.phi, dim=0)[..., None] + ((flow.B[1:] + flow.B[:-1]) / 2)[..., None] * dt).abs()
    before, after = w[:-1].abs(), w[1:].abs()
    half = dt / 2 / (before + after).clamp(min=1e-300)
    crossing = w[:-1] * w[1:] < 0
    step = torch.where(crossing, (before**2 + after**2) * half, straight)
    zero = torch.zeros_like(w[:1])
    path = torch.cat([zero, step.cumsum(0)])
    at_zero = torch.where(crossing, path[:-1] + before**2 * half, torch.where(w[:-1] == 0, path[:-1], zero))
    return path, torch.cat([zero, at_zero]).cummax(0).values


def _last(moving: Tensor) -> Tensor:
    """The latest row (n, links, s) at which `moving` was true, 0 before the first."""
    rows = torch.arange(len(moving)).reshape(-1, 1, 1).expand_as(moving)
    return torch.where(moving, rows, torch.zeros_like(rows)).cummax(0).values


def _direction(w: Tensor, since_zero: Tensor) -> Tensor:
    """Sign of the latest velocity that counts (n, links, s), 0 before the first.

    Believable is a velocity above STILL that has carried the strip `since_zero` > BACK diameters from where it last stood still.
    """
    moving = (w.abs() > STILL) & (since_zero > BACK)
    return torch.where(moving, torch.sign(w), torch.zeros_like(w)).gather(0, _last(moving))


def _decay(since: Tensor, origin: Tensor, reversals: Tensor, rests: Tensor, length: Tensor) -> Tensor:
    """s = r + s_0 exp(-r / length) with s_0 handed on from reversal to reversal; `since` and `origin` as after `reset`."""
    s0, memory = torch.zeros_like(since[0]), torch.zeros_like(since)
    events = (reversals | rests).flatten(1).any(1).nonzero().flatten().tolist()
    for start, stop in pairwise([*events, len(since)]):
        r = origin[start] - origin[start - 1] if start else torch.zeros_like(s0)  # travelled from the reversal before to this one
        s0 = torch.where(reversals[start], r + s0 * torch.exp(-r / length), s0)
        s0 = torch.where(rests[start], torch.zeros_like(s0), s0)
        memory[start:stop] = s0
    return since + memory * torch.exp(-since / length)


def travel(strips: Strips, rule: TravelRule | None = None) -> Tensor:
    """Return s (n, links, s) in metres of every strip, one run in time order; infinite where the flow is steady."""
    rule = rule or TravelRule()
    w = strips.w
    if strips.flow.motion.steady or not len(w):
        return torch.full_like(w, torch.inf)
    path, path_at_zero = _path(strips)
    sign = _direction(w, (path - path_at_zero) / strips.flow.D[:, None])
    started = torch.cat([torch.zeros_like(sign[:1]), sign[:-1]]) != sign  # first motion that counts, or a reversal
    reversals = started & (torch.cat([sign[:1], sign[:-1]]) * sign < 0)
    t = strips.flow.motion.t
    rests = (t[:, None, None] - t[_last(w.abs() > STILL)] > rule.dwell_s) if rule.dwell_s > 0 else torch.zeros_like(reversals)
    restarts = started & ~reversals if rule.at_reversal == "keep" else started
    zero = torch.zeros_like(path)
    origin = torch.where(restarts | (sign == 0), path_at_zero, zero)
    origin = torch.maximum(origin, torch.where(rests, path, zero)).cummax(0).values
    since = path - origin
    if rule.at_reversal == "decay":
        since = _decay(since, origin, reversals, rests, rule.memory * strips.flow.D[:, None])
    running = w[0].abs() > torch.clamp(RUNNING_START * w.abs().amax(0), min=STILL)
    forgotten = ((reversals & restarts) | rests).cumsum(0) > 0
    return torch.where(running & ~forgotten, torch.inf, since)
