"""The unknown: a smooth function of state and recent motion at each joint, the hypothesis that competes with every named effect.

    u_j(t) = sum_c tau_jc sum_m s_m eta_jcm cos(pi m xi_c(t)),   s_m = 1/m,   eta ~ N(0, 1)                       [N m]

c: state variables (angles, rates, accelerations, carriage speed, slowed rates, travel since the last reversal, model torques and their
rates) and pairs of them; xi in [0, 1] is the mean of a variable's place in its range and of its rank, so that cosines vary where the data
are. A cosine basis with falling weights is a Gaussian process in a box; one size tau for every variable and joint, one per joint for all
pairs, so that it is a friction only where it says so. It has no constant: the offset of a
recording belongs to the noise of the lowest band, that of a table of steady runs to the laws. The noise of such a table is estimated beside
a constant, or it would hold the offset.
Source: Solin & Sarkka (2020), Stat. Comput. 30; competing with named laws: Kennedy & O'Hagan (2001), J. R. Stat. Soc. B 63.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.problem.design import Design
from nnhydro.diagnosis.problem.problem import Problem, Stretch
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion

Array = NDArray[np.float64]
COSINES = 6  # cosines of one variable
PAIRED = 2  # cosines of each variable of a pair
SLOWED = 0.3  # s: time over which rates are averaged, a memory that no state holds
CONSTANT = "constant"  # of steady tables
PAIRS = "pairs of variables"
RANGE = (0.5, 99.5)  # percentiles of the data that span the box of a variable


@final
@dataclass(frozen=True, eq=False)
class Unknown:
    """Columns `Phi` (n, m) shared by the joints, each with its weight `s` (m,) and the number `group` (m,) of its size; groups' `names`."""

    Phi: Array
    s: Array
    group: NDArray[np.int64]
    names: tuple[str, ...]

    @property
    def smooth(self) -> "Unknown":
        """The unknown without the constant of steady tables."""
        if CONSTANT not in self.names:
            return self
        keep = self.group != self.names.index(CONSTANT)
        return Unknown(self.Phi[:, keep], self.s[keep], self.group[keep], tuple(name for name in self.names if name != CONSTANT))


def _low_pass(t: Array, x: Array, time: float) -> Array:
    """Return `x` (n, k) through a first-order low-pass of `time` s, from its first value."""
    from scipy.signal import lfilter, lfiltic

    if len(t) < 2:
        return x
    a = float(np.exp(-(t[1] - t[0]) / time))
    made = [lfilter([1 - a], [1, -a], x[:, k], zi=lfiltic([1 - a], [1, -a], [x[0, k]]))[0] for k in range(x.shape[1])]
    return np.stack(made, axis=1)


def _travel(t: Array, qd: Array) -> Array:
    """Return the angle (n, joints) turned since each joint last turned back, rad."""
    dt = np.diff(t, prepend=t[:1])[:, None]
    made = np.zeros_like(qd)
    for j in range(qd.shape[1]):
        path = np.cumsum(np.abs(qd[:, j]) * dt[:, 0])
        turned = np.flatnonzero(np.diff(np.sign(qd[:, j])) != 0) + 1
        start = np.zeros(len(t))
        start[turned] = path[turned]
        made[:, j] = path - np.maximum.accumulate(start)
    return made


def variables(stretch: Stretch, model: StripTheory, driven: bool = True) -> dict[str, Array]:
    """Return the variables (n,) of the unknown on a stretch by name; `model` gives the torques.

    Where the arm is not `driven` there are neither torques nor accelerations: what is compared with 0 is then the inertia times the very
    noise of these, and a function of them would be found in every record of an angle.
    """
    s = stretch.segment
    tau = model.torque(Motion.of(s)).numpy()
    steady = s.steady or len(s) < 8
    rate = np.zeros_like(tau) if steady else np.gradient(tau, s.t, axis=0)
    slow = s.qd if steady else _low_pass(s.t, s.qd, SLOWED)
    travel = np.zeros_like(s.qd) if steady else _travel(s.t, s.qd)
    named: dict[str, Array] = {}
    forced = (("ddq{}_rad_s2", s.qdd), ("modelled tau{}_Nm", tau), ("modelled dtau{}_Nm_s", rate)) if driven else ()
    for label, x in (("q{}_rad", s.q), ("dq{}_rad_s", s.qd), ("recent dq{}_rad_s", slow), ("travel{}_rad", travel), *forced):
        named |= {label.format(j + 1): x[:, j] for j in range(x.shape[1])}
    named["u0_m_s"] = s.u0
    named["du0_m_s2"] = s.du0
    return named


def _pairs(links: int) -> list[tuple[str, str]]:
    q, qd, qdd = ([label.format(j + 1) for j in range(links)] for label in ("q{}_rad", "dq{}_rad_s", "ddq{}_rad_s2"))
    found = [pair for j in range(links) for pair in ((q[j], qd[j]), (qd[j], qdd[j]), (qd[j], "u0_m_s"))]
    return [*found, *combinations(q, 2), *combinations(qd, 2), *[(q[i], qd[j]) for i in range(links) for j in range(links) if i != j]]


def unknown_of(design: Design, model: StripTheory) -> Unknown:
    """Return the columns of the unknown on the rows of `design`."""
    problem: Problem = design.problem
    found = [variables(stretch, model, not design.undriven) for stretch in problem.stretches]
    counted = [stretch.segment.keep for stretch in problem.stretches]
    place: list[dict[str, Array]] = [{} for _ in found]
    varying = []
    for name in found[0]:
        joined = np.concatenate([x[name][keep] for x, keep in zip(found, counted, strict=True)])
        low, high = np.percentile(joined, RANGE)
        if not high - low > 1e-9 * max(1.0, float(np.abs(joined).max())):
            continue
        varying.append(name)
        order = np.sort(joined)
        for x, made in zip(found, place, strict=True):
            box = np.clip((x[name] - low) / (high - low), 0, 1)
            made[name] = (box + np.searchsorted(order, x[name]) / len(order)) / 2
    pairs = [pair for pair in _pairs(problem.arm.n_links) if pair[0] in varying and pair[1] in varying]
    tabled = int(any(stretch.segment.steady for stretch in problem.stretches))
    m = np.arange(1, COSINES + 1)
    a, b = (x.ravel() for x in np.meshgrid(np.arange(1, PAIRED + 1), np.arange(1, PAIRED + 1)))

    def columns(stretch: Stretch) -> Array:
        """Return the columns (n, m) of all variables and pairs on a stretch."""
        xi = place[problem.stretches.index(stretch)]
        parts = [np.cos(np.pi * m * xi[name][:, None]) for name in varying]
        parts += [np.cos(np.pi * a * xi[first][:, None]) * np.cos(np.pi * b * xi[second][:, None]) for first, second in pairs]
        parts += [np.full((len(stretch.segment), 1), float(stretch.segment.steady))] * tabled
        return np.concatenate(parts, axis=1) if parts else np.zeros((len(stretch.segment), 0))

    weights = np.concatenate([*[1.0 / m for _ in varying], *[1.0 / (a * b) for _ in pairs], np.ones(tabled)])
    group = np.concatenate([*[np.full(COSINES, g) for g in range(len(varying))],
                            *[np.full(len(a), len(varying)) for _ in pairs], np.full(tabled, len(varying) + 1)])
    return Unknown(design.rows(columns), weights, group.astype(np.int64), (*varying, PAIRS, *[CONSTANT] * tabled))
