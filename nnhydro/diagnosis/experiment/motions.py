"""Motions that a rig can do: slews, sums of sines and tows drawn within its limits."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import TIME, column
from nnhydro.diagnosis.experiment.rig_limits import Rig
from nnhydro.errors import NnhydroError
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.segment import Segment
from nnhydro.simulation.motions.motion_kind import Setting, State, TimedMotion, motion_of
from nnhydro.simulation.run import grid
from nnhydro.simulation.sensors import channels

Array = NDArray[np.float64]
NARROW, WIDE = 0.3, 1.0  # shares of the limits between which the extents of motions are drawn
SINES = 3  # sinusoids of a Fourier motion per joint
DURATION_MARGIN = 2.0  # longest proposed motion, in usual durations on the rig


@final
@dataclass(frozen=True, eq=False)
class CandidateMotion:
    """A motion that the rig can do: as an entry of a recipe, and sampled at the times `t` (n,) s."""

    document: dict[str, Any]
    t: Array
    state: State

    def segment(self, name: str, rate_hz: float) -> Segment:
        """Return the motion as a stretch without torque, at `rate_hz` or a little more, not above its own rate."""
        every = max(1, int(1 / (rate_hz * (self.t[1] - self.t[0]))))
        t, s = self.t[::every], self.state
        q, qd, qdd, u0, du0 = (x[::every] for x in (s.q, s.qd, s.qdd, s.u0, s.du0))
        none, keep = np.zeros_like(q), np.ones(len(t), dtype=bool)
        return Segment(name, t, q, qd, qdd, u0, du0, none, keep, None, None, none, False, 0, len(t))

    def columns(self, arm: Arm) -> dict[str, Array]:
        """Return the columns of a motion file, angles in the arm's own channels."""
        s, joints = self.state, self.state.q.shape[1]
        given = {"q": channels(s.q, arm), "qd": channels(s.qd, arm), "qdd": channels(s.qdd, arm)}
        out = {TIME: self.t} | {column(key, j + 1): x[:, j] for key, x in given.items() for j in range(joints)}
        return out | ({column("u0"): s.u0, column("du0"): s.du0} if s.u0.any() else {})


def _carriage(rig: Rig, rng: np.random.Generator) -> dict[str, Any]:
    """The carriage of a motion: at rest in half of the draws."""
    ramp = min(1.0, 0.2 * rig.seconds)
    speed = float(rng.choice([-1.0, 1.0]) * rng.uniform(NARROW, WIDE) * rig.u0) if rig.u0 > 0 and rng.random() < 0.5 else 0.0
    return {"carriage": {"u0_m_s": speed, "ramp_s": ramp, "start_s": 0.1}} if speed else {}


def _slew(rig: Rig, rng: np.random.Generator) -> dict[str, Any]:
    legs = int(rng.integers(2, 6))
    stops = rng.uniform(rig.q[:, 0], rig.q[:, 1], (legs + 1, len(rig.q)))
    if rng.random() < 0.5:  # one joint alone
        alone = int(rng.integers(len(rig.q)))
        stops[:, [j for j in range(len(rig.q)) if j != alone]] = stops[0, [j for j in range(len(rig.q)) if j != alone]]
    way = np.abs(np.diff(stops, axis=0))
    fastest, hardest = (np.maximum(x, 1e-9) for x in (rig.rate, rig.acceleration))  # 0 for a joint that has never moved
    quick = np.maximum(1.875 * way / fastest, np.sqrt(5.7735 * way / hardest)).max(axis=1)  # peaks of a minimum-jerk slew
    slower = rng.uniform(1.05, 4.0)
    pause = float(rng.choice([0.0, 0.5]))
    return {"kind": "slew", "q_rad": stops.tolist(), "duration_s": (slower * quick + 0.05).tolist(), "pause_s": pause}


def _fourier(rig: Rig, rng: np.random.Generator) -> dict[str, Any]:
    joints, seconds = len(rig.q), rig.seconds
    centre = rig.q.mean(axis=1) + rng.uniform(-0.3, 0.3, joints) * np.ptp(rig.q, axis=1)
    reach = np.minimum(rig.q[:, 1] - centre, centre - rig.q[:, 0])
    w = 2 * np.pi * np.exp(rng.uniform(np.log(1.5 / seconds), np.log(max(1.5, 3.0 / seconds)), SINES))
    a = rng.uniform(0.2, 1.0, (joints, SINES)) / w
    share = rng.permutation(np.eye(joints)[0]) * 0.98 + 0.02 if rng.random() < 0.4 else np.ones(joints)  # one joint nearly alone
    fade = min(1.0, seconds / 4)
    fastest = (a * (w + 2 / fade)).sum(axis=1)
    hardest = (a * (w**2 + 4 / fade * w + 6 / fade**2)).sum(axis=1)
    most = np.min([reach / a.sum(axis=1), rig.rate / fastest, rig.acceleration / hardest], axis=0)
    scale = rng.uniform(NARROW, WIDE) * most * share
    return {"kind": "fourier", "q_rad": centre.tolist(), "duration_s": seconds, "fade_s": fade,
            "amplitude_rad": (a * scale[:, None]).tolist(), "frequency_hz": (w / (2 * np.pi)).tolist(),
            "phase_rad": rng.uniform(0, 2 * np.pi, (joints, SINES)).tolist()}


def _tow(rig: Rig, rng: np.random.Generator) -> dict[str, Any]:
    ramp = float(rng.uniform(0.3, 1.5))
    carriage = {"u0_m_s": float(rng.choice([-1.0, 1.0]) * rng.uniform(NARROW, WIDE) * rig.u0), "ramp_s": ramp, "start_s": 0.1}
    return {"kind": "tow", "q_rad": rng.uniform(rig.q[:, 0], rig.q[:, 1]).tolist(), "hold_s": max(rig.seconds - 2 * ramp - 0.2, 1.0),
            "carriage": carriage}


def _perturb(value: Any, share: float, rng: np.random.Generator) -> Any:
    """Every number of a document changed by about `share` of itself."""
    if isinstance(value, dict):
        return {key: x if key in ("kind", "name", "fade_s") else _perturb(x, share, rng) for key, x in value.items()}
    if isinstance(value, list):
        return [_perturb(x, share, rng) for x in value]
    return float(value * np.exp(share * rng.standard_normal())) if isinstance(value, float) else value


def _feasible_motion(document: dict[str, Any], rig: Rig, arm: Arm, rate_hz: float) -> CandidateMotion | None:
    """The motion of `document`; None where the rig cannot do it."""
    from pathlib import Path

    try:
        kind = motion_of({"name": "next", **document}, "next experiment")
        assert isinstance(kind, TimedMotion)
        reference = kind.reference(Setting(arm, np.random.default_rng(0), Path()))
    except NnhydroError:
        return None
    t = grid(reference, rate_hz)
    state = reference.at(t)
    return CandidateMotion(document, t, state) if len(t) >= 20 and t[-1] <= DURATION_MARGIN * rig.seconds and rig.allows(state) else None


def draw(rig: Rig, arm: Arm, rate_hz: float, count: int, rng: np.random.Generator) -> list[CandidateMotion]:
    """Return up to `count` feasible motions: slews and sums of sines, towed or not, and tows where the carriage moves."""
    found: list[CandidateMotion] = []
    for attempt in range(10 * count):
        kind = (_slew, _fourier, _tow)[attempt % (3 if rig.u0 > 0 else 2)]
        document = kind(rig, rng)
        made = _feasible_motion(document if "carriage" in document else document | _carriage(rig, rng), rig, arm, rate_hz)
        found += [made] if made is not None else []
        if len(found) == count:
            break
    return found


def neighbours(best: Sequence[CandidateMotion], rig: Rig, arm: Arm, rate_hz: float, count: int,
               rng: np.random.Generator) -> list[CandidateMotion]:
    """Return up to `count` feasible motions in the neighbourhood of the `best`."""
    tried = (_feasible_motion(_perturb(best[k % len(best)].document, 0.2, rng), rig, arm, rate_hz) for k in range(3 * count))
    return [made for made in tried if made is not None][:count]
