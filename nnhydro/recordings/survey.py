"""Look a whole campaign over: what was given, what is derived, what is odd, and how the arm meets the water."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign, every_one
from nnhydro.recordings.checks import CHECKS
from nnhydro.recordings.checks.jitter import jitter
from nnhydro.recordings.checks.oddity import ArmCheck, CampaignCheck, Oddity, RecordingCheck, TableCheck, for_some, merge_kinds
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.checks.stuck_channels import FREE
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.recording import Recording, SteadyTable
from nnhydro.recordings.repeats import NoiseFloor, noise_floor
from nnhydro.recordings.surroundings import absolute_angles, absolute_rates, through_water
from nnhydro.runtime.workers import HERE, Workers, spread

Array = NDArray[np.float64]
CHANNELS = {"q": "q", "qd": "dq", "qdd": "ddq", "u0": "u0", "du0": "du0", "base": "base", "dbase": "dbase", "heading": "base_yaw",
            "current": "current", "dcurrent": "dcurrent", "tau": "tau", "tau_sim": "tau_sim", "clock": "clock"}
ORDER = ("error", "warning", "note")
LOOKED_AT = 20  # recordings of a campaign whose errors a command tells before it works
BATCH = 8  # recordings a task: reading and checking one takes some 20 ms, handing out a task 1 ms


@final
@dataclass(frozen=True)
class Entry:
    """What one recording holds."""

    name: str
    rows: int
    duration_s: float
    rate_hz: float
    jitter: float  # of the median step
    given: tuple[str, ...]
    derived: tuple[str, ...]
    steps: tuple[str, ...]  # what the reader did


@final
@dataclass(frozen=True)
class LinkFacts:
    """How one link meets the water at its tip."""

    slenderness: float  # L / D
    top_speed_m_s: float
    reynolds: float | None  # of the top speed; None for a dry arm
    travel: float  # longest stroke of the tip without reversal, in diameters


@final
@dataclass(frozen=True)
class Survey:
    """All that `nnhydro check` reports."""

    entries: tuple[Entry, ...]
    tables: tuple[tuple[str, int], ...]  # steady tables: name, runs
    oddities: tuple[Oddity, ...]
    how: Preparation | None  # None where an error keeps the recordings from being prepared
    floor: NoiseFloor | None
    links: tuple[LinkFacts, ...]
    sliding: bool = False  # a linear axis: m and N

    @property
    def undriven(self) -> bool:
        """Whether no recording has a torque: a free pendulum, a rolling ship."""
        return bool(self.entries) and sum(FREE in oddity.what for oddity in self.oddities) == len(self.entries)

    @property
    def errors(self) -> tuple[Oddity, ...]:
        """The findings that make the campaign unusable."""
        return tuple(oddity for oddity in self.oddities if oddity.severity == "error")


def entry(reading: Reading) -> Entry:
    """Return what one recording holds."""
    r = reading.recording
    given = tuple(label for key, label in CHANNELS.items() if getattr(r, key) is not None)
    needed = ("qd", "qdd", *(f"d{name}" for name in ("u0", "base", "current") if getattr(r, name) is not None))
    derived = tuple(CHANNELS[key] for key in needed if getattr(r, key) is None)
    rate = 1.0 / reading.dt if reading.dt > 0 else float("nan")
    times = r.t[np.isfinite(r.t)]
    return Entry(r.name, len(r), float(np.ptp(times)) if len(times) else 0.0, rate, jitter(reading), given, derived, r.steps)


def tip_speed(arm: Arm, link: int, q: Array, qd: Array, hub: Array) -> Array:
    """Return the normal speed w_i(L_i) = A_i L_i + B_i of the tip of `link` (from 0), m/s (n,). Source: Rivera (1995), 3-1-10.

    `q`, `qd` (n, links) hold heading and yaw rate in the first joint, `hub` (n, 2) m/s is how joint 1 moves through the water.
    """
    if arm.sliding:
        across: Array = qd[:, 0] + hub @ np.array([np.cos(arm.direction_rad), np.sin(arm.direction_rad)])
        return across
    phi = q[:, : link + 1].sum(axis=1)
    speed: Array = qd[:, : link + 1].sum(axis=1) * arm.L[link] + hub[:, 1] * np.cos(phi) - hub[:, 0] * np.sin(phi)
    for j in range(link):
        speed = speed + arm.L[j] * qd[:, : j + 1].sum(axis=1) * np.cos(q[:, j + 1: link + 1].sum(axis=1))
    return speed


def _tips(arm: Arm, reading: Reading) -> Iterator[tuple[int, Array, Array]]:
    """(link, steps of time, normal speeds of its tip) over the blocks of a recording."""
    r = reading.recording
    angles, hub = absolute_angles(r), through_water(r)
    for start, stop in reading.stretches:
        at = reading.blocks(start, stop)
        if len(at) > 2:
            dt = np.diff(r.t[at])
            qd = np.diff(angles[at], axis=0) / dt[:, None]
            for link in range(arm.n_links):
                yield link, dt, tip_speed(arm, link, angles[at[:-1]], qd, hub[at[:-1]])


def _stroke(dt: Array, w: Array) -> float:
    """Longest path without reversal, m."""
    turn = np.concatenate([[0], np.cumsum(np.diff(np.sign(w)) != 0)]).astype(int)
    return float(np.bincount(turn, weights=np.abs(w) * dt).max()) if len(w) else 0.0


@final
@dataclass(frozen=True, eq=False)
class _RecordingFacts:
    """One recording looked over: what it holds, what is odd, top speed m/s and longest stroke m of every link's tip."""

    entry: Entry
    oddities: tuple[Oddity, ...]
    at_zero: tuple[str, ...]  # columns that are 0 throughout
    top: Array
    stroke: Array


def _of_recording(reading: Reading) -> tuple[Oddity, ...]:
    return tuple(replace(oddity, check=check.id) for check in CHECKS.values() if isinstance(check, RecordingCheck)
                 for oddity in check.find(reading))


def _look_over(campaign: Campaign, name: str) -> _RecordingFacts:
    reading = Reading.of(campaign.load(name), campaign.arm)
    found = _of_recording(reading)
    top, stroke = np.zeros(campaign.arm.n_links), np.zeros(campaign.arm.n_links)
    if not any(oddity.severity == "error" for oddity in found):
        for link, dt, w in _tips(campaign.arm, reading):
            top[link] = max(top[link], float(np.percentile(np.abs(w), 99.5)))
            stroke[link] = max(stroke[link], _stroke(dt, w))
    return _RecordingFacts(entry(reading), found, reading.at_zero, top, stroke)


def _some_seen(campaign: Campaign, names: tuple[str, ...]) -> list[_RecordingFacts]:
    """A batch of recordings: the piece of work that goes to a worker, which reads their files."""
    return [_look_over(campaign, name) for name in names]


def _facts(campaign: Campaign, seen: Sequence[_RecordingFacts]) -> tuple[LinkFacts, ...]:
    """Slenderness, top speed, Reynolds number and travel of every link."""
    arm = campaign.arm
    tops, strokes = [survey.top for survey in seen], [survey.stroke for survey in seen]
    top, stroke = (np.max([np.zeros(arm.n_links), *values], axis=0) for values in (tops, strokes))
    for table in campaign.steady:
        for link in range(arm.n_links):
            speed = tip_speed(arm, link, absolute_angles(table), absolute_rates(table, table.qd), through_water(table))
            top[link] = max(top[link], float(np.abs(speed).max(initial=0.0)))
    nu = arm.fluid.kinematic_viscosity_m2_s
    return tuple(LinkFacts(float(arm.L[i] / arm.D[i]), float(top[i]), None if arm.dry else float(top[i] * arm.D[i] / nu),
                           float(stroke[i] / arm.D[i])) for i in range(arm.n_links))


def _of_arm_and_tables(arm: Arm, tables: tuple[SteadyTable, ...]) -> Iterator[Oddity]:
    for check in CHECKS.values():
        if isinstance(check, ArmCheck):
            yield from (replace(oddity, check=check.id) for oddity in check.find(arm))
        elif isinstance(check, TableCheck):
            for table in tables:
                yield from (replace(oddity, check=check.id) for oddity in check.find(table, arm))


def oddities_of(recording: Recording, arm: Arm) -> list[str]:
    """Return what looks wrong with one motion, a line each: errors and warnings of the checks that need no other recording."""
    reading = Reading.of(recording, arm)
    return [arm.text(oddity.message) for oddity in _of_recording(reading) if oddity.severity in ("error", "warning")]


def errors_of(campaign: Campaign) -> list[str]:
    """Return what makes the arm or some of the recordings unusable, a line a kind; of many recordings `LOOKED_AT` are looked at."""
    names = campaign.names[::-(-len(campaign.names) // LOOKED_AT) or 1]
    of_recordings, at_zero = list[Oddity](), Counter[str]()
    for name in names:
        reading = Reading.of(campaign.load(name), campaign.arm)
        of_recordings += _of_recording(reading)
        at_zero.update(reading.at_zero)
    found = [*_of_arm_and_tables(campaign.arm, campaign.steady), *for_some(of_recordings, len(names), at_zero)]
    return [campaign.arm.text(kind[0].message) for kind in merge_kinds(oddity for oddity in found if oddity.severity == "error")]


def survey(campaign: Campaign, cutoff_hz: float | None = None, workers: Workers = HERE) -> Survey:
    """Return all that can be said about a campaign; `workers` share the recordings. Raises RecordingError where one cannot be read."""
    say = campaign.arm.text
    every_one(campaign.names, campaign.load)
    batches = [campaign.names[k:k + BATCH] for k in range(0, len(campaign.names), BATCH)]
    seen = [facts for some in spread(_some_seen, [(campaign, batch) for batch in batches], workers) for facts in some]
    at_zero = Counter(name for facts in seen for name in facts.at_zero)
    found = for_some((oddity for facts in seen for oddity in facts.oddities), len(seen), at_zero)
    found += _of_arm_and_tables(campaign.arm, campaign.steady)
    how, floor, links = None, None, tuple[LinkFacts, ...]()
    if not any(oddity.severity == "error" for oddity in found):
        how = campaign.plan(cutoff_hz)
        for check in CHECKS.values():
            if isinstance(check, CampaignCheck):
                found += [replace(oddity, check=check.id) for oddity in check.find(campaign, how)]
        floor, links = noise_floor(campaign, how), _facts(campaign, seen)
    found = [replace(oddity, where=say(oddity.where), what=say(oddity.what), remedy=say(oddity.remedy)) for oddity in found]
    ordered = sorted(found, key=lambda oddity: ORDER.index(oddity.severity))
    tables = tuple((table.name, len(table)) for table in campaign.steady)
    return Survey(tuple(facts.entry for facts in seen), tables, tuple(ordered), how, floor, links, campaign.arm.sliding)
