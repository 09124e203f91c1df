"""What a campaign is made of: an arm, motions, sensors, and hidden effects with their law; and its torques before any noise."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from machines import Arm, Array
from mechanics import Link, State, bare_torques, behind_drive, kinematics
from motions import FreeSwing, Motion


@dataclass
class Sensors:
    """How a campaign is recorded: noise as a share of each joint's rms torque, and the rest."""

    noise: float = 0.01
    ar: float = 0.5  # memory of the noise from row to row
    tails: float = 0.0  # degrees of freedom of Student's t, then without memory
    loudness: tuple[float, ...] = (1.0,)  # of the recordings in turn
    quantum: float = 2 * np.pi / 16384  # of the encoder, rad
    torque_quantum: float = 0.0  # share of the rms torque
    smooth_hz: float = 0.0  # torques smoothed to and fro
    uneven: float = 0.0  # jitter of the times, share of the step
    rates: float = 0.0  # noise of recorded rates; 0: not recorded
    accelerations: float = 0.0
    clock: bool = True


@dataclass
class Effect:
    """The name of a hidden effect, its joint, its law in words, and other names that this campaign cannot tell from it."""

    name: str
    joint: int | None
    law: str
    accept: list[str] = field(default_factory=list)


@dataclass
class Scene:
    """One motion of the arm with the torques that sensors would read without any hidden effect."""

    machine: Arm
    state: State
    links: list[Link]
    tau: Array
    rng: np.random.Generator


@dataclass
class Outcome:
    """What hidden effects add to the torques, by name; torques where they are no sum, and angles as read where they are wrong."""

    parts: dict[str, Array] = field(default_factory=dict)
    tau: Array | None = None
    q: Array | None = None


def no_effect(_: Scene) -> Outcome:
    """The law of a healthy campaign."""
    return Outcome()


@dataclass
class Campaign:
    """A campaign to be made; unseen motions are given without torques."""

    title: str
    machine: Arm
    motions: Sequence[Motion | FreeSwing]
    rate_hz: float
    sensors: Sensors
    style: str
    unseen: list[Motion] = field(default_factory=list)
    law: Callable[[Scene], Outcome] = no_effect
    hidden: list[Effect] = field(default_factory=list)
    note: str = ""
    dt: float = 0.002  # of the fine grid, s
    pause_s: float = 120.0  # between recordings, at least; up to three times as long
    free: bool = False  # shares are of the torque of the weight


@dataclass
class Run:
    """One recording on the fine grid, without noise: angles as read, torques, and what each effect adds."""

    motion: Motion | FreeSwing
    state: State
    q: Array
    tau: Array
    parts: dict[str, Array]


def simulate(campaign: Campaign, rng: np.random.Generator) -> list[Run]:
    """All recordings of a campaign, the unseen ones last, on one clock."""
    motions = [*campaign.motions, *campaign.unseen]
    starts, total = [], 0.0
    for motion in motions:
        starts.append(total)
        total += motion.seconds + rng.uniform(1, 3) * campaign.pause_s
    runs = []
    for motion, start in zip(motions, starts, strict=True):
        state = motion.at(np.arange(0, motion.seconds + campaign.dt / 2, campaign.dt))
        state.clock, state.total = start + state.t, total
        links = kinematics(campaign.machine, state)
        tau = behind_drive(campaign.machine, bare_torques(campaign.machine, state, links), state)
        scene = Scene(campaign.machine, state, links, 0 * tau if state.free else tau, rng)
        outcome = campaign.law(scene)
        tau = scene.tau + sum(outcome.parts.values()) if outcome.tau is None else outcome.tau
        runs.append(Run(motion, state, state.q if outcome.q is None else outcome.q, tau, outcome.parts))
    return runs
