"""Signs and order of the channels, all together: of every way to read the columns, which one obeys the physics?

    tau_a(j) s_j = [rigid body + drag + added mass + Coulomb + viscous friction](r_i q_b(i), ...)      s, r in {-1, +1};  a, b permutations

Each reading is fitted with coefficients that physics allows (friction and drag take energy, masses within 30 %) and judged by

    log L = - sum_j n_j / (2 k_j) log(sum e_j^2) - |z|^2 / 2 - 3 (number of channels changed)          k_j correlation time of the residual

so that one flag does not lead from two negated torques to one, and swapped torques do not pass. Readings that no recording can tell apart
(the mirror image, without weight and tow) go to the one with the fewest changes. Source: ours.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import permutations, product
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.fitting.linear.least_squares import correlation_time, fit
from nnhydro.fitting.linear.prior import Prior, prior
from nnhydro.fitting.linear.statistics import Statistics, block, columns_and_offset, residual_energy, total
from nnhydro.models.baselines import baseline
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import Oddity
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.readers.map_line import map_line, place
from nnhydro.recordings.recording import Origin
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
RECORDINGS, ROWS = 8, 1500  # looked at, spread over the campaign; rows of each
LOOSE = 0.3  # known_to of the masses here: signs do not hang on them
FARTHEST = 3.0  # standard deviations that a mass may move: no mass is negative
CHANGE = 3.0  # nats against each channel that would have been wrong: one in twenty
SURE = np.log(100.0)  # nats between the likeliest reading and the one as recorded
EXPLAINS, BETTER = 0.6, 0.7  # the likeliest leaves less than so much of the torque, and less than so much of what the recorded one leaves
MOST_JOINTS = 3  # beyond: signs of torques alone are tried
DRY, OIL = "dry", "oil"  # terms of friction
CERTAIN = 1e6  # odds beyond it are not told apart


@final
@dataclass(frozen=True)
class Assignment:
    """One way to read the columns: joint i takes the angle column `angles[i]` times its sign, and so the torque."""

    angles: tuple[int, ...]
    angle_signs: tuple[int, ...]
    torques: tuple[int, ...]
    torque_signs: tuple[int, ...]

    @property
    def changes(self) -> int:
        """How many channels would have been wrong."""
        n = len(self.angles)
        return sum(self.angles[i] != i or self.angle_signs[i] < 0 for i in range(n)) + sum(
            self.torques[i] != i or self.torque_signs[i] < 0 for i in range(n))


def ways(arm: Arm) -> Iterator[Assignment]:
    """Yield every way to read the columns of `arm`; behind a belt, and of many joints, the signs of the torques alone are open."""
    n = arm.n_links
    here, plus = tuple(range(n)), (1,) * n
    signs = list(product((1, -1), repeat=n))
    if arm.drive.kind == "remote" or n > MOST_JOINTS:
        yield from (Assignment(here, plus, here, s) for s in signs)
        return
    for angles, r, torques, s in product(permutations(range(n)), signs, permutations(range(n)), signs):
        yield Assignment(angles, r, torques, s)


def _reread(segment: Segment, way: Assignment) -> Segment:
    """The motion of a segment read in another way."""
    index, sign = list(way.angles), np.array(way.angle_signs, dtype=float)
    return replace(segment, q=sign * segment.q[:, index], qd=sign * segment.qd[:, index], qdd=sign * segment.qdd[:, index])


def _loads(arm: Arm) -> Loads:
    known = baseline("rigid" if arm.dry else "constant").start(arm)
    bare = Loads({name: term for name, term in known.terms.items() if not name.startswith("stated_")})
    n = arm.n_links
    return bare.plus(DRY, CoulombTerm((0.0,) * n)).plus(OIL, ViscousTerm((0.0,) * n))


def _some(segment: Segment) -> Segment:
    """The first rows of a long segment."""
    if len(segment) <= ROWS:
        return segment
    part = slice(0, ROWS)
    pairs = ("t", "q", "qd", "qdd", "u0", "du0", "tau", "keep", "tau_raw", "base", "dbase", "heading", "current", "dcurrent")
    cut = {name: x[part] for name in pairs if (x := getattr(segment, name)) is not None}
    return replace(segment, **cut, tau_sim=None)


@final
@dataclass(frozen=True, eq=False)
class WayFit:
    """How well one way to read the columns obeys the physics."""

    way: Assignment
    likelihood: float  # nats
    error: float  # rms of what is left over rms of the torque


def judge(way: Assignment, motions: list[tuple[Array, Array]], torques: list[Array], loads: Loads, arm: Arm, correlation: Array) -> WayFit:
    """The likelihood of one way, given the columns X, c_0 of its motion and the torques as recorded."""
    index, sign = list(way.torques), np.array(way.torque_signs, dtype=float)
    stats: Statistics = total([block(X, sign * tau[:, index] - c0) for (X, c0), tau in zip(motions, torques, strict=True)])
    free = _friction_as_large_as_the_torque(prior(loads, arm), loads, stats)
    before = replace(free, lowest=np.where(np.isfinite(free.lowest), free.lowest, -FARTHEST),
                     highest=np.where(np.isfinite(free.highest), free.highest, FARTHEST))
    found = fit(stats, before, correlation)
    left = np.maximum(residual_energy(stats, found.theta), 1e-12 * np.maximum(stats.s, 1e-300))
    z = before.z(found.theta)
    size = sum(float((tau**2).sum()) for tau in torques)
    nats = -float((stats.n / correlation[index] / 2 * np.log(left)).sum()) - float(z @ z) / 2 - CHANGE * way.changes
    return WayFit(way, nats, float(np.sqrt(left.sum() / max(size, 1e-300))))


def _friction_as_large_as_the_torque(known: Prior, loads: Loads, stats: Statistics) -> Prior:
    """Return `known` where one standard deviation of each friction makes its joint's torque, whatever the unit of that."""
    energy = np.einsum("jpp->jp", stats.H)
    of_joint = stats.s[energy.argmax(axis=0)], energy.max(axis=0)
    friction = np.concatenate([np.full(len(term.linear_values()), name in (DRY, OIL)) for name, term in loads.linear().items()])
    informative = friction & (of_joint[0] > 0) & (of_joint[1] > 0)
    size = np.sqrt(np.divide(*of_joint, out=np.ones_like(of_joint[0]), where=informative))
    return replace(known, F=size[:, None] * known.F)


@final
@dataclass(frozen=True, eq=False)
class ChannelData:
    """What readings are judged on: the arm with loose masses, some segments with torques, how long their torques are alike, the physics."""

    arm: Arm
    segments: list[Segment]
    torques: list[Array]  # (n, joints) N m, of the compared rows
    correlation: Array  # (joints,) rows
    loads: Loads


def material(campaign: Campaign, how: Preparation, known_to: float = LOOSE) -> ChannelData | None:
    """Return what the readings of `campaign` are judged on, masses `known_to` so much; None where nothing moves or no torque was read."""
    arm = campaign.arm.model_copy(update={"links": tuple(link.model_copy(update={"known_to": known_to}) for link in campaign.arm.links),
                                          "friction": None})
    chosen = campaign.names[::max(1, -(-len(campaign.names) // RECORDINGS))]
    segments = [_some(segment) for name in chosen for segment in campaign.segments(name, how)[:2] if segment.tau is not None]
    segments = [segment for segment in segments if segment.keep.any()]
    torques = [segment.tau[segment.keep] for segment in segments if segment.tau is not None]
    moving = any(np.ptp(segment.q, axis=0).max() > 1e-3 for segment in segments)
    if not torques or not any(np.abs(tau).max() > 0 for tau in torques) or not moving:
        return None
    correlation = np.median([[correlation_time(tau[:, j]) for j in range(arm.n_links)] for tau in torques], axis=0)
    return ChannelData(arm, segments, torques, correlation, _loads(arm))


def columns_of(seen: ChannelData, way: Assignment) -> list[tuple[Array, Array]]:
    """Return the columns X (n, joints, p) and the fixed torque c_0 (n, joints) N m of every segment read in one way."""
    columns = [columns_and_offset(seen.loads, _reread(segment, way), seen.arm) for segment in seen.segments]
    return [(X[segment.keep], c0[segment.keep]) for (X, c0), segment in zip(columns, seen.segments, strict=True)]


@one_thread()
def judged_ways(campaign: Campaign, how: Preparation) -> list[WayFit]:
    """Return every way to read the columns with its likelihood, the likeliest first; empty where nothing moves or no torque was read."""
    seen = material(campaign, how)
    if seen is None:
        return []
    found, motions = [], dict[tuple[tuple[int, ...], tuple[int, ...]], list[tuple[Array, Array]]]()
    for way in ways(seen.arm):
        key = (way.angles, way.angle_signs)
        if key not in motions:
            motions[key] = columns_of(seen, way)
        found.append(judge(way, motions[key], seen.torques, seen.loads, seen.arm, seen.correlation))
    return sorted(found, key=lambda way: -way.likelihood)


def physics_agrees(ways: list[WayFit]) -> bool:
    """Return whether the physics explains the torques, and no other of the judged `ways` is likelier than the columns as recorded."""
    return bool(ways) and ways[0].way.changes == 0 and ways[0].error < EXPLAINS


def _lines(way: Assignment, arm: Arm, origin: Origin, given: set[str]) -> dict[str, str]:
    """The lines of columns.yaml by the channel that each mends: a joint takes the column of another, or a negative."""
    lines = {}
    for joint in range(arm.n_links):
        for channels, column, sign in ((("q", "qd", "qdd"), way.angles[joint], way.angle_signs[joint]),
                                       (("tau",), way.torques[joint], way.torque_signs[joint])):
            for channel in channels if column != joint or sign < 0 else ():
                if channel in ("q", "tau") or channel in given:
                    ours, theirs = arm.column(channel, joint + 1), arm.column(channel, column + 1)
                    lines[ours] = map_line(origin, ours, theirs, sign=sign)
    return lines


def _complaint(way: Assignment, arm: Arm) -> str:
    """What would be wrong, in words."""
    parts = []
    for channel, order, signs in (("torque", way.torques, way.torque_signs), ("angle", way.angles, way.angle_signs)):
        n = len(order)
        negated = [str(order[i] + 1) for i in range(n) if signs[i] < 0]
        if order != tuple(range(n)):
            parts.append(f"the {channel}s of joints {' and '.join(str(i + 1) for i in range(n) if order[i] != i)} are exchanged")
        if negated:
            many = "s" if len(negated) > 1 else ""
            parts.append(f"the {channel}{many} of joint{many} {' and '.join(negated)} {'have' if many else 'has'} the wrong sign")
    return arm.text(", and ".join(parts))


def channel_order(campaign: Campaign, how: Preparation, ways: list[WayFit] | None = None) -> Oddity | None:
    """Return what is wrong with signs or order of the channels, with the lines that mend all of it at once; None where nothing is.

    `ways` are those that were judged, where they were.
    """
    found = judged_ways(campaign, how) if ways is None else ways
    if not found:
        return None
    best = found[0]
    here = next(judged for judged in found if judged.way.changes == 0)
    if best is here or best.likelihood - here.likelihood < SURE or best.error > EXPLAINS or best.error > BETTER * here.error:
        return None
    first = campaign.load(campaign.names[0])
    given = {name for name in ("qd", "qdd") if getattr(first, name) is not None}
    lines = _lines(best.way, campaign.arm, first.origin, given)
    odds = float(np.exp(min(best.likelihood - here.likelihood, np.log(CERTAIN))))
    much = "more than " if odds >= CERTAIN else ""
    what = campaign.arm.text(f"{_complaint(best.way, campaign.arm)}: so read, the physics leaves {best.error:.0%} of the torque, "
                             f"as recorded {here.error:.0%} (odds {much}{odds:.0f} to 1)")
    remedy = f"all of these lines together under 'columns:' {place(first.origin, lines)}: {'; '.join(lines.values())}"
    return Oddity(None, "warning", ", ".join(lines), what, remedy, "channel_order")
