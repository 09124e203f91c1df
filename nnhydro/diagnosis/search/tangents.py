"""How the torque of the laws of a set changes with their nonlinear values: columns beside those of the linear values.

    D_a = [u(beta, phi + h e_a) - u(beta, phi - h e_a)] / 2 h,     u = X(phi) beta,   h the standard deviation of phi_a

With these columns the fit of a set is the normal equation of Gauss and Newton for all its values: it holds the step to the values that fit
best, and their covariance with all others. Source: Seber & Wild (1989), Nonlinear Regression, sections 2.1.2 and 5.2.
"""

from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.model.evidence import Columns, WhiteRows
from nnhydro.diagnosis.model.sizes import without_unknown
from nnhydro.diagnosis.problem.hypothesis import Hypothesis, Span
from nnhydro.diagnosis.search.best_fit import best_fit
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.effects.effect import LoadEffect

Array = NDArray[np.float64]
ROUNDS, FACTOR = 3, 3.0  # iterations of the difference step, and the ratio to the standard deviation that is near enough
FINEST = 1e-3  # smallest difference step, in distances to the next value tried: a law that jumps has no slope
SETTLED = 0.3  # standard deviations; a smaller step does not change an interval


@final
@dataclass(frozen=True, eq=False)
class Tangents:
    """The derivatives of a set's torque by its nonlinear values, named by member and value."""

    names: tuple[tuple[int, str], ...]
    D: Array  # (n, joints, m) N m for one unit of each value
    now: Array  # (m,) the values
    limits: Array  # (m, 2) between which they can lie

    @property
    def unit(self) -> Array:
        """The change (m,) of each value at a coefficient of 1, of those that may lie anywhere between their limits."""
        low, high = self.limits.T
        made: Array = (high - low) / 12**0.5 / RHO
        return made

    def append_to(self, whitened: WhiteRows, columns: Columns | None) -> Columns:
        """Return `columns` with those of the nonlinear values, whitened and scaled as coefficients are."""
        mine = Columns.of(whitened, whitened.weigh(self.D * self.unit))
        return mine if columns is None else columns.join(mine)

    def at(self, k: int) -> NDArray[np.int64]:
        """Return which of the values are those of member `k`."""
        return np.flatnonzero([member == k for member, _ in self.names]).astype(np.int64)


@final
@dataclass(frozen=True, eq=False)
class NewtonStep:
    """A step of all values of a set to where they fit best together."""

    tangents: Tangents
    phi: Array  # (m,) change of the nonlinear values, in their units
    deviation: Array  # (m,) what they are known to over the noise that is left, in their units
    mean: Array  # (P + k + m,) all scaled coefficients after the step

    @property
    def settled(self) -> bool:
        """Whether the values stand where they fit best."""
        return bool(np.all(np.abs(self.phi) < SETTLED * self.deviation))


def limits_of(search: Search, k: int) -> dict[str, Span]:
    """Return between what the nonlinear values of member `k` can lie: its physical bounds, and the neighbours of all that was tried."""
    hypotheses = search.view.library.hypotheses
    h, found = hypotheses[k], dict[str, Span]()
    names = [name for name, (low, high) in h.spans.items() if not np.isclose(low, high, rtol=1e-9, atol=0.0)]
    bounds = {field.name: field.metadata["bounds"] for field in h.effect.parameters()} if names else {}
    for name in names:
        spans = [other.spans[name] for other in hypotheses if other.key == h.key and name in other.spans]
        found[name] = max(min(low for low, _ in spans), bounds[name][0]), min(max(high for _, high in spans), bounds[name][1])
    return found


def _first_step(h: Hypothesis, name: str) -> float:
    """The distance to the nearer of the neighbouring values; one that differs by rounding is the value itself."""
    value = getattr(h.effect, name)[0]
    return float(min(abs(value - end) for end in h.spans[name] if not np.isclose(end, value, rtol=1e-9, atol=0.0)))


def _ends(h: Hypothesis, name: str, step: float) -> tuple[float, float]:
    """The values on both sides, within the physical bounds."""
    value, bounds = getattr(h.effect, name)[0], {field.name: field.metadata["bounds"] for field in h.effect.parameters()}
    return max(value - step, bounds[name][0]), min(value + step, bounds[name][1])


def shift_values(h: Hypothesis, values: dict[str, float]) -> Hypothesis:
    """Return `h` with other nonlinear `values`."""
    changes: dict[str, Any] = {name: (value,) * len(getattr(h.effect, name)) for name, value in values.items()}
    return h.with_nonlinear(changes, {})


def _difference_quotients(search: Search, found: ScoredSet, k: int, steps: dict[str, float]) -> dict[str, Array]:
    """Return how the columns (n, joints, width) of member `k` change with each of its nonlinear values, over about `steps`.

    Those of a law that depends on no set are reusable: over a step that differs by less than FACTOR they serve another set as well.
    """
    design, h = search.view.library.design, search.view.library.hypotheses[k]
    reusable = isinstance(h.effect, LoadEffect) or h.working_model is not None
    known = {name: near for name, step in steps.items() if reusable
             for over, near in search.quotients.get((k, name), {}).items() if 1 / FACTOR < over / step < FACTOR}
    ends = {name: _ends(h, name, step) for name, step in steps.items() if name not in known}
    if ends:
        laws = [shift_values(h, {name: end}) for name, pair in ends.items() for end in pair]
        X = design.columns(laws, design.baseline.at(design.baseline.within(best_fit(search, found).z)))
        X = X.reshape(*X.shape[:2], len(ends), 2, h.width)
        for i, (name, (low, high)) in enumerate(ends.items()):
            known[name] = (X[..., i, 1, :] - X[..., i, 0, :]) / (high - low)
            if reusable:
                search.quotients.setdefault((k, name), {})[steps[name]] = known[name]
    return known


def _columns(search: Search, found: ScoredSet, steps: dict[tuple[int, str], float]) -> Array:
    """Return the derivatives (n, joints, m) of the torque of `found` over `steps`."""
    library, mean = search.view.library, best_fit(search, found).posterior.mean
    columns, quotients = [], dict[int, dict[str, Array]]()
    for k in dict.fromkeys(member for member, _ in steps):
        quotients[k] = _difference_quotients(search, found, k, {name: step for (member, name), step in steps.items() if member == k})
    for k, name in steps:
        h = library.hypotheses[k]
        beta = mean[found.places(search.view)[k]].reshape(-1, h.width) * library.scale[library.at(k)]
        if not h.per_recording:
            columns.append(quotients[k][name] @ beta[0])
            continue
        values = np.zeros((library.design.problem.groups, h.width))
        values[search.view.acting_groups(k)] = beta
        columns.append(np.einsum("njw,nw->nj", quotients[k][name], values[library.design.problem.group_of]))
    return np.stack(columns, axis=2)


def tangents_of(search: Search, found: ScoredSet) -> Tangents | None:
    """Return the derivatives of `found` by the nonlinear values of its members, found once a set; None without any."""
    if found.chosen not in search.tangents:
        search.tangents[found.chosen] = _over_deviations(search, found)
    return search.tangents[found.chosen]


def _over_deviations(search: Search, found: ScoredSet) -> Tangents | None:
    """Return the derivatives of `found`, each over the standard deviation of its value."""
    limits = {(k, name): span for k in found.chosen for name, span in limits_of(search, k).items()}
    if not limits:
        return None
    hypotheses = search.view.library.hypotheses
    now = np.array([getattr(hypotheses[k].effect, name)[0] for k, name in limits])
    steps = {(k, name): _first_step(hypotheses[k], name) for k, name in limits}
    finest = {at: FINEST * step for at, step in steps.items()}
    made = Tangents(tuple(steps), _columns(search, found, steps), now, np.array(list(limits.values())))
    for _ in range(ROUNDS - 1):
        deviations = dict(zip(steps, step_of(search, found, made).deviation, strict=True))
        wanted = {at: max(float(deviation), finest[at]) for at, deviation in deviations.items()}
        off = {at: step for at, step in wanted.items() if not 1 / FACTOR < step / steps[at] < FACTOR}
        if not off:
            break
        steps |= off
        D = made.D.copy()
        D[..., [made.names.index(at) for at in off]] = _columns(search, found, off)
        made = replace(made, D=D)
    return made


def step_of(search: Search, found: ScoredSet, tangents: Tangents) -> NewtonStep:
    """Return the step from the values of `found` to those that fit best together."""
    fit = best_fit(search, found)
    moved = without_unknown(fit.whitened, tangents.append_to(fit.whitened, fit.columns))
    at = np.arange(len(fit.posterior.mean), len(moved.mean))
    phi = np.clip(tangents.now + moved.mean[at] * tangents.unit, *tangents.limits.T) - tangents.now
    return NewtonStep(tangents, phi, np.sqrt(np.diag(moved.covariance(at))) * tangents.unit, moved.mean)
