"""Angles in degrees where radians are expected.

A joint that turns by less than half a turn hardly reads degrees: these would be three, and the speed has another cause.
"""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.arm import Arm
from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, TableCheck, check
from nnhydro.recordings.checks.reading import Array, Reading
from nnhydro.recordings.readers.map_line import mapping_text
from nnhydro.recordings.recording import SteadyTable

WIDE = 4 * np.pi  # rad: two turns; hoses and cables forbid more
FASTEST = 15.0  # m/s at the tip: no arm moves so fast in water; in degrees, 0.3 m/s read as 15
LITTLE = np.pi  # rad: in degrees, less than 3.2
REMEDY = "map it with its unit, %s (unit: rad where the joint spins)"


def too_wide(q: Array) -> bool:
    """Whether an angle leaves two turns either way."""
    return bool(np.max(np.abs(q), initial=0.0, where=np.isfinite(q)) > WIDE)


def too_little_for_degrees(reading: Reading, joint: int) -> bool:
    """Whether `joint` (from 0) turns so little that its angle is hardly in degrees."""
    return bool(reading.moved[joint] < LITTLE and not too_wide(reading.recording.q[:, joint]))


def tip_speed(reading: Reading, joint: int) -> float:
    """Speed of the tip that the angle of one joint alone implies, m/s, blockwise so that noise does not count."""
    reach = float(reading.arm.L[joint:].sum())
    speeds = [0.0]
    for start, stop in reading.stretches:
        at = reading.blocks(start, stop)
        if len(at) > 5:
            speeds.append(float(np.percentile(np.abs(np.diff(reading.recording.q[at, joint]) / np.diff(reading.recording.t[at])), 95)))
    return max(speeds) * reach


@check
class Degrees(RecordingCheck):
    """q must be in radians."""

    id = "degrees"
    looks_for = "angles beyond two turns, or tips faster than any in water"
    remedy = "map it with its unit"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding a joint: an error where range and speed agree, a warning where one of them is odd."""
        for joint in range(reading.arm.n_links) if not reading.arm.sliding else ():
            if reading.arm.column("q", joint + 1) in reading.recording.origin.stated:
                continue
            q, name = reading.recording.q[:, joint], reading.arm.column("q", joint + 1)
            wide, speed = too_wide(q), tip_speed(reading, joint)
            fast = speed > FASTEST and not reading.dt > 0.5
            if wide or (fast and not reading.arm.dry and not too_little_for_degrees(reading, joint)):
                widest = float(np.max(np.abs(q), initial=0.0, where=np.isfinite(q)))
                cause = "probably degrees" if wide else "degrees, or a time that is too short"
                what = f"reaches {widest:.4g} rad ({widest / (2 * np.pi):.1f} turns) and moves the tip at {speed:.3g} m/s: {cause}"
                yield Oddity(reading.name, "error" if wide and fast else "warning", name, what,
                             REMEDY % mapping_text(reading.recording.origin, name, unit="deg"),
                             in_file=f"convert {name} from degrees to rad in the file")


@check
class DegreesInTable(TableCheck):
    """q of steady tables must be in radians."""

    id = "degrees_in_table"
    looks_for = "angles beyond two turns in steady tables"
    remedy = Degrees.remedy

    def find(self, table: SteadyTable, arm: Arm) -> Iterator[Oddity]:
        """Yield one finding a joint."""
        for joint in range(arm.n_links) if not arm.sliding else ():
            if arm.column("q", joint + 1) in table.origin.stated:
                continue
            if too_wide(table.q[:, joint]):
                name = arm.column("q", joint + 1)
                yield Oddity(table.name, "error", name, f"reaches {np.abs(table.q[:, joint]).max():.4g} rad: probably degrees",
                             REMEDY % mapping_text(table.origin, name, True, unit="deg"))
