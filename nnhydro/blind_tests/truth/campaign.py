"""Draw a whole concealed campaign: arm, motions, hidden causes at the size asked for, sensors; and the answer.

    kind       effect (ids of the catalogue), none, base_form (the baseline's law is slightly wrong), unlisted
    strength   weak or strong, see visibility.py

Everything follows from (seed, index). A draw in which a cause cannot reach its size is thrown away and the next one is tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from nnhydro.blind_tests.truth import registry
from nnhydro.blind_tests.truth.arms import document, draw_arm
from nnhydro.blind_tests.truth.motions import Plan, carry_out, plans
from nnhydro.blind_tests.truth.partial_causes import Part, draw_part
from nnhydro.blind_tests.truth.rivals import RUNS, nearest
from nnhydro.blind_tests.truth.sensors import FINE, TrueSensors, draw_sensors, record
from nnhydro.blind_tests.truth.tank import motor_torque, plain_torque, read
from nnhydro.blind_tests.truth.visibility import FACTORS, Yardstick, reference, size_to_target
from nnhydro.blind_tests.truth.world import Array, Cause, Draft, Generator, TrueArm, TrueRun

ATTEMPTS = 30
PHASES = 8  # of a cause that acts by chance: an unseen motion's truth is the mean over them
OTHERS, ANOTHER = 32, 1000  # phases of chance, and from which seed on, for the truth as a model: it cannot know those that were drawn
MIX = {"effect": 0.6, "none": 0.2, "base_form": 0.1, "unlisted": 0.1}
MORNING = 9 * 3600.0  # s, when the campaign begins
SIZES = {"small": ((8, 8), (6.0, 7.0), (50.0,)), "normal": ((8, 20), (6.0, 12.0), (50.0, 80.0, 100.0))}


class NotVisibleError(Exception):
    """No draw showed the cause at the size asked for."""


@dataclass(frozen=True)
class Wish:
    """What to hide: an id, none, random, mixed, unlisted, base_form, unlisted:..., base_form:...

    How strong; on what arm; how many at once; and in what part of the campaign.
    """

    effect: str = "random"
    strength: str = "strong"
    links: int | None = None
    effects: int = 1
    size: str = "normal"
    acts: str = "always"


@dataclass(frozen=True)
class UnseenRun:
    """An unseen run with what loads it, and the columns in which encoders of the same steps would record its links themselves.

    No hidden cause moves the angles of `links`: who knows the truth knows what a compliant drive or a moved zero has done to them.
    """

    run: TrueRun
    arm: TrueArm
    causes: tuple[Cause, ...]
    links: dict[str, Array]

    def torque(self, t: Array, *motion: Array) -> Array:
        """Return what the torque sensors would read (n, L) in this run on the motion q, qd, qdd (n, L), u0, du0 (n,), the mean over chance.

        Between the rows the motion is a cubic spline: what remembers is stepped as finely as the run itself was.
        """
        fine = np.linspace(t[0], t[-1], FINE * (len(t) - 1) + 1)
        q, qd, qdd, u0, du0 = (CubicSpline(t, x)(fine) for x in motion)
        run = replace(self.run, t=fine, q=q, qd=qd, qdd=qdd, u0=u0, du0=du0, seed=self.run.seed + ANOTHER)
        return _expected_torque(run, self.arm, self.causes, OTHERS)[::FINE]


@dataclass(frozen=True)
class World:
    """An arm as it really is and as arm.yaml states it, what it hides, and the runs of the campaign that shows it."""

    arm: TrueArm
    stated: dict[str, Any]
    known_to: float
    hidden: tuple[tuple[Cause, float], ...]  # each with its noncentrality
    part: Part | None
    sensors: TrueSensors
    sigma: Array  # (L,) N m of the torque sensors' noise
    measure: Yardstick

    @property
    def causes(self) -> tuple[Cause, ...]:
        """What is hidden."""
        return tuple(cause for cause, _ in self.hidden)

    @property
    def added_mass(self) -> bool:
        """Whether the baseline has added mass: not where that is what is hidden."""
        return all(cause.id != "added_mass" for cause in self.causes)


@dataclass(frozen=True)
class ConcealedCampaign:
    """A campaign as files (name -> columns), what arm.yaml holds, the baseline to diagnose it against, and the answer to be sealed."""

    files: dict[str, dict[str, Array]]
    arm: dict[str, Any]
    baseline: str
    answer: dict[str, Any]
    unseen: dict[str, UnseenRun]


def choose(rng: Generator, wish: Wish, links: int) -> tuple[str, ...] | None:
    """Return the names of the causes to hide; None where the one that is wished for needs two links, and there is one."""
    effect = wish.effect
    if effect == "mixed":
        effect = str(rng.choice(list(MIX), p=list(MIX.values())))
        effect = "random" if effect == "effect" else effect
    if effect == "none":
        return ()
    if effect in ("unlisted", "base_form"):
        return (str(rng.choice(registry.names(effect, links))),)
    if effect != "random" and effect not in registry.names(effect.rpartition(":")[0], links):
        return None
    never = ("added_mass",) if wish.acts == "always" else ("added_mass", "torque_drift")
    others = [name for name in registry.random_names(links) if name not in (effect, *never)]
    first = (str(rng.choice(others)),) if effect == "random" else (effect,)
    more = rng.permutation([name for name in others if name not in first])[: wish.effects - 1]
    return (*first, *(str(name) for name in more))


def _runs(rng: Generator, arm: TrueArm, todo: Sequence[Plan], sensors: TrueSensors, stem: str, start: float) -> tuple[TrueRun, ...]:
    """The runs of a plan, a few minutes apart on the clock."""
    result = []
    for number, plan in enumerate(todo, 1):
        result.append(carry_out(plan, len(arm.links), FINE * sensors.rate, f"{stem}_{number:02d}", start, int(rng.integers(2**31))))
        start += round(float(rng.uniform(150, 360)), 1)
    return tuple(result)


def _local(rng: Generator, reference: Yardstick, draft: Draft, acts: str) -> tuple[Draft, Part | None] | None:
    """Return the draft as it acts in a part of the campaign, and the part; None where it cannot."""
    sample = draft.make(draft.low)
    part = draw_part(rng, acts, reference.runs, sample.joint) if acts != "always" else None
    if part is None:
        return draft, None
    if acts == "region" and (sample.load is None or sample.joint is None):
        return None
    return replace(draft, make=lambda a: replace(draft.make(a), share=part.share)), part


def _hide(rng: Generator, reference: Yardstick, names: Sequence[str], wish: Wish) -> tuple[list[tuple[Cause, float]], Part | None] | None:
    """Return the causes with their lambdas and the part in which they act; None where one of them cannot be made visible enough."""
    low, high = FACTORS[wish.strength]
    found: list[tuple[Cause, float]] = []
    part: Part | None = None
    for name in names:
        local = _local(rng, reference, registry.makers()[name](rng, reference.arm), wish.acts)
        if local is None:
            return None
        draft, part = local
        target = reference.limit * float(np.exp(rng.uniform(np.log(low), np.log(high))))
        cause, size = size_to_target(reference, draft, target)
        if draft.low < draft.high and not 0.7 * low * reference.limit <= size <= 1.4 * high * reference.limit:
            return None
        found.append((cause, size))
    if len(found) > 1:
        columns = [reference.column([cause]) for cause, _ in found]
        alone = [reference.size([cause], columns[:k] + columns[k + 1:]) for k, (cause, _) in enumerate(found)]
        if min(alone) < 0.7 * low * reference.limit:
            return None
        found = [(cause, size) for (cause, _), size in zip(found, alone, strict=True)]
    return found, part


def _expected_torque(run: TrueRun, arm: TrueArm, causes: Sequence[Cause], phases: int = PHASES) -> Array:
    """Return what the torque sensors would read (n, L), the mean over chance."""
    often = phases if any(cause.chance for cause in causes) else 1
    readings = [read(replace(run, seed=run.seed + k), arm, causes).tau for k in range(often)]
    mean: Array = np.mean(readings, axis=0)
    return mean


def _answer(wish: Wish, reference: Yardstick, hidden: Sequence[tuple[Cause, float]], known_to: float) -> dict[str, Any]:
    """Return what is to be sealed, without the unseen motions' torques."""
    def entry(cause: Cause, size: float) -> dict[str, Any]:
        """Return what the sealed answer says of one cause; `size` is its noncentrality."""
        return {"effect": cause.id, "family": cause.family, "joint": cause.joint, "shape": cause.shape, "law": cause.law,
                "chance": cause.chance, "near": list(cause.near), "lambda": round(size, 2), "over_limit": round(size / reference.limit, 3),
                "parameters": {key: {"value": float(f"{value:.6g}"), "unit": unit} for key, (value, unit) in cause.parameters.items()}}

    kind = hidden[0][0].id.rpartition(":")[0] or "effect" if hidden else "none"
    sensors, arm = reference.sensors, reference.arm
    return {"schema": "nnhydro/answer/1", "kind": kind, "strength": wish.strength if kind in ("effect", "unlisted") else None,
            "effects": [entry(cause, size) for cause, size in hidden], "limit": round(reference.limit, 3), "links": len(arm.links),
            "belt": arm.belt, "known_to": known_to, "noise": {"kind": sensors.noise, "level": round(sensors.level, 5)},
            "given": sensors.given, "rate_hz": sensors.rate, "recordings": len(reference.runs),
            "coefficients": {"cd": [round(link.C_D, 5) for link in arm.links], "cm": [round(link.C_M, 5) for link in arm.links]}}


def draw_world(seed: int, index: int, wish: Wish) -> World:
    """Return the arm of campaign `index` of the suite `seed` with what it hides; raise NotVisibleError where no draw shows that."""
    return _first_draw(seed, index, wish)[2]


def draw_campaign(seed: int, index: int, wish: Wish) -> ConcealedCampaign:
    """Return campaign `index` of the suite `seed`; raise NotVisibleError where no draw shows what is to be hidden."""
    attempt, rng, world = _first_draw(seed, index, wish)
    made = _make_campaign(rng, wish, world)
    made.answer["seed"] = [seed, index, attempt]
    return made


def _first_draw(seed: int, index: int, wish: Wish) -> tuple[int, Generator, World]:
    """The first draw that shows what is to be hidden: its number, its world, and the generator for all that follows."""
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([seed, index, attempt])
        world = _attempt(rng, wish)
        if world is not None:
            return attempt, rng, world
    raise NotVisibleError(f"{wish.effect} ({wish.strength}, {wish.links or 'any number of'} links)")


def _attempt(rng: Generator, wish: Wish) -> World | None:
    """One draw of a concealed world; None where its causes cannot be shown at the strength asked for."""
    links = wish.links or (2 if rng.random() < 0.75 else 1)
    counts, seconds, rates = SIZES[wish.size]
    names = choose(rng, wish, links)
    if names is None:
        return None
    belt = links == 2 and rng.random() < 0.15 and all(registry.takes_belt(name) for name in names)
    arm, stated, known_to = draw_arm(rng, links, belt)
    inertia_hidden = "added_mass" in names
    if inertia_hidden:
        arm = replace(arm, links=tuple(replace(k, C_M=0.0) for k in arm.links))
    sensors = draw_sensors(rng, rates, "torque_drift" in names)
    runs = _runs(rng, arm, plans(rng, links, int(rng.integers(counts[0], counts[1] + 1)), seconds), sensors, "run", MORNING)
    healthy = np.concatenate([motor_torque(plain_torque(run, arm, 20), arm) for run in runs])
    sigma = sensors.level * np.sqrt((healthy**2).mean(axis=0))
    measure = reference(runs, arm, known_to, sensors, sigma, not inertia_hidden)
    made = _hide(rng, measure, names, wish)
    if made is None:
        return None
    return World(arm, document(stated, known_to), known_to, tuple(made[0]), made[1], sensors, sigma, measure)


def _make_campaign(rng: Generator, wish: Wish, world: World) -> ConcealedCampaign:
    """The campaign of a world as its sensors record it, with the answer."""
    arm, sensors, sigma, measure, causes = world.arm, world.sensors, world.sigma, world.measure, world.causes
    _, seconds, _ = SIZES[wish.size]
    files = {f"recordings/{run.name}.csv": record(run, read(run, arm, causes, plain), arm, sensors, sigma, rng, True)
             for run, plain in zip(measure.runs, measure.healthy, strict=True)}
    answer = _answer(wish, measure, world.hidden, world.known_to) | {"unseen": {}}
    some = reference(measure.runs[:RUNS], arm, world.known_to, sensors, sigma, world.added_mass)
    for entry, near in zip(answer["effects"], nearest(rng, some, world.hidden), strict=True):
        entry["rivals"] = near
        entry |= {} if world.part is None else {"acts": world.part.answer()}
    todo = [replace(plan, seconds=seconds[0]) for plan in plans(rng, len(arm.links), 9, seconds)[:3]]
    unseen = {}
    for run in _runs(rng, arm, todo, sensors, "motion", measure.runs[-1].start + 300.0):
        seen, same = read(run, arm, causes), deepcopy(rng)
        files[f"unseen/{run.name}.csv"] = record(run, seen, arm, sensors, sigma, rng, False)
        alone = record(run, replace(seen, q=run.q, qd=run.qd, qdd=run.qdd), arm, sensors, sigma, same, False)
        unseen[run.name] = UnseenRun(run, arm, causes, alone)
        truth = _expected_torque(run, arm, causes)[::FINE]
        answer["unseen"][run.name] = {"t_s": run.t[::FINE].round(6).tolist(), "tau_Nm": truth.round(5).tolist()}
    return ConcealedCampaign(files, world.stated, "constant" if world.added_mass else "drag-only", answer, unseen)
