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
STROUHAL, DAMPING = 0.2, 0.5  # cycles per diameter, as of long cylinders from Re 300 to 2e5; decay over angular frequency
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
    count, steps = len(TRAVEL), dt[1:, None, None]
    found = np.empty((len(w), STATES, *w.shape[1:]))
    found[:, -1] = w
    p, m, v = found[:, :count], found[:, count:2 * count], found[:, 2 * count:-3]
    change, square = np.diff(w, axis=0), (0.5 * (w[1:] + w[:-1])) ** 2
    _two_stages(w, change, square, -steps[:, None] / (np.asarray(TRAVEL)[:, None, None] * D), start, p, m)
    _over_time(change, np.minimum(-steps[:, None] * nu / (np.asarray(LASTING)[:, None, None] * D**2), -TINY), start - w[0], v)
    v += w[:, None]
    _swinging(w, change, square, steps / D, start, found[:, -3], found[:, -2])
    return found


def _two_stages(w: Array, change: Array, square: Array, per_way: Array, start: Array, p: Array, m: Array) -> None:
    """Fill p and m (n, k, links, s) of rates `per_way` (n - 1, k, links, 1) a way; every row in the memory of the one before it."""
    p[0] = m[0] = start
    first, second = p[0] - w[0], np.zeros_like(p[0])
    rate, fade, turn, part = np.empty((4, *first.shape))
    for before, here, after, c, q, way, to in zip(m[:-1], p[1:], m[1:], change, square, per_way, w[1:], strict=True):
        np.multiply(before, before, out=rate)
        np.add(rate, q, out=rate)
        np.sqrt(rate, out=rate)
        np.multiply(rate, way, out=rate)
        np.minimum(rate, -TINY, out=rate)
        np.expm1(rate, out=fade)
        np.divide(fade, rate, out=turn)
        np.multiply(first, fade, out=part)  # the change of the first lag but for that of the speed, then with it
        np.subtract(part, np.multiply(c, turn, out=rate), out=part)
        np.add(first, part, out=first)
        np.add(first, to, out=here)
        np.add(part, c, out=part)
        np.multiply(part, turn, out=part)
        np.subtract(np.multiply(second, fade, out=fade), part, out=part)
        np.add(second, part, out=second)
        np.add(here, second, out=after)


def _over_time(change: Array, rate: Array, start: Array, lag: Array) -> None:
    """Fill lag (n, k, links, s), which fades at `rate` (n - 1, k, links, 1) whatever the motion: a linear recursion, solved at once."""
    from scipy.linalg.lapack import dtbtrs

    fade = np.expm1(rate)
    lag[0] = start
    np.multiply(change[:, None], -fade / rate, out=lag[1:])
    stays = np.ones((2, len(lag)))
    for k, link in np.ndindex(lag.shape[1:3]):
        stays[1, :-1] = -1.0 - fade[:, k, link, 0]
        lag[:, k, link], _ = dtbtrs(stays, lag[:, k, link], uplo="L", diag="U")


def _swinging(w: Array, change: Array, square: Array, per_diameter: Array, start: Array, a: Array, b: Array) -> None:
    """Fill a and b (n, links, s) m/s, row by row; the lag z - w turns and decays."""
    a[0], b[0] = start, 0.0
    lag, moved = (start - w[0]).astype(complex), change.astype(complex)
    rate, part = np.empty((2, *lag.shape))
    x, fade = np.empty((2, *lag.shape), dtype=complex)
    for real, imaginary, next_real, next_imaginary, c, q, step, to in zip(a[:-1], b[:-1], a[1:], b[1:], moved, square, per_diameter, w[1:],
                                                                         strict=True):
        np.multiply(real, real, out=rate)
        np.add(rate, np.multiply(imaginary, imaginary, out=part), out=rate)
        np.add(rate, q, out=rate)
        np.sqrt(rate, out=rate)
        np.multiply(rate, step, out=rate)
        np.maximum(rate, TINY, out=rate)
        np.multiply(rate, -SWINGING[0], out=x.real)
        np.multiply(rate, -SWINGING[1], out=x.imag)
        np.expm1(x, out=fade)
        np.divide(fade, x, out=x)
        np.multiply(lag, fade, out=fade)
        np.subtract(fade, np.multiply(c, x, out=x), out=x)
        np.add(lag, x, out=lag)
        np.add(lag.real, to, out=next_real)
        next_imaginary[...] = lag.imag


def memories(flow: Flow, x: Tensor) -> tuple[Tensor, list[Tensor]]:
    """Return w (n, links, s) m/s at the stations x (links, s) m and the STATES numbers that each station carries."""
    w = flow.A[:, :, None] * x + flow.B[:, :, None]
    if flow.motion.wake is not None:
        return w, list(flow.motion.wake)
    carried = flow.motion.carried
    if carried is None and (flow.motion.steady or len(flow.motion) < 2):
        return w, _lasting_states(w)
    return w, flow.memo.of(("bank", tuple(x.shape), float(x[0, 0])),
                           lambda: _of_run(flow, w) if carried is None else list(_carried_memories(flow, carried, w).unbind(1)))


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
