"""The rig as it really is: an arm drawn for a case, what it hides (nnhydro.blind_tests.truth), and what its sensors record of a motion."""

from pathlib import Path
from typing import Any

import numpy as np

from nnhydro.blind_tests.truth import registry
from nnhydro.blind_tests.truth.arms import document
from nnhydro.blind_tests.truth.sensors import FINE, TrueSensors, record
from nnhydro.blind_tests.truth.tank import plain_torque, read
from nnhydro.blind_tests.truth.world import Cause, TrueArm, TrueLink, TrueRun
from nnhydro.conventions import column
from nnhydro.recordings.arm import parse_arm
from nnhydro.recordings.recording import Recording
from nnhydro.simulation.motions.motion_kind import Setting, motion_of

TIMES = ("duration_s", "hold_s", "ramp_s")
MADE, HALVINGS = 200, 25


def _drawn(value: Any, share: float, rng: np.random.Generator) -> Any:
    """Every number of `value` within `share` of itself."""
    return [_drawn(x, share, rng) for x in value] if isinstance(value, list) else value * (1 + share * rng.uniform(-1, 1))


def motions_of(rig: dict, spread: float, rng: np.random.Generator) -> list[dict]:
    """Return the motions of a rig with times drawn within `spread` of those stated."""
    return [{key: x if key not in TIMES else _drawn(x, spread, rng) for key, x in motion.items()} for motion in rig["motions"]]


class Tank:
    """A rig that hides `hidden`: {effect, joint (none: the arm), strength}; the strength is the rms of its torque over the noise."""

    def __init__(self, config: dict, rig: dict, hidden: dict, seed: int) -> None:
        rng = np.random.default_rng([seed, sum(map(ord, rig["name"] + hidden["effect"]))])
        links = (TrueLink(*_drawn(list(values), config["spread"], rng)) for values in zip(*config["arm"].values(), strict=True))
        self.links = TrueArm(tuple(links))
        self.arm = parse_arm(document(self.links, 0.01), "truth")
        self.sensors = TrueSensors(config["rate_hz"], config["given"], "white", config["noise"], 0.0, 2 * np.pi / 2**16, clock=False)
        self.motions = motions_of(rig, config["spread"], rng)
        self.rng, self.cause = rng, None
        runs = [self.run(motion, "quiet") for motion in self.motions]
        plain = [plain_torque(run, self.links) for run in runs]
        self.sigma = config["noise"] * np.sqrt((np.concatenate(plain) ** 2).mean(axis=0))  # the sensor's own, whatever it measures
        self.cause = self._of_strength(hidden, runs, plain, int(rng.integers(1000)))

    def _of_strength(self, hidden: dict, runs: list[TrueRun], plain: list[np.ndarray], first: int) -> Cause:
        """The effect whose torque stands so far above the noise in `runs`."""
        def made(level: float) -> Cause:
            causes = (registry.makers()[hidden["effect"]](np.random.default_rng(first + k), self.links).make(level) for k in range(MADE))
            return next(c for c in causes if c.shape == "plain" and c.joint == hidden.get("joint"))

        def strength(level: float) -> float:
            cause = made(level)
            less = np.concatenate([read(run, self.links, [cause], base).tau - base for run, base in zip(runs, plain, strict=True)])
            return float(np.sqrt(((less / self.sigma) ** 2).mean(axis=0)).max())

        low, high = 1e-6, 1e3
        for _ in range(HALVINGS):
            middle = float(np.sqrt(low * high))
            low, high = (middle, high) if strength(middle) < hidden["strength"] else (low, middle)
        return made(high)

    def run(self, motion: dict, name: str) -> TrueRun:
        """Return what the links do in one motion of a recipe."""
        reference = motion_of({"name": name, **motion}, "study").reference(Setting(self.arm, np.random.default_rng(0), Path()))
        t = np.arange(round(reference.duration * self.sensors.rate * FINE)) / (self.sensors.rate * FINE)
        return TrueRun(name, t, *reference.at(t))

    def record(self, motion: dict, name: str) -> Recording:
        """Return what the sensors record of it."""
        run = self.run(motion, name)
        seen = record(run, read(run, self.links, [self.cause]), self.links, self.sensors, self.sigma, self.rng, True)
        q, qd, qdd, tau = (np.column_stack([seen[column(key, j)] for j in (1, 2)]) if column(key, 1) in seen else None
                           for key in ("q", "qd", "qdd", "tau"))
        return Recording(name, seen["t_s"], q, tau, qd, qdd, seen.get("u0_m_s"), seen.get("du0_m_s2"))
