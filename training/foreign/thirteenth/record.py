"""How a campaign is recorded: sensors, files, and the answer with the share that each hidden effect has."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd
from effects import Effect
from machines import Arm, Array, yaml_of
from mechanics import bare_torques, water_torques
from motions import Motion
from numpy.typing import NDArray
from scipy.signal import lfilter

SEED = 130613  # of all that is drawn
Rows = NDArray[np.int64]  # numbers of recorded rows


@dataclass
class Sensors:
    """How a campaign is recorded: noise as a share of each joint's rms torque, and the rest."""

    noise: float = 0.01
    ar: float = 0.0
    tails: float = 0.0
    spread: float = 1.0
    quantum: float = 0.0
    angle_noise: float = 2e-5
    rates: float | None = None
    accelerations: float | None = None
    jitter: bool = False
    clock: bool = False


GEARED = Sensors(0.005, rates=0.002, quantum=1e-5)
LAB = Sensors(0.008, rates=0.003, quantum=2 * np.pi / 4096 / 25, angle_noise=0.0)


@dataclass
class Case:
    """A campaign to be made."""

    style: str
    machine: Arm
    motions: list[Motion]
    sensors: Sensors
    effects: list[Effect] = field(default_factory=list)
    free: bool = False


@dataclass
class Simulation:
    """One recording before noise: recorded rows, torques, what each effect adds, and torques of unit C_D and C_M of each link."""

    pick: Rows
    tau: Array
    parts: list[Array]
    fits: Array


def noise_like(rng: np.random.Generator, sensors: Sensors, rows: int) -> Array:
    """Noise of unit size: coloured and heavy-tailed as the sensors say."""
    raw = rng.standard_t(sensors.tails, rows + 200) * np.sqrt(1 - 2 / sensors.tails) if sensors.tails else rng.normal(size=rows + 200)
    return lfilter([np.sqrt(1 - sensors.ar**2)], [1, -sensors.ar], raw)[200:]


def refit_share(rows: Array, regressors: Array, size: float) -> float:
    """Share of an effect that refitted C_D and C_M of each link cannot take up."""
    keep = np.linalg.norm(regressors, axis=1) > 1e-9
    if keep.any():
        base = regressors[keep].T
        rows = rows - base @ np.linalg.lstsq(base, rows, rcond=None)[0]
    return float(np.linalg.norm(rows) / size)


def picked_rows(case: Case, mo: Motion, rng: np.random.Generator) -> Rows:
    """The rows of the fine grid that are recorded."""
    pick = np.arange(0, mo.t.size, mo.step)
    if case.sensors.jitter:
        pick = np.clip(pick + rng.integers(0, max(1, mo.step // 2), pick.size), 0, mo.t.size - 1)
    return pick


def torques(case: Case, mo: Motion) -> tuple[Array, list[Array]]:
    """The torques of a motion, and what each effect adds to them."""
    machine = case.machine
    tau, parts = 0 * mo.q if case.free else bare_torques(machine, mo), []
    for effect in case.effects:
        new = effect.apply(machine, mo, tau)
        shown = new - tau
        if effect.name == "encoder_offset":
            shown = bare_torques(machine, mo) - bare_torques(machine, replace(mo, q=mo.q + mo.read_offset[:, None]))
        parts.append(shown)
        tau = 0 * tau if case.free else new
    return tau, parts


def simulate(case: Case, mo: Motion, rng: np.random.Generator) -> Simulation:
    """Compute one recording, still without noise."""
    pick = picked_rows(case, mo, rng)
    tau, parts = torques(case, mo)
    units, zero = list(np.eye(case.machine.links)), np.zeros(case.machine.links)
    fits = [water_torques(case.machine, mo, unit, zero) for unit in units] + [water_torques(case.machine, mo, zero, unit) for unit in units]
    return Simulation(pick, tau[:, pick], [part[:, pick] for part in parts], np.stack([fit[:, pick] for fit in fits]))


def recorded_table(case: Case, mo: Motion, run: Simulation, rms: Array, rng: np.random.Generator) -> pd.DataFrame:
    """The columns of one file, with the noise of the sensors."""
    n, sensors, pick = case.machine.links, case.sensors, run.pick
    size = sensors.noise * (sensors.spread ** rng.uniform(-0.5, 0.5))
    table = {"t_s": mo.t[pick]}
    angle = (mo.phi if case.machine.remote else mo.q)[:, pick] + mo.read_offset[:, None]
    angle += sensors.angle_noise * rng.normal(size=run.tau.shape)
    if sensors.quantum:
        angle = np.round(angle / sensors.quantum) * sensors.quantum
    reading = np.stack([run.tau[0] - run.tau[1], run.tau[1]]) if case.machine.remote else run.tau
    for j in range(n):
        table[f"q{j + 1}_rad"] = angle[j]
    for j in range(n):
        if sensors.rates is not None:
            table[f"dq{j + 1}_rad_s"] = mo.dq[j, pick] + sensors.rates * rng.normal(size=pick.size)
        if sensors.accelerations is not None:
            table[f"ddq{j + 1}_rad_s2"] = mo.ddq[j, pick] + sensors.accelerations * rng.normal(size=pick.size)
    if any(motion.u0.any() for motion in case.motions):
        table["u0_m_s"] = mo.u0[pick] + 0.0005 * rng.normal(size=pick.size) * mo.u0.any()
    for j in range(n):
        noise = 0.0 if case.free else size * rms[j] * noise_like(rng, sensors, pick.size)
        table[f"tau{j + 1}_Nm"] = reading[j] + noise
    if sensors.clock:
        table["clock_s"] = mo.clock + mo.t[pick]
    return pd.DataFrame(table)


def answer_of(effect: Effect, rows: Array, every: Array, fits: Array) -> dict[str, object]:
    """The entry of a hidden effect that adds `rows` to torques `every`, of which `fits` are those of unit C_D and C_M."""
    rms = np.sqrt((every**2).mean(axis=1))
    joints = list(range(len(every))) if effect.joint is None or effect.name == "link_interference" else [effect.joint - 1]
    share = float(np.linalg.norm(rows[joints])) / float(np.linalg.norm(every[joints]))
    left = refit_share((rows / rms[:, None]).ravel(), (fits / rms[:, None]).reshape(len(fits), -1),
                       np.sqrt(every.shape[1] * len(joints)))
    entry: dict[str, object] = {"effect": effect.name, "joint": effect.joint, "share_of_rms_torque": round(share, 4),
                                "share_after_refit": round(left, 4)}
    if effect.accept:
        entry["accept"] = effect.accept
    if effect.part:
        entry["part"] = True
    return entry


def write_campaign(case: Case, folder: Path, rng: np.random.Generator) -> dict[str, object]:
    """Compute the torques, record them, write the campaign and return its answer."""
    machine = case.machine
    (folder / "recordings").mkdir(parents=True)
    (folder / "arm.yaml").write_text(yaml_of(machine, folder.name, rng))
    runs = [simulate(case, mo, rng) for mo in case.motions]
    every, fits = np.concatenate([run.tau for run in runs], axis=1), np.concatenate([run.fits for run in runs], axis=2)
    if case.free:
        every = np.concatenate([machine.mass[0] * machine.gravity * machine.com[0] * np.cos(mo.q) for mo in case.motions], axis=1)
    rms = np.sqrt((every**2).mean(axis=1))
    for k, (mo, run) in enumerate(zip(case.motions, runs, strict=True)):
        name = f"{k + 1:02d}_{mo.kind.replace(' ', '_')}.csv"
        recorded_table(case, mo, run, rms, rng).to_csv(folder / "recordings" / name, index=False, float_format="%.9g")
    added = [np.concatenate(parts, axis=1) for parts in zip(*(run.parts for run in runs), strict=True)]
    hidden = [answer_of(effect, rows, every, fits) for effect, rows in zip(case.effects, added, strict=True)]
    count = sum(run.pick.size for run in runs)
    if count > 15000:
        raise RuntimeError(f"{folder.name}: {count} rows")
    return {"style": case.style, "links": machine.links, "hidden": hidden, "noise_share": case.sensors.noise, "rows": count}
