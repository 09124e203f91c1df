"""Columns of the contract become a recording or a steady table; what cannot be one is refused with its column named.

A belt drive whose second angle channel is the motor's, psi_2, is turned into joint angles here: q_2 = r (psi_2 - psi_1).
Source: Rivera (1995), section 3.3 (pulley ratio r: ours).
"""

import re

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import CLOCK, TIME, column
from nnhydro.errors import RecordingError, require
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.readers.table import Columns
from nnhydro.recordings.recording import Origin, Recording, SteadyTable

Array = NDArray[np.float64]
_JOINT_COLUMN = re.compile(r"(?:d?d?q|tau)(\d+)(?:_sim|_std)?_(?:rad|rad_s|rad_s2|Nm)$")


def _numbers(columns: Columns, name: str) -> Array | None:
    values = columns.get(name)
    return values if isinstance(values, np.ndarray) else None


def _joints(columns: Columns, channel: str, arm: Arm, where: str, required: bool = False) -> Array | None:
    """The columns of one channel side by side (n, links); None where none is there; raises where only some are."""
    names = [column(channel, joint + 1) for joint in range(arm.n_links)]
    there = [name for name in names if _numbers(columns, name) is not None]
    absent = [name for name in names if name not in there]
    if not there and not required:
        return None
    if absent:
        near = sorted(name for name in columns if name.startswith(absent[0].split("_")[0]))[:3]
        hint = f"it has {near}: rename or map them" if near else "add the column, or name the foreign one with --map FILE"
        raise RecordingError(f"{where}: column {absent[0]!r} is missing: {hint}")
    stacked = np.column_stack([columns[name] for name in names]).astype(float)
    for name in names:
        require(bool(np.isfinite(np.asarray(columns[name], dtype=float)).any()), f"{where}: column {name!r} holds no finite number: "
                "remove the column or repair the file", RecordingError)
    return stacked


def _refuse_foreign_joints(columns: Columns, arm: Arm, where: str) -> None:
    for name in columns:
        match = _JOINT_COLUMN.match(name)
        if match and not 1 <= int(match[1]) <= arm.n_links:
            raise RecordingError(f"{where}: column {name!r} names joint {match[1]}, but arm.yaml has {arm.n_links} link(s): "
                                 "add the link to arm.yaml or remove the column")


def _relative(angles: Array | None, arm: Arm) -> Array | None:
    if angles is None or arm.drive.angle2 == "relative":
        return angles
    return np.column_stack([angles[:, 0], arm.drive.pulley_ratio * (angles[:, 1] - angles[:, 0])])


def recording_from_columns(columns: Columns, arm: Arm, name: str, origin: Origin, torque: bool = True) -> Recording:
    """Return the recording that `columns` hold; with `torque`, torque columns are required; raises RecordingError naming the column."""
    where = origin.path or name
    _refuse_foreign_joints(columns, arm, where)
    t = _numbers(columns, TIME)
    if t is None:
        raise RecordingError(f"{where}: column {TIME!r} is missing: add it, or name the foreign one with --map FILE")
    require(len(t) >= 4, f"{where}: holds {len(t)} rows: a recording needs at least 4", RecordingError)
    q = _joints(columns, "q", arm, where, required=True)
    assert q is not None
    belt = arm.drive.angle2 == "absolute"
    return Recording(name, t, _relative(q, arm), tau=_joints(columns, "tau", arm, where, required=torque),  # type: ignore[arg-type]
                     qd=_relative(_joints(columns, "qd", arm, where), arm), qdd=_relative(_joints(columns, "qdd", arm, where), arm),
                     u0=_numbers(columns, column("u0")), du0=_numbers(columns, column("du0")),
                     tau_sim=_joints(columns, "tau_sim", arm, where), clock=_numbers(columns, CLOCK), origin=origin,
                     steps=("second angle: motor's to joint's",) if belt else ())


def steady_from_columns(columns: Columns, arm: Arm, name: str, origin: Origin) -> SteadyTable:
    """Return the steady table that `columns` hold; raises RecordingError naming the column and the row."""
    where = origin.path or name
    _refuse_foreign_joints(columns, arm, where)
    q = _joints(columns, "q", arm, where, required=True)
    tau = _joints(columns, "tau", arm, where, required=True)
    assert q is not None
    assert tau is not None
    zeros = np.zeros_like(q)
    qd = _joints(columns, "qd", arm, where)
    u0 = _numbers(columns, column("u0"))
    runs = columns.get("run")
    names = tuple(str(run) for run in runs) if runs is not None else tuple(f"{name}:{row + 1}" for row in range(len(q)))
    table = SteadyTable(name, names, _relative(q, arm), _relative(zeros if qd is None else qd, arm),  # type: ignore[arg-type]
                        np.zeros(len(q)) if u0 is None else u0, tau, _joints(columns, "tau_std", arm, where),
                        _joints(columns, "tau_sim", arm, where), origin)
    for channel in (table.q, table.qd, table.u0, table.tau):
        bad = np.flatnonzero(~np.isfinite(channel.reshape(len(table), -1)).all(axis=1))
        if len(bad):
            raise RecordingError(f"{where}: row {bad[0] + 2} (run {names[int(bad[0])]!r}) has an empty or infinite value: "
                                 "a steady run needs angles, speeds and torques; remove the row")
    return table
