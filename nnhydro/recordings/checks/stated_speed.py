"""Speeds that nothing in a liquid has, whatever unit is stated: the unit is another one.

    p_atm + rho g h - rho v^2 / 2 C < p_vapour        a cylinder (C > 1) cavitates in open water from v = 14 m/s on

A spinning shaft keeps its unit, however fast it turns: only the speed of a tip through a liquid is judged.
"""

from collections.abc import Iterator

from nnhydro.recordings.arm import Arm
from nnhydro.recordings.checks.degrees import tip_speed, too_little_for_degrees
from nnhydro.recordings.checks.fluid import LIQUID
from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, TableCheck, check
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.checks.water_speed import likely_unit, usual_speeds
from nnhydro.recordings.readers.units import factor
from nnhydro.recordings.recording import Recording, SteadyTable

FASTEST = 20.0  # m/s through a liquid; the tallest waves and the fastest towing carriages reach it
LONGER = {1e-3: "s", 1e-6: "ms", 1e-9: "us"}  # by the unit of time stated, s: the next longer one


def _impossible(x: Recording | SteadyTable, name: str, what: str, speed: float, likely: str) -> Oddity:
    """The finding about the column `name`: `speed` m/s by the unit stated; in `likely` it would be possible."""
    stated = x.origin.stated[name]
    there = speed * (factor(stated, name) / factor(likely, name) if name == "t_s" else factor(likely, name) / factor(stated, name))
    what = (f"{what} at {speed:.3g} m/s by the stated unit {stated}, beyond anything in a liquid; in {likely} that would be "
            f"{there:.3g} m/s")
    return Oddity(x.name, "warning", name, what, f"write 'unit: {likely}' in the line of {name} in columns.yaml or --map FILE")


def _tow_findings(x: Recording | SteadyTable, arm: Arm) -> Iterator[Oddity]:
    """One finding for each column of carriage, base or current."""
    for name, speed in usual_speeds(x) if arm.fluid.density_kg_m3 >= LIQUID[0] else ():
        if speed > FASTEST and name in x.origin.stated:
            yield _impossible(x, name, "moves", speed, likely_unit(speed)[0])


def _tip_findings(reading: Reading) -> Iterator[Oddity]:
    """One finding for each joint whose tip is too fast: its angle is in degrees, or, where it hardly turns, the time is too short."""
    r, stated = reading.recording, reading.recording.origin.stated
    for joint in range(reading.arm.n_links):
        name, speed = reading.arm.column("q", joint + 1), tip_speed(reading, joint)
        if speed <= FASTEST or reading.dt > 0.5:
            continue
        degrees = not too_little_for_degrees(reading, joint)
        if degrees and name in stated and factor(stated[name], name) > factor("deg", name):
            yield _impossible(r, name, "moves the tip", speed, "deg")
        elif "t_s" in stated and (longer := LONGER.get(factor(stated["t_s"], "t_s"))):
            yield _impossible(r, "t_s", f"joint {joint + 1} moves the tip", speed, longer)


@check
class StatedSpeed(RecordingCheck):
    """What moves through a liquid is slower than 20 m/s, whatever unit is stated."""

    id = "stated_speed"
    looks_for = f"tips and carriages beyond {FASTEST:g} m/s in a liquid by a unit that columns.yaml or the file states"
    remedy = "correct the unit"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding a column."""
        yield from _tow_findings(reading.recording, reading.arm)
        if reading.arm.fluid.density_kg_m3 >= LIQUID[0] and not reading.arm.sliding:
            yield from _tip_findings(reading)


@check
class StatedSpeedInTable(TableCheck):
    """Steady runs are towed slower than 20 m/s, whatever unit is stated."""

    id = "stated_speed_in_table"
    looks_for = StatedSpeed.looks_for
    remedy = StatedSpeed.remedy

    def find(self, table: SteadyTable, arm: Arm) -> Iterator[Oddity]:
        """Yield one finding a column."""
        yield from _tow_findings(table, arm)
