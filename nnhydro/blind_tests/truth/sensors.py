"""Sensors of the concealed tank: encoder steps, torque noise of three kinds, which derivatives are recorded.

    white   e_k ~ N(0, sigma)            ar1   e_k = r e_{k-1} + sqrt(1 - r^2) N(0, sigma)            heavy   Student's t, 4 degrees, scaled
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from nnhydro.blind_tests.truth.tank import TrueReading
from nnhydro.blind_tests.truth.world import Array, Generator, TrueArm, TrueRun

FINE = 2  # steps of the tank a recorded sample


@dataclass(frozen=True)
class TrueSensors:
    """How a campaign is recorded: rate in Hz, what is given besides angles (none, rates, all), noise relative to the torque's rms."""

    rate: float
    given: str
    noise: str
    level: float
    correlation: float
    encoder: float  # rad
    clock: bool

    def inflation(self) -> float:
        """Return the factor by which the noise's low-frequency deviation exceeds its deviation: sqrt((1 + r)/(1 - r))."""
        return float(np.sqrt((1 + self.correlation) / (1 - self.correlation)))


def draw_sensors(rng: Generator, rates: tuple[float, ...], clock: bool) -> TrueSensors:
    """Return a random recorder."""
    noise = str(rng.choice(["white", "ar1", "heavy"], p=[0.5, 0.3, 0.2]))
    return TrueSensors(float(rng.choice(rates)), str(rng.choice(["none", "rates", "all"], p=[0.4, 0.2, 0.4])), noise,
                   float(np.exp(rng.uniform(np.log(0.005), np.log(0.03)))), float(rng.uniform(0.3, 0.8)) if noise == "ar1" else 0.0,
                   2 * np.pi / 2 ** int(rng.integers(15, 19)), clock or bool(rng.random() < 0.6))


def noise_of(kind: TrueSensors, sigma: Array, n: int, rng: Generator) -> Array:
    """Return torque noise (n, L) with deviations `sigma` (L,) N m."""
    shape = (n, len(sigma))
    if kind.noise == "heavy":
        return np.asarray(sigma * rng.standard_t(4, shape) / np.sqrt(2.0))
    e: Array = rng.standard_normal(shape)
    if kind.noise == "ar1":
        r = kind.correlation
        e[1:] *= np.sqrt(1 - r**2)
        e = np.asarray(lfilter([1.0], [1.0, -r], e, axis=0))
    return sigma * e


def record(run: TrueRun, seen: TrueReading, arm: TrueArm, kind: TrueSensors, sigma: Array, rng: Generator,
           torque: bool) -> dict[str, Array]:
    """Return the columns of a recording, with noise; `torque` False leaves the torques out."""
    L, keep = len(arm.links), slice(None, None, FINE)

    def angles(x: Array) -> Array:
        return np.cumsum(x, axis=1)[keep] if arm.belt else x[keep]

    q, qd, qdd = angles(seen.q), angles(seen.qd), angles(seen.qdd)
    n = len(q)
    noise = noise_of(kind, sigma, n, rng)
    rough = rng.standard_normal((2, n, L))
    columns = {"t_s": run.t[keep]}
    columns |= {f"q{j + 1}_rad": np.round(q[:, j] / kind.encoder) * kind.encoder for j in range(L)}
    if kind.given != "none":
        columns |= {f"dq{j + 1}_rad_s": qd[:, j] + 0.001 * qd[:, j].std() * rough[0, :, j] for j in range(L)}
    if kind.given == "all":
        columns |= {f"ddq{j + 1}_rad_s2": qdd[:, j] + 0.002 * qdd[:, j].std() * rough[1, :, j] for j in range(L)}
    if run.u0.any():
        columns |= {"u0_m_s": run.u0[keep]} | ({"du0_m_s2": run.du0[keep]} if kind.given == "all" else {})
    if torque:
        columns |= {f"tau{j + 1}_Nm": seen.tau[keep][:, j] + noise[:, j] for j in range(L)}
    return columns | ({"clock_s": run.clock[keep]} if kind.clock else {})
