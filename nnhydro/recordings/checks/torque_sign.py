"""Torques of the wrong sign: water takes energy, it never gives any.

    W = sum_j int tau_j dpsi_j       from rest to rest, carriage and water at rest; psi are the motors' angles (q, or psi_2 = q_1 + q_2 / r)

W must not be negative: what the rigid body stores is given back when it stops. One joint alone may be driven by the others in every
recording, so that only the sum accuses. With all joints locked and the carriage moving, the outermost joint resists the water:
int tau_n u0 cos(phi_n) dt must not be negative either.
"""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import CampaignCheck, Oddity, TableCheck, check
from nnhydro.recordings.checks.reading import Array, Reading
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.readers.map_line import mapping_text
from nnhydro.recordings.recording import SteadyTable

MOVED = 0.05  # rad
NEGATIVE = -0.25  # work / sum of its moduli; a healthy arm has 0.5 to 1
OFTEN = 0.7  # share of recordings that must agree before a drive is accused
REMEDY = "positive is what the drive exerts along +q; map it"


def motor_angles(q: Array, arm: Arm) -> Array:
    """Return the angles (n, links) that the recorded torques work on."""
    if arm.drive.kind == "direct":
        return q
    return np.column_stack([q[:, 0], q[:, 0] + q[:, 1] / arm.drive.pulley_ratio])


def _increments(reading: Reading) -> tuple[Array, Array, Array, Array]:
    """Blockwise mean torque, motor-angle increments, outermost absolute angle and carriage travel over all stretches."""
    r = reading.recording
    parts: list[tuple[Array, Array, Array, Array]] = []
    for start, stop in reading.stretches:
        at = reading.blocks(start, stop)
        if r.tau is None or len(at) < 3:
            continue
        width = int(at[1] - at[0])
        count = len(at) - 1
        tau = r.tau[start:start + count * width].reshape(count, width, -1).mean(axis=1)
        travel = np.zeros(count) if r.u0 is None else r.u0[at[:-1]] * np.diff(r.t[at])
        parts.append((tau, np.diff(motor_angles(r.q[at], reading.arm), axis=0), r.q[at[:-1]].sum(axis=1), travel))
    links = reading.arm.n_links
    empty = (np.zeros((0, links)), np.zeros((0, links)), np.zeros(0), np.zeros(0))
    return tuple(np.concatenate(p) for p in zip(*parts, strict=True)) if parts else empty  # type: ignore[return-value]


def work(reading: Reading) -> Array | None:
    """Return (net work, moduli of work) a joint, last column both for the arm as a whole, J (2, links + 1); None where it says nothing."""
    tau, dpsi, phi, travel = _increments(reading)
    if not len(tau):
        return None
    if reading.towed:
        if reading.moved.max() > MOVED or reading.surrounded:
            return None
        pieces = np.zeros((len(tau), tau.shape[1]))
        pieces[:, -1] = tau[:, -1] * np.cos(phi) * travel
    else:
        if reading.moved.max() < MOVED:
            return None
        pieces = tau * dpsi
    pieces = np.column_stack([pieces, pieces.sum(axis=1)])
    return np.array([pieces.sum(axis=0), np.abs(pieces).sum(axis=0)])


def _share(pair: Array) -> Array:
    result: Array = np.divide(pair[0], pair[1], out=np.zeros_like(pair[0]), where=pair[1] > 0)
    return result


@check
class TorqueSign(CampaignCheck):
    """Over a recording the drives together must do positive work."""

    id = "torque_sign"
    looks_for = "drives that gain energy from still water"
    remedy = REMEDY

    def find(self, campaign: Campaign, how: Preparation) -> Iterator[Oddity]:
        """Yield one finding for each drive that gives negative work, where the sum over all drives is negative."""
        found = [w for r in campaign.recordings() if (w := work(Reading.of(r, campaign.arm))) is not None]
        if not found:
            return
        links = campaign.arm.n_links
        together = np.array([_share(w)[links] for w in found]) < NEGATIVE
        pooled = _share(np.sum(found, axis=0))
        if pooled[links] >= NEGATIVE or together.mean() < OFTEN:
            return
        guilty = [joint for joint in range(links) if pooled[joint] < NEGATIVE] or [int(np.argmin(pooled[:links]))]
        origin = campaign.load(campaign.names[0]).origin
        for joint in guilty:
            name = campaign.arm.column("tau", joint + 1)
            gains = f"drive {joint + 1} gains" if links == 1 else "the drives together gain"
            what = (f"{gains} energy from the water ({pooled[links]:+.0%} of the work exchanged, in {together.sum()} of {len(found)} "
                    f"recordings): {'' if links == 1 else f'drive {joint + 1} has '}probably the wrong sign")
            yield Oddity(None, "warning", name, what, f"{REMEDY}, {mapping_text(origin, name, sign=-1)}")


@check
class TorqueSignInTable(TableCheck):
    """In steady runs every drive works against the water."""

    id = "torque_sign_in_table"
    looks_for = "steady runs whose outermost torque pushes with the water instead of against it"
    remedy = REMEDY

    def find(self, table: SteadyTable, arm: Arm) -> Iterator[Oddity]:
        """Yield a finding where the outermost torque opposes the sign of the normal speed of its link in most runs."""
        rate = table.qd.sum(axis=1)
        speed = table.u0 * np.cos(table.q.sum(axis=1)) + 0.5 * arm.L[-1] * rate
        for j in range(arm.n_links - 1):  # the joints further in, seen along the normal of the outermost link
            speed = speed + arm.L[j] * table.qd[:, : j + 1].sum(axis=1) * np.cos(table.q[:, j + 1:].sum(axis=1))
        pieces = table.tau[:, -1] * speed
        total = float(np.abs(pieces).sum())
        if total > 0 and pieces.sum() / total < NEGATIVE:
            name = arm.column("tau", arm.n_links)
            what = f"pushes with the water in {(pieces < 0).mean():.0%} of the runs: probably the wrong sign"
            yield Oddity(table.name, "warning", name, what, f"{REMEDY}, {mapping_text(table.origin, name, True, sign=-1)}")
