"""What a logger writes of a motion: sampled, delayed, quantised, noisy; nothing of the package."""

import math

import numpy as np
import pandas as pd
from arms import deriv
from drives import lag1
from scipy.signal import lfilter


def noise(N, n, rng, sd, ar=0.0, tails=False):
    """Return noise (N, n) of the standard deviation sd (n,), with the correlation ar between samples; tails: Student's t, 3."""
    e = rng.standard_t(3, (N + 200, n)) / math.sqrt(3) if tails else rng.normal(size=(N + 200, n))
    if ar:
        e = lfilter([math.sqrt(1 - ar * ar)], [1, -ar], e, axis=0)
    return e[200:] * np.asarray(sd)


def resampled(values, t, tf):
    """Return the columns of values (n, columns), given at the times tf, at the times t."""
    return np.stack([np.interp(t, tf, values[:, j]) for j in range(values.shape[1])], 1)


def logged_rates(kind, Q, ts, dq, tf, fs, rng):
    """Return the rates that are logged: noisy by 1 %, or differences of the logged angles behind a filter that lags by a sample (diff)."""
    if kind == "noisy":
        DQ = resampled(dq, ts, tf)
        return DQ + noise(len(ts), DQ.shape[1], rng, 0.01 * DQ.std(0))
    raw = np.gradient(Q, ts, axis=0)
    return np.stack([lag1(raw[:, j], 1.0 / fs, 1 / fs) for j in range(raw.shape[1])], 1)


def record(dt, fs, q, tau, rng, sd=0.0, u0=None, qq=0.0, qsd=0.0, tq=0.0, rates=None, acc=False, ar=0.0, tails=False, delay=0.0, lag=0.0,
           jitter=0.0, uneven=0.0, clock=None, prism=False, sim=None, std=None):
    """Return the recording, sampled at fs (Hz), of angles q and torques tau (n, joints) given every dt seconds.

    sd, ar, tails: noise of the torques; qsd: of the angles. qq, tq: steps of angles and torques. rates (noisy, diff), acc: whether rates
    and accelerations are logged. delay, lag: dead time and filter of the torques, s. jitter, uneven: scatter of the torques' times and of
    all times, in samples. clock: time of day at the start, s. prism: a prismatic joint. sim, std: torques of a simulation, stated noise.
    """
    q, tau = (a if a.ndim == 2 else a[:, None] for a in (q, tau))
    tf = np.arange(len(q)) * dt
    n = q.shape[1]
    ts = np.arange(0, tf[-1], 1 / fs)
    if uneven:
        ts = np.maximum(ts + rng.uniform(-uneven, uneven, len(ts)) / fs, 0)
    if lag:
        tau = np.stack([lag1(tau[:, j], lag, dt) for j in range(n)], 1)
    tj = ts - delay + (rng.normal(size=len(ts)) * jitter / fs if jitter else 0)
    dq, ddq = deriv(q, dt)
    Q, TAU = resampled(q, ts, tf), resampled(tau, tj, tf) + noise(len(ts), n, rng, sd, ar, tails)
    Q = Q + qsd * rng.normal(size=Q.shape)
    Q = np.round(Q / qq) * qq if qq else Q
    TAU = np.round(TAU / tq) * tq if tq else TAU
    angle, rate, acceleration, torque = ("m", "m_s", "m_s2", "N") if prism else ("rad", "rad_s", "rad_s2", "Nm")
    columns = {"t_s": ts} | named("q", angle, Q)
    if rates:
        columns |= named("dq", rate, logged_rates(rates, Q, ts, dq, tf, fs, rng))
    if acc:
        A = resampled(ddq, ts, tf)
        columns |= named("ddq", acceleration, A + noise(len(ts), n, rng, 0.02 * A.std(0)))
    if u0 is not None:
        columns |= {"u0_m_s": np.interp(ts, tf, u0), "du0_m_s2": np.interp(ts, tf, np.gradient(u0, dt))}
    columns |= named("tau", torque, TAU)
    if std is not None:
        columns |= named("tau", "std_Nm", np.full((len(ts), n), std))
    if sim is not None:
        columns |= named("tau", f"sim_{torque}", resampled(sim, ts, tf))
    if clock is not None:
        columns["clock_s"] = clock + ts
    return pd.DataFrame(columns)


def named(quantity, unit, values):
    """Return the columns of values (n, joints) by name."""
    return {f"{quantity}{j + 1}_{unit}": values[:, j] for j in range(values.shape[1])}
