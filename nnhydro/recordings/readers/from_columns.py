"""Columns of the contract become a recording or a steady table; what cannot be one is refused with its column named.

A belt drive whose second angle channel is the motor's, psi_2, is turned into joint angles here: q_2 = r (psi_2 - psi_1).
Source: Rivera (1995), section 3.3 (pulley ratio r: ours).
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import CLOCK, TIME, column
from nnhydro.errors import RecordingError, count_text, require
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.readers.map_line import map_line
from nnhydro.recordings.readers.table import FIRST_ROW, Columns
from nnhydro.recordings.recording import PAIRS, Origin, Recording, SteadyTable

Array = NDArray[np.float64]
ABSURD = 1e9  # rad, rad/s, m/s, N m: no arm does that; loggers write such numbers where a sensor gave nothing
MIN_ROWS = 4
REPEATED, IN_A_ROW = 0.02, 3  # share of the stamps, and so many in a row, that may repeat: a clock in milliseconds at about 1 kHz
COARSE = 0.005  # s, median step beyond which a repeated stamp is no matter of a coarse clock
# units that names of foreign columns end in: to be mapped, not only renamed
_FOREIGN = re.compile(r"[\s_(\[]+(deg|ms|us|N ?mm|N ?cm|mm|mm/s|rpm)[)\]]?$")
_JOINT_COLUMN = re.compile(r"(?:d?d?q|tau)(\d{1,6})(?:_sim|_std)?_(?:rad|rad_s|rad_s2|Nm|m|m_s|m_s2|N)$")
_OURS = re.compile(rf"{TIME}$|{CLOCK}$|d?u0_m_s2?$|d?(?:base|current)_(?:x|y)_m_s2?$|d?base_yaw_rad|{_JOINT_COLUMN.pattern}")
SHOWN = 6  # columns of a file that a message lists


@final
@dataclass(frozen=True)
class NamedColumns:
    """Columns under our names, the header as it stands in the file, the row number of the first row, and what was done."""

    columns: Columns
    header: tuple[str, ...] = ()
    first_row: int = FIRST_ROW
    steps: tuple[str, ...] = ()

    def numbers(self, name: str) -> Array | None:
        """Return the column called `name`, None where it is not there."""
        values = self.columns.get(name)
        return values if isinstance(values, np.ndarray) else None


def _likely(name: str, foreign: list[str]) -> str:
    """Which of the foreign columns is probably `name`; "" where none is."""
    stem = name.split("_")[0]
    near = sorted(column_name for column_name in foreign if stem[-1].isdigit() and column_name.startswith(stem))
    timely = [column_name for column_name in foreign if name == TIME and column_name.lower().startswith("t")]
    only = foreign if len(foreign) == 1 else []
    return next(iter([*near, *timely, *get_close_matches(name, foreign, n=1), *only]), "")


def _missing_message(named: NamedColumns, names: Sequence[str], where: str) -> RecordingError:
    """Say which columns are missing, which of the file's might be they, and how to tell us."""
    foreign = [column_name for column_name in named.header if not _OURS.match(column_name)]
    likely = _likely(names[0], foreign)
    unit = _FOREIGN.search(likely)
    line = map_line(Origin(mapped={names[0]: {"from": likely or "ITS NAME", **({"unit": unit[1]} if unit else {})}}), names[0])
    seen = foreign or named.header
    listed = ", ".join(map(repr, seen[:SHOWN])) + (f" and {len(seen) - SHOWN} more" if len(seen) > SHOWN else "")
    what = f"column {names[0]!r} is" if len(names) == 1 else f"columns {', '.join(map(repr, names))} are"
    return RecordingError(f"{where}: {what} missing, the file has {listed or 'no columns'}: say which is which in columns.yaml beside "
                          f"arm.yaml (or --map FILE), a line each under 'columns:', as in {line}")


def _require_sane(named: NamedColumns, where: str) -> None:
    for name, values in named.columns.items():
        if isinstance(values, np.ndarray) and name not in (TIME, CLOCK):
            absurd = np.flatnonzero((np.abs(values) > ABSURD) & np.isfinite(values))
            if len(absurd):
                row = int(absurd[0])
                raise RecordingError(f"{where}: column {name!r}, row {row + named.first_row}: {values[row]:.3g} is absurd, "
                                     f"beyond {ABSURD:g} ({count_text(len(absurd), 'such row')} of {len(values)}): clear "
                                     f"{'that cell' if len(absurd) == 1 else 'those cells'}, or map the unit (--map FILE) where all are so")


def _joints(named: NamedColumns, channel: str, arm: Arm, where: str, required: bool = False) -> Array | None:
    """The columns of one channel side by side (n, links); None where none is there; raises where only some are."""
    names = [arm.column(channel, joint + 1) for joint in range(arm.n_links)]
    found = [values for name in names if (values := named.numbers(name)) is not None]
    if not found and not required:
        return None
    for name in names:
        values = named.numbers(name)
        if values is None:
            raise _missing_message(named, [name for name in names if named.numbers(name) is None], where)
        need = "it is needed: export the log again with it, or move the file away" if required else "remove the column or repair the file"
        require(bool(np.isfinite(values).any()), f"{where}: column {name!r} holds no finite number: {need}", RecordingError)
    return np.column_stack(found).astype(float)


def _single(named: NamedColumns, name: str, where: str) -> Array | None:
    values = named.numbers(name)
    require(values is None or bool(np.isfinite(values).any()), f"{where}: column {name!r} holds no finite number: remove the column or "
            "repair the file", RecordingError)
    return values


def _pair(named: NamedColumns, key: str, where: str) -> Array | None:
    """Two columns that belong together (n, 2), 0 where only the other one is there; None where neither is."""
    found = [_single(named, column(channel), where) for channel in PAIRS[key]]
    given = [x for x in found if x is not None]
    return np.column_stack([np.zeros_like(given[0]) if x is None else x for x in found]) if given else None


def _slopes(named: NamedColumns, key: str, where: str) -> Array | None:
    """The accelerations of two rates (n, 2), None unless every rate that is given has its own."""
    rates = [rate for rate in PAIRS[key] if named.numbers(column(rate)) is not None]
    return _pair(named, f"d{key}", where) if rates and all(named.numbers(column(f"d{rate}")) is not None for rate in rates) else None


def _along_Y(named: NamedColumns, old: str, new: str, where: str) -> Array | None:
    """The column `old` of the carriage, or `new`, which means the same of any base; refused where both are given and differ."""
    by_old, by_new = _single(named, column(old), where), _single(named, column(new), where)
    if by_old is None or by_new is None:
        return by_new if by_old is None else by_old
    require(bool(np.array_equal(by_old, by_new, equal_nan=True)), f"{where}: columns {column(old)!r} and {column(new)!r} mean the same and "
            "differ: keep the one that was measured", RecordingError)
    return by_old


def _surroundings(named: NamedColumns, where: str, steady: bool = False) -> dict[str, Any]:
    """What moves besides the joints: base and water."""
    heading, turning = _single(named, column("heading"), where), column("base_yaw")
    alone = heading is not None and np.nanmax(heading) > np.nanmin(heading) and named.numbers(turning) is None
    require(steady or not alone, f"{where}: column {column('heading')!r} turns but has no rate beside it: add its derivative {turning!r}, "
            "which the loads need", RecordingError)
    found = {"u0": _along_Y(named, "u0", "base_y", where), "base": _pair(named, "base", where), "heading": heading,
             "current": _pair(named, "current", where)}
    return found if steady else found | {"du0": _along_Y(named, "du0", "dbase_y", where), "dbase": _slopes(named, "base", where),
                                         "dcurrent": _slopes(named, "current", where)}


def _refuse_foreign_joints(named: NamedColumns, arm: Arm, where: str, torque: bool = True) -> None:
    for name in named.header:
        match = _JOINT_COLUMN.match(name)
        if match and not 1 <= int(match[1]) <= arm.n_links and (torque or not name.startswith("tau")):
            raise RecordingError(f"{where}: column {name!r} names joint {match[1]}, but arm.yaml has {count_text(arm.n_links, 'link')}: "
                                 "add the link to arm.yaml or remove the column")


def _relative(angles: Array | None, arm: Arm) -> Array | None:
    if angles is None or arm.drive.angle2 == "relative":
        return angles
    return np.column_stack([angles[:, 0], arm.drive.pulley_ratio * (angles[:, 1] - angles[:, 0])])


def spread_stamps(t: Array) -> tuple[Array, int]:
    """Return the times with stamps that repeat spread evenly until the next one, and how many repeat.

    As they are where they run backward, or where so many repeat, or so many in a row, that no clock's coarse step explains it.
    """
    steps = np.diff(t)
    repeated = int((steps == 0).sum())
    slow = float(np.median(steps)) > COARSE if repeated else True
    if slow or not np.isfinite(t).all() or (steps < 0).any() or repeated > REPEATED * len(t):
        return t, 0
    first = np.flatnonzero(np.concatenate([[True], steps > 0]))
    count = np.diff(np.append(first, len(t)))
    if count.max() > IN_A_ROW or count[-1] > 1:
        return t, 0
    width = np.append(np.diff(t[first]), 0.0) / count
    return np.repeat(t[first], count) + np.concatenate([np.arange(k) for k in count]) * np.repeat(width, count), repeated


def recording_from_columns(named: NamedColumns, arm: Arm, name: str, origin: Origin, torque: bool = True) -> Recording:
    """Return the recording that `named` holds; with `torque`, torque columns are required; raises RecordingError naming the column."""
    where = origin.path or name
    _refuse_foreign_joints(named, arm, where, torque)
    channels = ("q", "tau") if torque else ("q",)
    wanted = [TIME, *(arm.column(channel, joint + 1) for channel in channels for joint in range(arm.n_links))]
    missing = [name for name in wanted if named.numbers(name) is None]
    t = _single(named, TIME, where)
    if missing or t is None:
        raise _missing_message(named, missing, where)
    require(len(t) >= MIN_ROWS, f"{where}: holds {count_text(len(t), 'row')}: a recording needs at least {MIN_ROWS}; remove the file or "
            "record again", RecordingError)
    _require_sane(named, where)
    q = _joints(named, "q", arm, where, required=True)
    assert q is not None
    require(not arm.sliding or named.numbers(column("base_yaw")) is None, f"{where}: column {column('base_yaw')!r}: a linear axis on a "
            "base that turns is not understood: remove the column where the base stands still", RecordingError)
    belt = arm.drive.angle2 == "absolute"
    spread, repeated = spread_stamps(t)
    remark = (f"{count_text(repeated, 'time stamp')} that repeat ({repeated / len(t):.1%}) spread until the next",) if repeated else ()
    steps = (*named.steps, *remark, *(("second angle: motor's to joint's",) if belt else ()))
    return Recording(name, spread, _relative(q, arm), tau=_joints(named, "tau", arm, where, required=True) if torque else None,  # type: ignore[arg-type]
                     qd=_relative(_joints(named, "qd", arm, where), arm), qdd=_relative(_joints(named, "qdd", arm, where), arm),
                     **_surroundings(named, where),
                     tau_sim=_joints(named, "tau_sim", arm, where) if torque else None, clock=_single(named, CLOCK, where), origin=origin,
                     steps=steps, stamps=t if repeated else None)


def steady_from_columns(named: NamedColumns, arm: Arm, name: str, origin: Origin) -> SteadyTable:
    """Return the steady table that `named` holds; raises RecordingError naming the column and the row."""
    where = origin.path or name
    _refuse_foreign_joints(named, arm, where)
    _require_sane(named, where)
    q = _joints(named, "q", arm, where, required=True)
    tau = _joints(named, "tau", arm, where, required=True)
    assert q is not None
    assert tau is not None
    zeros = np.zeros_like(q)
    qd = _joints(named, "qd", arm, where)
    around = _surroundings(named, where, steady=True)
    u0 = around["u0"]
    runs = named.columns.get("run")
    names = tuple(str(run) for run in runs) if runs is not None else tuple(f"{name}:{row + 1}" for row in range(len(q)))
    table = SteadyTable(name, names, _relative(q, arm), _relative(zeros if qd is None else qd, arm),  # type: ignore[arg-type]
                        np.zeros(len(q)) if u0 is None else u0, tau, _joints(named, "tau_std", arm, where),
                        _joints(named, "tau_sim", arm, where), origin, around["base"],
                        around["heading"], around["current"])
    for channel in (table.state, table.tau):
        bad = np.flatnonzero(~np.isfinite(channel.reshape(len(table), -1)).all(axis=1))
        if len(bad):
            raise RecordingError(f"{where}: row {bad[0] + named.first_row} (run {names[int(bad[0])]!r}) has an empty or infinite value: "
                                 "a steady run needs angles, speeds and torques; remove the row")
    return table
