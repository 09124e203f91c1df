"""Stuck channels: an encoder that stops counting, a torque that is not updated, while the arm moves on."""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.checks.clipping import clipped_plateaus
from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import MOVED, Array, Reading, quantum, rows, runs

FROZEN = 0.1  # s
FROZEN_ROWS = 10
FREE = "nothing drives this machine"
COMMANDED = "right if it is the command to the drive; if it was measured, the channel is dead: leave its cells empty or record again"
MOVES = 0.1  # rad: an arm that moves farther changes the torque
STOP = 5  # rows over which a speed is taken
JUMP = 5.0  # times the largest step elsewhere
SWITCHES, LEVELS = 1 / 3, 20  # share of the rows at which a command changes at most, and how many values it takes


def _frozen_rows(x: Array, dt: float) -> list[tuple[int, int]]:
    """(start, stop) of rows over which `x` keeps one value for long, clipped ones aside."""
    if not dt > 0:
        return []
    least = max(FROZEN_ROWS, round(FROZEN / dt))
    known = {float(np.nanmax(x)), float(np.nanmin(x))} if clipped_plateaus(x) else set()
    return [(a, b + 1) for a, b in runs(np.diff(x) == 0) if b + 1 - a >= least and float(x[a]) not in known]


def _by_jump(q: Array, span: tuple[int, int]) -> float:
    """By how much the angle jumps when it thaws, rad, where that is far more than any other step."""
    b = span[1]
    if b >= len(q) or not np.isfinite(q[b]):
        return 0.0
    others = np.abs(np.delete(np.diff(q), b - 1))
    jump = abs(q[b] - q[b - 1])
    return float(jump) if jump > JUMP * np.nanmax(others, initial=0.0) else 0.0


def _by_stop(reading: Reading, joint: int, span: tuple[int, int]) -> float:
    """How far the joint would have gone on, rad, where it stops for good from full speed within one row; 0 where it slows down."""
    q, a = reading.recording.q[:, joint], span[0]
    if span[1] < len(q) or a < 2 * FROZEN_ROWS:
        return 0.0
    speed = (q[STOP: a + 1] - q[: a + 1 - STOP]) / STOP  # rad a row
    bend = float(np.nanmax(np.abs(speed[STOP:] - speed[:-STOP]), initial=0.0))
    last = abs(float(speed[-1]))
    return last * (span[1] - a) if last > 2 * bend + 3 * quantum(q) / STOP else 0.0


def _by_step(x: Array, span: tuple[int, int]) -> bool:
    """Whether `x` goes on after the span by its smallest step: a coarse channel keeps a value where what it measures turns back."""
    after = x[span[1]] if span[1] < len(x) else np.inf
    return bool(abs(after - x[span[0]]) < 1.5 * quantum(x))


def is_constant(x: Array) -> bool:
    """Return whether `x` (n,) keeps exactly one value, other than 0."""
    return bool(len(x) and x[0] != 0 and (x == x[0]).all())


def is_command(x: Array) -> bool:
    """Return whether `x` switches between few values and holds each, as a command does; a sensor changes from row to row."""
    return len(x) < 2 or bool(np.mean(np.diff(x) != 0) < SWITCHES and len(np.unique(x)) <= LEVELS)


@check
class StuckEncoder(RecordingCheck):
    """An angle may stand still only where the joint does."""

    id = "stuck_encoder"
    looks_for = "an angle that keeps exactly one value while its rate, or a jump afterwards, says that the joint moved"
    remedy = "a loose encoder or a frozen driver: leave these cells empty or record again"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding a joint: the longest frozen span that the arm moved through."""
        for joint in range(reading.arm.n_links):
            q = reading.recording.q[:, joint]
            found = [(moved, span) for span in _frozen_rows(q, reading.dt)
                     if (moved := max(reading.turned_by_rate(joint, span), _by_jump(q, span), _by_stop(reading, joint, span))) > MOVED]
            if found:
                moved, span = max(found)
                what = f"keeps exactly {q[span[0]]:.6g} rad while the joint moves by about {moved:.2g} rad ({len(found)} time(s))"
                yield Oddity(reading.name, "warning", f"{reading.arm.column('q', joint + 1)}, {rows(*span)}", what, self.remedy)


@check
class StuckTorque(RecordingCheck):
    """A torque may be constant only where nothing moves."""

    id = "stuck_torque"
    looks_for = "a torque that keeps exactly one value for part of a recording, or 0 in the whole, while the arm moves"
    remedy = "the torque channel is dead or not updated: leave these cells empty or record again"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding a joint: the longest span; a note alone where all torques are exactly 0, as of what nothing drives."""
        tau = reading.recording.tau
        if tau is None:
            return
        if not np.nan_to_num(tau, nan=1.0).any():
            yield Oddity(reading.name, "note", "", f"all torques are exactly 0 N m: {FREE}",
                         "if something does, the torque channel is dead or not updated: leave its cells empty or record again")
            return
        for joint in range(reading.arm.n_links):
            x = tau[:, joint]
            spans = [span for span in _frozen_rows(x, reading.dt) if self._range_moved(reading, span) > MOVES and not _by_step(x, span)
                     and not is_constant(x)]  # constant_torque compares these with the other recordings
            if spans:
                span = max(spans, key=lambda s: s[1] - s[0])
                what = f"keeps exactly {x[span[0]]:.4g} N m while the arm moves by {self._range_moved(reading, span):.2g} rad"
                command = is_command(np.delete(x, np.s_[span[0]:span[1] - 1])) and x[span[0]] != 0
                yield Oddity(reading.name, "note" if command else "warning", f"{reading.arm.column('tau', joint + 1)}, {rows(*span)}", what,
                             COMMANDED if command else self.remedy)

    def _range_moved(self, reading: Reading, span: tuple[int, int]) -> float:
        q = reading.recording.q[slice(*span)]
        return float(np.nanmax(np.ptp(q, axis=0), initial=0.0))


@check
class NeverMoves(RecordingCheck):
    """A joint that keeps exactly one value in a whole recording is locked, or its encoder is dead."""

    id = "never_moves"
    looks_for = "a joint whose angle is exactly constant while another joint moves far"
    remedy = "right if the joint is locked; otherwise check its encoder"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield a note a joint."""
        for joint in range(reading.arm.n_links):
            moving = float(np.max(np.delete(reading.moved, joint), initial=0.0))
            given = reading.recording.qd
            still = given is None or not np.nanmax(np.abs(given[:, joint]), initial=0.0) > 0.1
            if reading.moved[joint] == 0.0 and moving > 0.5 and still:
                yield Oddity(reading.name, "note", reading.arm.column("q", joint + 1), "never changes while another joint moves",
                             self.remedy)
