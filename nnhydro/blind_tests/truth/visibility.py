"""How large a hidden cause is, as an honest number: what of it no refit of the baseline can absorb, in units of the noise.

    x_j     = reading of joint j with the cause - the healthy arm's torque for the motion that was read            [N m]
    r       = what is left of x after least squares on the baseline's columns [C_D, C_M of each link free; mass, mass centre and inertia of
              each link within `known_to`, as a prior; both weighted by the noise]
    lambda  = sqrt(sum_j sum_k r_jk^2 / s_j^2),      s_j = sigma_j sqrt((1+rho)/(1-rho)), rho the noise's correlation from sample to sample
    limit   = max(8, sqrt(0.01 N))                   N independent samples per joint: eight deviations, and 1 % of the noise's energy

lambda is rms(r)/s times the square root of the independent samples. Where accelerations have to be derived from the angles, x and the
columns pass a zero-phase low-pass at 8 Hz first, since nothing above can be compared; N shrinks by the same band. `weak` is drawn at 1.6 to
3 times the limit, `strong` at 8 to 25 times it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.signal import butter, sosfiltfilt

from nnhydro.blind_tests.truth.flow import frames_of, rigid_torque, water_torque
from nnhydro.blind_tests.truth.sensors import FINE, TrueSensors
from nnhydro.blind_tests.truth.tank import motor_torque, plain_torque, read
from nnhydro.blind_tests.truth.world import Array, Cause, Draft, TrueArm, TrueRun

LOWEST, SHARE = 8.0, 0.01
BAND = 8.0  # Hz
FACTORS = {"weak": (1.6, 3.0), "strong": (8.0, 25.0)}
COARSE = 30  # strips per link of the baseline's columns


@lru_cache(maxsize=32)
def low_pass_sections(rate: float) -> Array:
    """Return the second-order sections of the low-pass at BAND of recordings at `rate` Hz."""
    sections: Array = butter(2, BAND, fs=rate, output="sos")
    return sections


def base_columns(run: TrueRun, arm: TrueArm, known_to: float, added_mass: bool) -> tuple[Array, Array]:
    """Return the columns (n, L, p) of the baseline's parameters, each for one unit of what is known of it, and the priors (p,)."""
    columns, prior, frames = [], [], frames_of(run, arm)
    plain = rigid_torque(run, arm, frames)
    for i in range(len(arm.links)):
        for C_D, C_M in ((1.0, 0.0), (0.0, 1.0)) if added_mass else ((1.0, 0.0),):
            links = tuple(replace(k, C_D=C_D * (n == i), C_M=C_M * (n == i)) for n, k in enumerate(arm.links))
            columns.append(water_torque(run, replace(arm, links=links), strips=COARSE, frames=frames))
            prior.append(0.0)
        for key in ("mass", "com", "inertia"):
            moved = replace(arm.links[i], **{key: getattr(arm.links[i], key) * (1 + known_to)})
            other = replace(arm, links=tuple(moved if n == i else k for n, k in enumerate(arm.links)))
            columns.append(rigid_torque(run, other, frames) - plain)
            prior.append(1.0)
    return np.stack([motor_torque(column, arm) for column in columns], axis=-1), np.array(prior)


@dataclass(frozen=True)
class Yardstick:
    """A campaign against which sizes are measured; `healthy` are its runs' joint torques, `basis` spans what a refit can absorb."""

    runs: tuple[TrueRun, ...]
    arm: TrueArm
    sensors: TrueSensors
    healthy: tuple[Array, ...]
    noise: Array  # (L,) N m, at low frequency
    basis: Array  # orthonormal columns, rows as `weigh` stacks them and then the priors
    priors: int

    def _low_pass(self, x: Array) -> Array:
        """Columns as a recorder gives them: low-passed where it gives angles alone."""
        x = x[::FINE]
        if self.sensors.given == "all":
            return x
        result: Array = sosfiltfilt(low_pass_sections(self.sensors.rate), x, axis=0)
        return result

    def weigh(self, torques: Sequence[Array]) -> Array:
        """Return torques (n, L) of all runs as one column in units of the noise, with zeros for the priors."""
        rows = [(self._low_pass(x) / self.noise).ravel() for x in torques]
        return np.concatenate([*rows, np.zeros(self.priors)])

    def column(self, causes: Sequence[Cause]) -> Array:
        """Return what is left of the causes' torque after the baseline's refit, in units of the noise."""
        rows = []
        for run, plain in zip(self.runs, self.healthy, strict=True):
            seen = read(run, self.arm, causes, plain)
            moved = any(cause.drive is not None or cause.angle is not None for cause in causes)
            healthy = plain_torque(replace(run, q=seen.q, qd=seen.qd, qdd=seen.qdd), self.arm) if moved else plain
            rows.append(seen.tau - motor_torque(healthy, self.arm))
        x = self.weigh(rows)
        left: Array = x - self.basis @ (self.basis.T @ x)
        return left

    @property
    def independent(self) -> float:
        """Independent samples per joint."""
        rows = sum(len(run.t) // FINE for run in self.runs)
        band = 1.0 if self.sensors.given == "all" else min(1.0, 2 * BAND / self.sensors.rate)
        return rows * band / self.sensors.inflation() ** 2

    @property
    def limit(self) -> float:
        """The lambda from which on the campaign can reveal something."""
        return max(LOWEST, float(np.sqrt(SHARE * self.independent)))

    def size(self, causes: Sequence[Cause], others: Sequence[Array] = ()) -> float:
        """Return lambda of the causes; `others`: columns of other causes whose size a fit may choose as well."""
        x = self.column(causes)
        for column in _orthonormal(others):
            x = x - column * float(column @ x)
        return float(np.linalg.norm(x))


def _orthonormal(columns: Sequence[Array]) -> list[Array]:
    if not columns:
        return []
    return list(np.linalg.qr(np.column_stack(columns))[0].T)


def reference(runs: tuple[TrueRun, ...], arm: TrueArm, known_to: float, sensors: TrueSensors, sigma: Array,
              added_mass: bool = True) -> Yardstick:
    """Return the reference of a campaign whose torque noise has deviations `sigma` (L,) N m."""
    made = Yardstick(runs, arm, sensors, tuple(plain_torque(run, arm) for run in runs), sigma * sensors.inflation(), np.zeros((0, 0)), 0)
    parts = [base_columns(run, arm, known_to, added_mass) for run in runs]
    prior = parts[0][1]
    table = np.column_stack([made.weigh([part[0][..., k] for part in parts]) for k in range(len(prior))])
    table = np.concatenate([table, np.diag(prior)])
    return replace(made, basis=np.linalg.qr(table)[0], priors=len(prior))


def size_to_target(reference: Yardstick, draft: Draft, target: float) -> tuple[Cause, float]:
    """Return the cause whose lambda is near `target` (within a tenth where the draft's bounds allow) and its lambda."""
    low, high = draft.low, draft.high
    amount = float(np.sqrt(low * high))
    best: tuple[float, float] | None = None
    for _ in range(9):
        found = reference.size([draft.make(amount)])
        if best is None or abs(np.log(max(found, 1e-9) / target)) < abs(np.log(max(best[1], 1e-9) / target)):
            best = (amount, found)
        if abs(np.log(max(found, 1e-9) / target)) < 0.1 or low == high:
            break
        low, high = (amount, high) if found < target else (low, amount)
        guess = amount * (target / max(found, 1e-9))
        inside = low * 1.02 < guess < high / 1.02
        amount = guess if inside else (high if guess >= high and amount < high * 0.98 else float(np.sqrt(low * high)))
        if high / low < 1.01:
            break
    assert best is not None
    return draft.make(best[0]), best[1]
