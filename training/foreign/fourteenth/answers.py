"""The answer to a campaign: the share of each hidden effect, and what of them no plausible constants can take up."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from campaign import Campaign, Effect, Run
from machines import Arm, Array
from mechanics import State, added_mass_torques, at_joint, behind_belt, drag_torques, kinematics, rigid_torques


def over_all(runs: list[Run], values: Callable[[Run], Array]) -> Array:
    """The rms of each joint over all recordings."""
    return np.sqrt(np.mean(np.concatenate([values(run) for run in runs]) ** 2, 0))


def sizes_of_torques(campaign: Campaign, runs: list[Run]) -> tuple[Array, Array]:
    """The rms torque of each joint, and the size that shares are of: the same, but at least 0.03 of the largest."""
    if campaign.free:
        weight = over_all(runs, lambda run: weight_torques(campaign.machine, run.state))
        return weight, weight
    rms = over_all(runs, lambda run: run.tau)
    return rms, np.maximum(rms, 0.03 * rms.max())


def weight_torques(machine: Arm, state: State) -> Array:
    """The torques of the weight of an arm at rest."""
    rest = replace(state, dq=0 * state.dq, ddq=0 * state.ddq, du0=0 * state.du0)
    return rigid_torques(machine, rest, kinematics(machine, rest))


def takers(machine: Arm, state: State) -> list[tuple[Array, float]]:
    """Torques that could take up a part of an effect, each with the uncertainty of its coefficient (0: unknown)."""
    links, columns = kinematics(machine, state), []
    if machine.density > 0:
        for i in range(machine.links):
            columns += [(drag_torques(machine, links, i), 0.0), (added_mass_torques(machine, links, i), 0.0)]
    rigid = rigid_torques(machine, state, links)
    for i in range(machine.links):
        for name in ("mass", "com", "inertia"):
            values = getattr(machine, name).copy()
            values[i] *= 1.01
            columns.append(((rigid_torques(replace(machine, **{name: values}), state, links) - rigid) / 0.01, machine.known_to[i]))
        if machine.friction:
            (coulomb, viscous), rate = machine.friction[i], state.dq[:, i]
            columns += [(at_joint(state, i + 1, values), machine.friction_known_to)
                        for values in (coulomb * np.tanh(rate / 0.004), viscous * rate)]
    return columns


def left_after_refit(machine: Arm, runs: list[Run], noise: Array) -> Array:
    """The rms of what of the effects no C_D, C_M, and no mass or stated friction within its uncertainty can take up."""
    every = slice(None, None, max(1, sum(len(run.state.t) for run in runs) // 8000))
    columns, rows, known = [], [], []
    for run in runs:
        taken = takers(machine, run.state)
        known = [uncertainty for _, uncertainty in taken]
        columns.append(np.stack([(behind_belt(machine, torques) / noise)[every].T.ravel() for torques, _ in taken], 1))
        rows.append((sum(run.parts.values()) / noise)[every].T.ravel())
    base, effects = np.concatenate(columns), np.concatenate(rows)
    prior = np.diag([1 / uncertainty if uncertainty else 1e-9 for uncertainty in known])
    fit = np.linalg.lstsq(np.concatenate([base, prior]), np.concatenate([effects, np.zeros(len(known))]), rcond=None)[0]
    squares = np.zeros(machine.links)
    ends = np.cumsum([len(row) for row in rows])[:-1]
    for left in np.split(effects - base @ fit, ends):
        squares += ((left.reshape(machine.links, -1) * noise[:, None]) ** 2).sum(1)
    return np.sqrt(squares / (len(effects) / machine.links))


def entry_of(effect: Effect, runs: list[Run], size: Array) -> dict[str, Any]:
    """The entry of one hidden effect."""
    shares = over_all(runs, lambda run: run.parts[effect.name]) / size
    share = shares[effect.joint - 1] if effect.joint else shares.max()
    entry: dict[str, Any] = {"effect": effect.name, "joint": effect.joint, "share_of_rms_torque": round(float(share), 4),
                             "share_by_joint": [round(float(value), 4) for value in shares], "law": effect.law}
    if effect.accept:
        entry["accept"] = effect.accept
    return entry


def answer_of(campaign: Campaign, runs: list[Run]) -> dict[str, Any]:
    """The answer to a campaign of which `runs` are the recordings."""
    rms, size = sizes_of_torques(campaign, runs)
    left = None
    if campaign.hidden and not campaign.free:
        shares = left_after_refit(campaign.machine, runs, campaign.sensors.noise * size) / size
        left = [round(float(share), 4) for share in shares]
    return {"style": campaign.style, "links": campaign.machine.links, "noise_share": campaign.sensors.noise,
            "only_angles": not (campaign.sensors.rates or campaign.sensors.accelerations),
            "hidden": [entry_of(effect, runs, size) for effect in campaign.hidden], "title": campaign.title, "note": campaign.note,
            "left_after_refit": left, "recordings": len(campaign.motions), "rms_torque_Nm": [round(float(value), 5) for value in rms]}
