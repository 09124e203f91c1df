"""How well the values that were tried tell a nonlinear parameter: by their spacing, by their left-out scores, recording by recording.

    s^2 = sum exp(-d) dx^2 / (1 + sum exp(-d)) + h^2 / 12          d how far behind the score is with the value dx away, h half the spacing

Where the values are each recording's own there is no tangent besides, and two others stand in for it, of which the wider counts:

    d = dx^2 / (2 s^2)                                            a parabola through the scores
    E_u(dx) - E_u(0) = g_u dx + h_u dx^2 / 2,   x_(-u) = -sum_(v != u) g_v / sum_(v != u) h_v
    s^2 = (n - 1) / n sum_u (x_(-u) - x)^2 + x^2                  a jackknife over recordings

E_u is the energy that is left of recording u. A few recordings decide on a pitch, and what the card does not say of them moves it more
than noise would: the jackknife over recordings sees that, the scores do not.
Source: jackknife after Efron and Tibshirani (1993), chapter 11, from general knowledge, not checked; the rest is ours.
"""

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.locks import SOFT
from nnhydro.diagnosis.race import Race
from nnhydro.effects.quantity import Z95

Array = NDArray[np.float64]
FAR = 50.0  # score beyond which a value tried tells nothing of the parabola
FEWEST = 2  # values beside the one found through which a recording's parabola goes


def student(units: int) -> float:
    """Return by how much wider than a normal one the 95 % interval is of a standard deviation that `units` recordings tell."""
    from scipy.special import stdtrit

    return float(stdtrit(units - 1, 0.975)) / Z95


def same_but(name: str, one: Candidate, other: Candidate) -> bool:
    """Return whether two candidates of one key have the same law and the same nonlinear parameters but for `name`."""
    a, b = one.instance.effect, other.instance.effect
    same_law = len(one.columns) == len(other.columns)
    return same_law and all(np.isclose(getattr(a, f)[0], getattr(b, f)[0], rtol=1e-9) for f in other.instance.spans if f != name)


def _value(candidate: Candidate, name: str) -> float:
    return float(getattr(candidate.instance.effect, name)[0])


def spreads(race: Race, candidate: Candidate) -> dict[str, float]:
    """Return the standard deviation of each nonlinear parameter of the chosen `candidate`, in its unit."""
    found: dict[str, float] = {}
    if not candidate.instance.spans:
        return found
    same = [c for c in race.bank.candidates if c.key == candidate.key and c is not candidate]
    behind = np.array([max(race.total([c], [candidate]) - race.total(), 0.0) for c in same])
    for name, (low, high) in candidate.instance.spans.items():
        dx = np.array([_value(c, name) for c in same]) - _value(candidate, name)
        near = np.array([same_but(name, c, candidate) for c in same], dtype=bool) & (behind < FAR) & (dx != 0)
        if candidate.own:
            beside = [c for c, takes in zip(same, near.tolist(), strict=True) if takes]
            variance = max(_parabola(dx[near], behind[near]), _by_recording(race, candidate, beside, dx[near]))
        else:
            weights = np.exp(-behind)
            variance = float(dx**2 @ weights) / (1.0 + float(weights.sum()))
        found[name] = float(np.sqrt(variance + ((high - low) / 2) ** 2 / 12))
    return found


def _parabola(dx: Array, behind: Array) -> float:
    """The variance that the scores `behind` (k,) of the values `dx` (k,) away tell."""
    return SOFT * float((dx**4).sum()) / max(2 * float((behind * dx**2).sum()), 1e-300) if len(dx) else 0.0


def _by_recording(race: Race, candidate: Candidate, beside: list[Candidate], dx: Array) -> float:
    """The variance that the recordings tell, each left out in turn; 0 where they tell no minimum."""
    if len(beside) < FEWEST:
        return 0.0
    left = np.array([race.scored([c], [candidate]).energy.sum(axis=1) for c in beside]) - race.scored().energy.sum(axis=1)
    scale = np.abs(dx).max()
    x = dx / scale
    (g, h), n = np.linalg.lstsq(np.stack([x, x**2 / 2], axis=1), left, rcond=None)[0], left.shape[1]
    without = h.sum() - h
    if n < 2 or h.sum() <= 0 or (without <= 0).any():
        return 0.0
    best, moved = -g.sum() / h.sum(), -(g.sum() - g) / without
    return float(((n - 1) / n * ((moved - best) ** 2).sum() * student(n) ** 2 + best**2) * scale**2)
