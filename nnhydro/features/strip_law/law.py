"""A law of the load on every strip of the arm, linear in its coefficients, which all links and joints share; its memory is learned.

    f = sum_q b_q(w, dw, m, v, a, b) sum_p c_qp phi_p(z) + loads of neurons (neurons.py)                        [N/m]
    tau_j = sum over strips of f ds times the strip's lever about joint j, behind belt and gears                 [N m]

    b_1, b_2  1/2 rho D |w| w  and  rho pi D^2/4 dw: Morison's loads                                             phi: 1, z, z z
    b_q       1/2 rho D {V w, V m, |x| w, |w| x, |x| x: x of m, a, b};  rho nu w, rho nu m;                       phi: 1, z
              rho pi D^2/4 {dw w^2, dw m^2, dw w m}/V^2,  rho pi D^2/4 (w - v)/T
    m, v, a, b   what the strip's water remembers over travel, over time T, and swinging (wake.py), V^2 = mean of w^2 and all m^2
    z         variables of the strip's surroundings (state.py), even and bounded; w, dw its normal speed and acceleration

The loads are all products of the right dimension of the motion and its fading averages that change sign in the mirror: which of them the
water uses is for the data to say. (w - v)/T are fading averages of dw, of which Basset's history force is a sum. A law of the flow past a
piece of cylinder, whichever link it belongs to: what link 2 shows of it, link 1 need not show again. A link that has stopped is still
pushed by its wake. Source: Morison's equation; McLain & Rock (1998), eqs. (1), (28); Basset (1888); a law inside the strip integral: the
idea of arXiv 2509.13783; the products are ours.
"""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import combinations_with_replacement

import torch
from torch import Tensor

from nnhydro.features.scaling import gear_ratios, root
from nnhydro.features.strip_law.neurons import COUNT, directions, neuron_loads
from nnhydro.features.strip_law.state import StripView
from nnhydro.features.wake import LASTING, STRIPS, TRAVEL, strip_drag, strip_mass
from nnhydro.physics.flow import Flow
from nnhydro.physics.transmission import to_drives

# Tiers of coefficients: Morison's two; drag that remembers; memory that swings; inertia that remembers; neurons; those of body and odd
# features, and of free functions (fitting/network/linear_part.py); from SURROUNDED on those that the first, the second ... set of
# variables bends.
MEAN, REMEMBERED, SWUNG, ACCELERATED, NEURONS, ARM, FREE, SURROUNDED = range(8)
MORISON = 2  # drag and inertia: the loads whose coefficients may bend with z
DRAGS, SWINGS, INERTIAS = 1 + 4 * len(TRAVEL), 6, 1 + 2 * len(TRAVEL) + len(LASTING)  # loads that remember, by speed and by acceleration
CHUNK = 128  # rows at a time: their products stay in the processor's cache
FAINT = 1e-3  # m/s: below it ratios of speeds fade to zero


@lru_cache(maxsize=32)
def _products(k: int, of_three: tuple[int, ...]) -> tuple[Tensor, ...]:
    """Indices a, b (pairs,) of the variables to multiply, and c, d (triples,): a pair of variables of degree 3 and a third one."""
    pairs = list(combinations_with_replacement(range(k), 2))
    place = {pair: i for i, pair in enumerate(pairs)}
    triples = [(place[a, b], c) for a, b, c in combinations_with_replacement(of_three, 3)]
    return tuple(torch.tensor([indices[side] for indices in chosen], dtype=torch.long) for chosen in (pairs, triples) for side in (0, 1))


def size(k: int, of_three: Sequence[int] = ()) -> int:
    """Return how many monomials there are of k variables, those at `of_three` of degree 3."""
    a, _, c, _ = _products(k, tuple(of_three))
    return 1 + k + len(a) + len(c)


def tiers(sets: Sequence[int], of_three: Sequence[int], count: int) -> Tensor:
    """Return the tier of each of `count` coefficients of a law whose variables belong to the sets numbered `sets`; none without a law.

    A product of variables of two sets is in the tier of the later one.
    """
    if not count:
        return torch.full((0,), SURROUNDED)
    k = len(sets)
    a, b, c, d = _products(k, tuple(of_three))
    singles = torch.tensor(sets)
    two = torch.maximum(singles[a], singles[b]) if k else singles
    phi = SURROUNDED + torch.cat([singles, two, torch.maximum(two[c], singles[d])])
    per_load = [torch.cat([torch.tensor([MEAN]), phi])] * MORISON
    for first in [REMEMBERED] * DRAGS + [SWUNG] * SWINGS + [ACCELERATED] * INERTIAS + [REMEMBERED] * (1 + len(TRAVEL)):
        per_load.append(torch.cat([torch.tensor([first]), phi[:k]]))
    per_load.append(torch.full((2 * COUNT,), NEURONS))
    return torch.cat(per_load)


def monomials(z: Tensor, of_three: Sequence[int]) -> Tensor:
    """Return phi (n, links, p, s) of the variables z (n, links, k, s); the first 1 + k of them are 1 and z."""
    a, b, c, d = _products(z.shape[2], tuple(of_three))
    two = z.index_select(2, a) * z.index_select(2, b)
    three = two.index_select(2, c) * z.index_select(2, d)
    ones = z.new_ones((*z.shape[:2], 1, z.shape[3]))
    return torch.cat([ones, z, two, three], dim=2)


def unit_loads(view: StripView, rows: slice = slice(None)) -> Tensor:
    """Return the strip loads b ds (n, links, q, s) N: Morison's two, then those that remember."""
    flow, w, m = view.flow, view.w[rows], [x[rows] for x in view.travelled]
    dw = flow.M[rows][:, :, None] * view.x + flow.N[rows][:, :, None]
    ds, D = (flow.L / STRIPS)[:, None], flow.D[:, None]
    squares = torch.stack([x**2 for x in (w, *m)])
    V2 = squares.mean(dim=0)
    V, share = root(V2), dw / (V2 + FAINT**2)
    eddies = [x[rows] for x in view.swinging]
    drag = [V * x for x in (w, *m)] + [load for x in (*m, *eddies) for load in (x.abs() * w, w.abs() * x, x.abs() * x)]
    inertia = [*(share * squares), *(share * w * x for x in m)]
    history = [(w - v[rows]) * flow.nu / (f * D**2) for v, f in zip(view.lasting, LASTING, strict=True)]
    pressure, water, viscous = strip_drag(flow), strip_mass(flow), flow.rho * flow.nu * ds
    return torch.stack([pressure * w.abs() * w, water * dw, *(pressure * x for x in drag), *(water * x for x in inertia),
                        *(water * x for x in history), *(viscous * x for x in (w, *m))], dim=2)


def to_sensors(flow: Flow, force: Tensor, moment: Tensor) -> Tensor:
    """Return the sensor torques (n, joints, p) of normal loads: force N and moment N m about the link's own joint, (n, links, p) each."""
    if flow.arm.sliding:
        return to_drives(force, flow.arm) / gear_ratios(flow.arm)[:, None]
    joint = torch.einsum("ji,nip->njp", flow.outboard, moment) + torch.einsum("nji,nip->njp", flow.lever_normal, force)
    return to_drives(joint, flow.arm) / gear_ratios(flow.arm)[:, None]


def _pieces(view: StripView, z: Tensor, of_three: Sequence[int], N: Tensor) -> Iterator[tuple[Tensor, Tensor, tuple[Tensor, ...]]]:
    """Loads (m, links, q, s), monomials (m, links, p, s) and what `neuron_loads` gives, CHUNK rows at a time."""
    for start in range(0, len(z), CHUNK):
        rows = slice(start, start + CHUNK)
        yield unit_loads(view, rows), monomials(z[rows], of_three), neuron_loads(view, N, rows)


def law_columns(view: StripView, z: Tensor, of_three: Sequence[int]) -> Tensor:
    """Return d tau / d coefficient (n, joints, coefficients) N m: drag, inertia, load by load what remembers, the neurons' s and s^2."""
    straight = 1 + z.shape[2]
    forces: list[Tensor] = []
    moments: list[Tensor] = []
    for loads, phi, (s, drag, inertia) in _pieces(view, z, of_three, directions()):
        neurons = torch.cat([drag * s, inertia * s**2], dim=2)
        for lever, sums in ((torch.ones_like(view.x), forces), (view.x, moments)):
            weight = loads * lever[:, None]
            morison = torch.einsum("nlqs,nlps->nlqp", weight[:, :, :MORISON], phi)
            rest = torch.einsum("nlqs,nlps->nlqp", weight[:, :, MORISON:], phi[:, :, :straight])
            sums.append(torch.cat([morison.flatten(2), rest.flatten(2), torch.einsum("nlks,ls->nlk", neurons, lever)], dim=2))
    return to_sensors(view.flow, torch.cat(forces), torch.cat(moments))


def law_torque(view: StripView, z: Tensor, of_three: Sequence[int], c: Tensor, N: Tensor) -> Tensor:
    """Return the torques (E, n, joints) N m of E sets of coefficients c (E, coefficients); N (k, STATES) are the neurons' directions."""
    E, straight = len(c), 1 + z.shape[2]
    bent = size(z.shape[2], of_three)
    products, odd, even = torch.split(c, [c.shape[1] - 2 * len(N), len(N), len(N)], dim=1)
    morison = products[:, :MORISON * bent].reshape(E * MORISON, bent)
    rest = products[:, MORISON * bent:].reshape(E, -1, straight).transpose(1, 2).flatten(0, 1)  # the loads first: many loads, few monomials
    found = []
    for loads, phi, (s, drag, inertia) in _pieces(view, z, of_three, N):
        C, F = (torch.unflatten(weights @ x, 2, (E, -1)) for weights, x in ((morison, phi), (rest, loads[:, :, MORISON:])))
        found.append((C * loads[:, :, None, :MORISON]).sum(dim=3) + (F * phi[:, :, None, :straight]).sum(dim=3)
                     + drag * (odd @ s) + inertia * (even @ s**2))  # (m, links, E, s) N
    f = torch.cat(found)
    return to_sensors(view.flow, f.sum(dim=3), (f * view.x[:, None]).sum(dim=3)).permute(2, 0, 1)
