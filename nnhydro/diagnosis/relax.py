"""Is a further finding an effect of its own, or only the shape that the card of another one leaves?

A card holds the mechanism, not the exact law of this rig. So the other findings are given shapes of their own,

    z = a restricted to one joint,  a |a| / rms(a),  a |dq_j| / rms(dq_j),  a |u| / rms(u),  tau da/dt,        a the finding's fitted torque
    z = x(phi') rms(a) / rms(x)         the finding's columns at the other values phi' that its card names (`Effect.spread`)

each with a prior standard deviation of half of a, and the finding in question is asked again what it adds. What the shape of another one
can take over is not claimed, where that one explains three times as much: a law of other form leaves far less than it explains, and viscous
friction, the rate of a spring's torque, is no shape of a spring that explains as much. What has a value of its own in every recording
follows any shape: there whatever explains more lends all of them. The other values that a card names are its own
mechanism, and are lent by whatever explains more.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate, build
from nnhydro.diagnosis.instances import Instance
from nnhydro.diagnosis.race import Race
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.table import Piece, Table
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]
LOOSE = 0.5  # standard deviation of a shape, in sizes of the finding's own torque
LAG = 0.1  # s, of the shape that comes late
MUCH = 3.0  # times its own gain: what another one must explain to leave such a shape
RETAINED = 0.35  # of its gain that a finding must keep when the others have shapes of their own


def _size(x: Array) -> float:
    return float(np.sqrt((x**2).mean())) or 1.0


def shapes(a: Array, piece: Piece, scale: Array, rates: Array) -> Array:
    """Return the shapes (n, joints, 3 + joints) of one finding's torque `a` (n, joints) N m on a piece.

    `scale` (joints,) N m is the rms of its torque in the campaign, `rates` (joints,) rad/s that of the joints.
    """
    joints = a.shape[1]
    qd = np.stack([piece.state[f"dq{j + 1}_rad_s"] for j in range(joints)], axis=1)
    late = np.gradient(a, axis=0) * (LAG / piece.dt) if piece.dt and len(a) > 2 else np.zeros_like(a)
    each = [a * (np.arange(joints) == j) for j in range(joints)] if joints > 1 else []
    made = [*each, a * np.abs(a) / scale.max(), a * np.abs(qd).sum(axis=1, keepdims=True) / rates.sum(), late]
    result: Array = LOOSE * np.stack(made, axis=2)
    return result


def _torques(race: Race, table: Table, believed: StripTheory, kept: Sequence[Candidate]) -> list[list[Array]]:
    """Fitted torque (n, joints) of each of `kept` on every piece."""
    values = race.values(race.chosen)[1]
    made: list[list[Array]] = [[] for _ in kept]
    for piece in table.pieces:
        for found, candidate in zip(made, kept, strict=True):
            X = table.columns(piece, [candidate.instance], believed)
            lasting = [k - min((*candidate.columns, *candidate.own)) for k in candidate.columns]
            found.append(X[..., lasting] @ np.array([values[k] for k in candidate.columns]))
    return made


def spread(candidate: Candidate) -> list[Instance]:
    """Return the candidate at the values of its nonlinear parameters over which a law of other form would spread."""
    instance, effect = candidate.instance, candidate.instance.effect
    made: list[dict[str, Any]] = [{name: tuple(times * value for value in getattr(effect, name))}
                                  for name, factors in effect.spread.items() for times in factors]
    return [replace(instance, effect=replace(effect, **changes)) for changes in made]


def _spread(table: Table, believed: StripTheory, kept: Sequence[Candidate], scales: Sequence[Array]) -> tuple[list[Instance], Array]:
    """The spread instances of `kept`, and the factor of each of their columns (K,) that brings it to half of its candidate's `scales`."""
    pairs = [(one, scale) for c, scale in zip(kept, scales, strict=True) for one in spread(c)]
    made = [one for one, _ in pairs]
    energy, rows = np.zeros(sum(one.width for one in made)), 0
    for piece in table.pieces:
        energy += (table.columns(piece, made, believed) ** 2).sum(axis=(0, 1))
        rows += len(piece.y)
    wanted = np.repeat([float((scale**2).sum()) for _, scale in pairs], [one.width for one in made])
    return made, LOOSE * np.sqrt(wanted * rows / np.maximum(energy, 1e-300))


def retained(race: Race, table: Table, believed: StripTheory, asked: Candidate) -> float:
    """Return the share of its gain that the chosen candidate `asked` keeps when others that explain much more have shapes of their own."""
    others, cost = [c for c in race.chosen if c is not asked], race.loss(asked)
    more = [c for c in others if c.columns and race.loss(c) > cost]
    torques = _torques(race, table, believed, more)
    sizes = [np.array([_size(np.concatenate([a[:, j] for a in one])) for j in range(one[0].shape[1])]) for one in torques]
    much = [k for k, c in enumerate(more) if asked.own or race.loss(c) > MUCH * cost]
    names = [f"dq{j + 1}_rad_s" for j in range(table.pieces[0].y.shape[1])]
    rates = np.array([_size(np.concatenate([piece.state[name] for piece in table.pieces])) for name in names])
    further, size = _spread(table, believed, more, sizes)
    place = {id(piece): k for k, piece in enumerate(table.pieces)}

    def beside(piece: Piece) -> Array:
        k = place[id(piece)]
        made = [shapes(torques[i][k], piece, sizes[i], rates) for i in much]
        return np.concatenate([*made, table.columns(piece, further, believed) * size], axis=2)

    bank, blocks = build(table, [c.instance for c in (*others, asked)], believed, beside)
    loose = Race(bank, Bench.of(blocks, race.noise, np.ones(blocks.p)), race.noise, list(bank.candidates))
    kept = loose.scored(without=[bank.candidates[-1]]).total - loose.scored().total
    return kept / max(cost, 1e-12)


def prune(race: Race, table: Table, believed: StripTheory) -> None:
    """Take the chosen candidates away, the weakest first, whose gain the shapes of the others can take over."""
    while len(race.chosen) > 1:
        shares = [retained(race, table, believed, c) for c in race.chosen]
        race.log += [f"{c.key[0]} joint {c.key[1]}: keeps {share:.2f} of its gain beside loose shapes of the others"
                     for c, share in zip(race.chosen, shares, strict=True)]
        doubtful = [c for c, share in zip(race.chosen, shares, strict=True) if share < RETAINED]
        if not doubtful:
            return
        race.chosen.remove(min(doubtful, key=lambda c: race.loss(c)))
