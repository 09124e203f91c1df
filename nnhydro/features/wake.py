"""What a strip's water remembers: a bank of generic fading filters of the strip's own motion, over travel and over time.

    dp/dt = c (w - p)/(lambda D),  dm/dt = c (p - m)/(lambda D),  c^2 = w^2 + m^2,  lambda in TRAVEL    two stages over the way  [m/s]
    dv/dt = (w - v)/T,                                                              T in LASTING D^2/nu     one stage over time  [m/s]
    dz/dt = e (w - z)(DAMPING + i) 2 pi STROUHAL/D,  e^2 = w^2 + |z|^2              swings STROUHAL times a diameter           [m/s]

No filter is a law of the flow: what m, v and z mean for the load is learned (strip_law/law.py). Two stages rise late, as a wake does; their
clock c goes on while the strip stands in what it has set in motion. z = a + i b swings over the way as vortices are shed, and has forgotten
within a third of a period. None obeys the first-order equation over |w| dt that datasets/rivera_tank plants. A station that starts from
rest has m = 0 and reaches w after a few lambda; after a reversal m still has the old sign. Steady runs, and runs that begin under tow, have
m = v = a = w and b = 0. Stable by construction: p, m, v stay within the range of w, z - w decays.

Sources: McLain & Rock (1998), eq. (1) (coefficients depend on s/D); gamma filters: de Vries & Principe (1992), Neural Networks 5, 565;
times of the boundary layer, D^2/nu: Basset (1888); Strouhal number: API RP 2A-WSD, B.5.3.1.2.13. The bank and its clocks are ours.
"""

from collections.abc import Sequence
from math import pi

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.features.feature_set import Features, View, feature_set
from nnhydro.features.scaling import root
from nnhydro.physics.carried import StepMemory
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.added_mass import displaced_mass
from nnhydro.physics.memo import RecentMemo, content_of
from nnhydro.physics.transmission import to_drives

Array = NDArray[np.float64]

STRIPS = 10  # a link; McLain & Rock found no gain beyond four
TRAVEL = (0.25, 0.5, 1.0, 2.0, 4.0)  # diameters, from the vortex pair's growth to the street's
LASTING = (1e-4, 1e-3, 1e-2)  # of D^2/nu
STROUHAL, DAMPING = 0.2, 0.5  # cycles a diameter, as of long cylinders from Re 300 to 2e5; decay over angular frequency
SWINGING = (2 * pi * STROUHAL * DAMPING, 2 * pi * STROUHAL)  # decay and angular frequency a diameter
STATES = 2 * len(TRAVEL) + len(LASTING) + 3  # numbers that a station carries from row to row: p, m, v, a, b and w itself
TINY = 1e-12  # rate of a step: none at all
LARGE = 10.0  # bound of the scaled torques; steady flow gives up to about 3
STILL = 5e-3  # m/s: below it a station counts as at rest
_RUNS = RecentMemo(100_000_000)  # every model that is fitted to a run, or asked about it, needs the same states of its water


def stations(flow: Flow, per_link: int = STRIPS) -> Tensor:
    """Return the middles x (links, s) m of equal strips."""
    return flow.L[:, None] * (torch.arange(per_link, dtype=torch.float64) + 0.5) / per_link


def strip_drag(flow: Flow) -> Tensor:
    """Return 1/2 rho D ds (links, 1) kg/m of the strips at `stations`: drag over the square of the speed for C_D = 1."""
    return 0.5 * flow.rho * flow.D[:, None] * flow.L[:, None] / STRIPS


def strip_mass(flow: Flow) -> Tensor:
    """Return rho pi D^2/4 ds (links, 1) kg of the strips at `stations`: the mass of the water that each displaces."""
    return (displaced_mass(flow) * flow.L / STRIPS)[:, None]


def under_way(flow: Flow) -> bool:
    """Return whether the arm was under way through the water before the recording began: under tow, on a moving base or in a current."""
    rx, ry = flow.through_water[:2]
    return bool(torch.hypot(rx[0], ry[0]).max() > STILL)


def each_under_way(flow: Flow) -> Tensor:
    """Return whether each row (n,) is of an arm whose base moves through the water: a run that begins so has begun earlier."""
    rx, ry = flow.through_water[:2]
    return torch.hypot(rx, ry).amax(dim=1) > STILL


def _lengths(values: Sequence[float]) -> Tensor:
    return torch.tensor(values, dtype=torch.float64)[:, None, None]


def _hold(rate: Tensor) -> tuple[Tensor, Tensor]:
    """exp(-r) and (1 - exp(-r))/r: a filter's answer to what it remembers, and to a straight change of its input, exact."""
    r = rate.clamp(min=TINY)
    return torch.exp(-r), -torch.expm1(-r) / r


def _swing(rate: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """The same of a filter that swings, r (decay + i frequency) in place of r; real and imaginary parts of both."""
    r = rate.clamp(min=TINY)
    (decay, turn), size = SWINGING, SWINGING[0] ** 2 + SWINGING[1] ** 2
    fade = torch.exp(-decay * r)
    re, im = fade * torch.cos(turn * r), -fade * torch.sin(turn * r)
    return re, im, ((1 - re) * decay - im * turn) / (size * r), (-im * decay - (1 - re) * turn) / (size * r)


def next_state(w: Tensor, dt: Tensor, D: Tensor, nu: float, state: Tensor) -> Tensor:
    """Return the state (..., STATES, links, s) after dt s in which the speed went straight to w (..., links, s) m/s, from that before."""
    first, second, slow, a, b, before = torch.split(state, [len(TRAVEL), len(TRAVEL), len(LASTING), 1, 1, 1], dim=-3)
    w = w.unsqueeze(-3)
    stay, turn = _hold(root(((w + before) / 2) ** 2 + second**2) * dt / (_lengths(TRAVEL) * D[:, None]))
    p = w + (first - before) * stay - (w - before) * turn
    m = p + (second - first) * stay - (p - first) * turn
    stay, turn = _hold(dt * nu / (_lengths(LASTING) * D[:, None] ** 2).expand_as(slow))
    v = w + (slow - before) * stay - (w - before) * turn
    clock = root(((w + before) / 2) ** 2 + a**2 + b**2)
    re, im, turn, across = _swing(clock * dt / D[:, None])
    swung = w + (a - before) * re - b * im - (w - before) * turn, (a - before) * im + b * re - (w - before) * across
    return torch.cat([p, m, v, *swung, w], dim=-3)


def _filter_states(w: Array, dt: Array, D: Array, nu: float, start: Array) -> Array:
    """The states (n, STATES, links, s) m/s, row by row; w (n, links, s) m/s, dt (n,) s, D (links, 1) m: lags p - w, m - p, v - w decay."""
    count = len(TRAVEL)
    found = np.empty((len(w), STATES, *w.shape[1:]))
    found[0, :-1], found[:, -1] = start, w
    p, m, v = found[:, :count], found[:, count:2 * count], found[:, 2 * count:-3]
    change, square = np.diff(w, axis=0), (0.5 * (w[1:] + w[:-1])) ** 2
    per_way = -dt[1:, None, None, None] / (np.asarray(TRAVEL)[:, None, None] * D)
    rates = np.minimum(-dt[1:, None, None, None] * nu / (np.asarray(LASTING)[:, None, None] * D**2), -TINY)
    fades = np.expm1(rates)
    moved = change[:, None] * (fades / rates)
    first, second, third = p[0] - w[0], m[0] - p[0], v[0] - w[0]
    for k in range(len(change)):
        rate = np.minimum(np.sqrt(m[k] * m[k] + square[k]) * per_way[k], -TINY)
        fade = np.expm1(rate)
        turn, stay, before = fade / rate, fade + 1.0, first
        first = first * stay - change[k] * turn
        second = second * stay - (first - before + change[k]) * turn
        third = third + third * fades[k] - moved[k]
        np.add(first, w[k + 1], out=p[k + 1])
        np.add(p[k + 1], second, out=m[k + 1])
        np.add(third, w[k + 1], out=v[k + 1])
    found[:, -3], found[:, -2] = _swinging(w, dt, D, start)
    return found


def _swinging(w: Array, dt: Array, D: Array, start: Array) -> tuple[Array, Array]:
    """a and b (n, links, s) m/s, row by row; the lag z - w turns and decays."""
    z, rate = np.empty(w.shape, dtype=complex), complex(*SWINGING)
    z[0] = start
    square, change = (0.5 * (w[1:] + w[:-1])) ** 2, np.diff(w, axis=0)
    for k in range(len(change)):
        x = np.maximum(np.sqrt(square[k] + np.abs(z[k]) ** 2) * dt[k + 1] / D, TINY) * rate
        fade = np.expm1(-x)
        z[k + 1] = w[k + 1] + (z[k] - w[k]) * (1 + fade) + change[k] * fade / x
    return z.real, z.imag


def memories(flow: Flow, x: Tensor) -> tuple[Tensor, list[Tensor]]:
    """Return w (n, links, s) m/s at the stations x (links, s) m and the STATES numbers that each station carries."""
    w = flow.A[:, :, None] * x + flow.B[:, :, None]
    if flow.motion.wake is not None:
        return w, list(flow.motion.wake)
    if flow.motion.carried is not None:
        return w, list(_carried_memories(flow, flow.motion.carried, w).unbind(1))
    if flow.motion.steady or len(flow.motion) < 2:
        return w, _lasting_states(w)
    return w, flow.memo.of(("bank", tuple(x.shape), float(x[0, 0])), lambda: _of_run(flow, w))


def _lasting_states(w: Tensor) -> list[Tensor]:
    """The states in a flow that has lasted."""
    return [*(w for _ in range(STATES - 2)), torch.zeros_like(w), w]


def _of_run(flow: Flow, w: Tensor) -> list[Tensor]:
    dt = torch.diff(flow.motion.t, prepend=flow.motion.t[:1])
    start = w[0] if under_way(flow) else torch.zeros_like(w[0])

    def states() -> Tensor:
        """Return the states (n, STATES, links, s), row after row."""
        return torch.from_numpy(_filter_states(w.numpy(), dt.numpy(), flow.D.numpy()[:, None], flow.nu, start.numpy()))

    return list(_RUNS.of((content_of((w, dt, flow.D, start)), flow.nu), states, lambda found: 8 * found.numel()).unbind(1))


def _carried_memories(flow: Flow, carried: StepMemory, w: Tensor) -> Tensor:
    """States (n, STATES, links, s) of arms that are stepped through time; w (n, links, s) m/s."""
    moves = each_under_way(flow)[:, None, None, None]

    def start() -> Tensor:
        every = torch.stack(_lasting_states(w)[:-1], dim=1)
        return torch.cat([torch.where(moves, every, torch.zeros_like(every)), w[:, None]], dim=1)

    return carried.value(f"wake/{w.shape[2]}", start, lambda old: next_state(w, carried.steps(4), flow.D, flow.nu, old))


def travel_memories(state: Sequence[Tensor]) -> list[Tensor]:
    """Return the memories over travel, second stage, (n, links, s) m/s each, of a `state` as `memories` gives it."""
    return list(state[len(TRAVEL):2 * len(TRAVEL)])


def time_memories(state: Sequence[Tensor]) -> list[Tensor]:
    """Return the memories over time, (n, links, s) m/s each, of a `state` as `memories` gives it."""
    return list(state[2 * len(TRAVEL):-3])


def swinging_memories(state: Sequence[Tensor]) -> list[Tensor]:
    """Return both parts of the memory that swings, (n, links, s) m/s each, of a `state` as `memories` gives it."""
    return list(state[-3:-1])


def ends(state: Sequence[Tensor]) -> tuple[Tensor, Tensor]:
    """Return a short and a long memory, one and four diameters in the mean, (n, links, s) m/s each, of a `state` as above."""
    return state[len(TRAVEL) + 1], state[len(TRAVEL) + 3]


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
    pressure = strip_drag(flow)
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
