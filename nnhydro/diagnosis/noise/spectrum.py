"""Noise: a common spectrum per joint, one scale per recording, and the error of the numerics.

    v_nj = sigma_gj^2 S_j(f) + MODEL_ERROR^2 E_gj(band) + FORM^2 F_gj(band) + I_gj(f)       [(N m)^2 s]

S, sigma by restricted maximum likelihood with the unknown and the selected effects in the model: with leverage h = w d'H^-1 d,

    S_j(b) <- S_j(b) sum a r^2/v / sum a (1 - h),     a = (own part of v) / v,  shrunk by NU observations towards its neighbours

A band of few rows is at most as high as a random walk through the next one above.

E is the sum of the mean squares of the baseline's torque and of what it leaves: strips and interpolation err by as much at random, so that
rigs with little noise are not judged on details. F is that of the friction that arm.yaml states, which is known to FORM in form. An error
in the form of a law that is found is smooth instead: it is the unknown's.
I is what is left of the motion's noise in the model's torque: angles that are differentiated twice make it rise towards the band's edge.
Source: REML, Patterson & Thompson (1971), Biometrika 58; discrepancy, Kennedy & O'Hagan (2001).
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import FORM, LATE, MODEL_ERROR, NU
from nnhydro.diagnosis.model.evidence import Columns, Posterior, WhiteRows, posterior
from nnhydro.diagnosis.model.sizes import Sizes, fit_sizes
from nnhydro.diagnosis.model.unknown import Unknown
from nnhydro.diagnosis.problem.design import Design
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]
Index = NDArray[np.int64]
RATIO = 1.6  # ratio of the edges of successive bands
LEAST = 1e-12  # least noise, in mean squares of the torque: a computed torque has none


@final
@dataclass(frozen=True, eq=False)
class Bands:
    """The band `of` (n,) each row: the mean of a block is the first band, followed by edges in ratio `RATIO`; steady rows are the first.

    Between the centres of bands the spectrum runs straight in the logarithms: row n lies `share` (n,) of the way from band `low` to `high`.
    """

    of: Index
    centre: Array  # (bands,) Hz
    low: Index
    high: Index
    share: Array

    def spread(self, S: Array) -> Array:
        """Return the spectrum S (joints, bands) on the rows, (n, joints)."""
        log = np.log(S)
        made: Array = np.exp((1 - self.share) * log[:, self.low] + self.share * log[:, self.high]).T
        return made

    def within_random_walk(self, S: Array, means: bool) -> Array:
        """Return the spectrum S (bands,) in which a band of fewer than NU rows is at most as high as a random walk through the next above.

            S(f) <= S(f') (f' / f)^2

        Few rows do not tell noise from what is missing, and no usual noise is steeper. With `means` it also holds of the means of blocks,
        at half the lowest frequency: where nothing is driven, no sensor has an offset.
        """
        made, count = S.copy(), np.bincount(self.of, minlength=self.count)
        moving = np.flatnonzero(self.centre > 0)
        first = int(moving[0]) if len(moving) else self.count
        f = np.where(self.centre > 0, self.centre, self.centre[first] / 2 if len(moving) else 1.0)
        for k in range(self.count - 2, first - 2 if means and first > 0 else first - 1, -1):
            if count[k] < NU:
                made[k] = min(made[k], made[k + 1] * (f[k + 1] / f[k]) ** 2)
        return made

    @staticmethod
    def of_design(design: Design) -> "Bands":
        """Return the bands of the rows of `design`."""
        f = design.problem.frequency
        moving = f > 0
        lowest = float(f[moving].min()) if moving.any() else 1.0
        above = 2 + np.floor(np.log(np.maximum(f, lowest) / lowest) / np.log(RATIO) + 1e-9).astype(int)
        number = np.where(moving, above, np.where(f < 0, 0, 1))
        used, index = np.unique(number, return_inverse=True)
        centre = np.maximum([f[index == k].mean() for k in range(len(used))], 0.0)
        of, first = index.astype(np.int64), int((used <= 1).sum())
        low, high, share = of, of, np.zeros(len(f))
        if len(used) - first > 1:
            above = np.clip(np.searchsorted(centre[first:], f) + first, first + 1, len(used) - 1)
            low, high = np.where(moving, above - 1, of), np.where(moving, above, of)
            below, beyond, at = (np.log(np.where(moving, x, 1.0)) for x in (centre[low], centre[high], f))
            share = (at - below) / np.where(moving, beyond - below, 1.0)
        return Bands(of, centre, low, high, np.asarray(share, np.float64))

    @cached_property
    def count(self) -> int:
        """Number of bands."""
        return len(self.centre)


@final
@dataclass(frozen=True, eq=False)
class Noise:
    """The spectrum `S` (joints, bands), the scales `sigma2` (groups, joints), and the variance of the numerics `numerics` (n, joints)."""

    bands: Bands
    group: Index
    S: Array
    sigma2: Array
    numerics: Array

    @property
    def noise_variance(self) -> Array:
        """The variance of the noise itself, (n, joints)."""
        made: Array = self.sigma2[self.group] * self.bands.spread(self.S)
        return made

    @property
    def v(self) -> Array:
        """The variance of every row, (n, joints)."""
        return self.noise_variance + self.numerics


def _cells(design: Design, bands: Bands, x: Array) -> Array:
    """Return the mean of x (n, joints) a group, joint and band, spread on the rows again, (n, joints)."""
    group, groups = design.problem.group_of, design.problem.groups
    at = group * bands.count + bands.of
    count = np.bincount(at, minlength=groups * bands.count)
    made = np.stack([np.bincount(at, x[:, j], groups * bands.count) / np.maximum(count, 1) for j in range(x.shape[1])], axis=1)
    spread: Array = made[at]
    return spread


def energy_to_explain(design: Design) -> Array:
    """Return the mean squares (n, joints) a band of what the baseline alone leaves."""
    return _cells(design, Bands.of_design(design), design.excess**2)


def form_variance(design: Design) -> Array:
    """Return the variance (n, joints) of a law that is off by FORM of what there is to explain, and late by LATE.

        min(FORM^2 + (2 pi f LATE)^2, 1) E(f),    as tau(t - d) - tau(t) = -i 2 pi f d tau
    """
    share = FORM**2 + (2 * np.pi * np.maximum(design.problem.frequency, 0) * LATE) ** 2
    made: Array = np.minimum(share, 1.0)[:, None] * energy_to_explain(design)
    return made


def _numerics(design: Design, bands: Bands) -> Array:
    """Return the variance (n, joints) of what the numerics and the motion's noise make of the torques."""
    return MODEL_ERROR**2 * _cells(design, bands, (design.tau - design.excess) ** 2 + design.excess**2) + design.input_variance


def with_form_error(design: Design, noise: Noise) -> Noise:
    """Return `noise` with an error of FORM of what there is to explain."""
    return replace(noise, numerics=noise.numerics + FORM**2 * energy_to_explain(design))


def white_noise(design: Design) -> Noise:
    """Return white noise as large as what the baseline alone leaves, per joint, and the variance of the numerics."""
    bands = Bands.of_design(design)
    level = np.maximum((design.excess**2).mean(axis=0), LEAST * np.maximum(design.scale, 1e-150) ** 2)
    groups = np.ones((design.problem.groups, len(level)))
    return Noise(bands, design.problem.group_of, np.tile(level[:, None], (1, bands.count)), groups, _numerics(design, bands))


def first_noise(design: Design) -> Noise:
    """Return flat noise at the level of the quiet upper end of the band; the form of a stated friction counts with the numerics."""
    bands, excess = Bands.of_design(design), design.excess
    numerics = _numerics(design, bands) + FORM**2 * _cells(design, bands, design.stated_friction**2)
    joints = design.y.shape[1]
    floor = LEAST * np.maximum(design.scale, 1e-300) ** 2
    level = []
    for j in range(joints):
        means = [float((excess[bands.of == k, j] ** 2).mean()) for k in range(bands.count) if (bands.of == k).sum() >= NU]
        level.append(max(min(means[len(means) // 2:] or [float((excess[:, j] ** 2).mean())]), float(floor[j]), 1e-300))
    return Noise(bands, design.problem.group_of, np.tile(np.array(level)[:, None], (1, bands.count)),
                 np.ones((design.problem.groups, joints)), numerics)


def _leverage(whitened: WhiteRows, columns: Columns | None, fit: Posterior) -> tuple[Array, Array]:
    """Return the whitened residual (n, joints) and the leverage h (n, joints)."""
    p, m, joints = whitened.p, whitened.m, whitened.joints
    n = len(whitened.y)
    P = p + joints * m
    r, h = np.zeros((n, joints)), np.zeros((n, joints))
    for j in range(joints):
        at = np.concatenate([np.arange(p), np.arange(p + j * m, p + (j + 1) * m), np.arange(P, len(fit.scale))])
        parts = [whitened.Y[:, j], whitened.Phi * whitened.sw[:, j:j + 1]]
        if columns is not None:
            parts.append(columns.Xw[:, j])
        D = np.concatenate(parts, axis=1)
        r[:, j] = whitened.y[:, j] - D @ fit.mean[at]
        inverse = fit.covariance(at)
        h[:, j] = np.einsum("nk,nk->n", D @ inverse, D)
    return r, np.clip(h, 0.0, 1.0)


def reestimate(design: Design, noise: Noise, whitened: WhiteRows, columns: Columns | None, t: Array) -> Noise:
    """Return the noise with spectrum and scales estimated once more beside `columns` and the unknown with sizes `t`."""
    fit = posterior(whitened, columns, t)
    r, h = _leverage(whitened, columns, fit)
    share = noise.noise_variance / noise.v
    bands, S, sigma2 = noise.bands, noise.S.copy(), noise.sigma2.copy()
    floor = LEAST * np.maximum(design.scale, 1e-300) ** 2
    joints = S.shape[0]
    for j in range(joints):
        top = np.bincount(bands.of, share[:, j] * r[:, j] ** 2, bands.count)
        below = np.bincount(bands.of, share[:, j] * (1 - h[:, j]), bands.count)
        ratio = np.log(np.maximum(top, 1e-12) / np.maximum(below, 1e-12))
        level = np.log(S[j]) + ratio
        smooth = np.convolve(np.pad(level * below, 1, mode="edge"), [1, 1, 1], "valid") / np.maximum(
            np.convolve(np.pad(below, 1, mode="edge"), [1, 1, 1], "valid"), 1e-12)
        S[j] = np.exp((below * level + NU * smooth) / (below + NU))
        S[j] = np.maximum(bands.within_random_walk(S[j], design.undriven), floor[j])
    for j in range(joints):
        top = np.bincount(noise.group, share[:, j] * r[:, j] ** 2, len(sigma2))
        below = np.bincount(noise.group, share[:, j] * (1 - h[:, j]), len(sigma2))
        sigma2[:, j] *= (NU + top) / (NU + below)
        there = below > 0
        sigma2[:, j] /= np.exp(np.average(np.log(sigma2[there, j]), weights=below[there])) if there.any() else 1.0
    return Noise(bands, noise.group, S, sigma2, noise.numerics)


FIRST_SIZE = 0.1  # size of the unknown from which its evidence is maximised
NOISE_ROUNDS = 3  # iterations between the noise and the sizes of the unknown


def calibrated_noise(design: Design, unknown: Unknown) -> tuple[Noise, WhiteRows, Sizes, StripTheory]:
    """Return the noise beside the unknown alone, the rows whitened by it, the unknown's sizes, and the baseline calibrated so.

    What there is to explain counts as noise of FORM of its size meanwhile: a large cause in one recording must not be the noise of all. The
    rows keep the smooth unknown; the constant of steady tables serves the noise alone.
    """
    first, sizes = first_noise(design), None
    noise = with_form_error(design, first)
    for _ in range(NOISE_ROUNDS):
        whitened = WhiteRows(design, unknown, noise.v)
        _, sizes = fit_sizes(whitened, None, Sizes.even(whitened, FIRST_SIZE) if sizes is None else sizes)
        noise = reestimate(design, noise, whitened, None, sizes.vector(whitened))
    noise = replace(noise, numerics=first.numerics)
    whitened = WhiteRows(design, unknown.smooth, noise.v)
    assert sizes is not None
    fit, sizes = fit_sizes(whitened, None, Sizes(sizes.tau[:, : len(whitened.unknown.names)]))
    return noise, whitened, sizes, design.baseline.at(design.baseline.within(fit.mean[: whitened.p]))
