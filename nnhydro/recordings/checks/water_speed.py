"""A carriage, a base or a current faster than any: a unit, mostly mm/s.

Towing carriages reach some 25 m/s, water tunnels some 60 m/s; in gases the speed of sound is taken as the end.
"""

from collections.abc import Iterator

import numpy as np

from nnhydro.conventions import column
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.checks.fluid import LIQUID
from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, Severity, TableCheck, check
from nnhydro.recordings.checks.reading import Array, Reading
from nnhydro.recordings.readers.map_line import mapping_text
from nnhydro.recordings.recording import PAIRS, Recording, SteadyTable

ODD, IMPOSSIBLE = 30.0, 100.0  # m/s in a liquid: above the fastest carriages; above any rig
ODD_IN_GAS = 340.0  # m/s, the speed of sound in air
SLOW = 0.05  # m/s: a slower carriage hardly loads an arm, so that cm/s are likelier than mm/s
USUAL = 95  # percentile of the speed that is judged


def usual_speeds(x: Recording | SteadyTable) -> Iterator[tuple[str, float]]:
    """Yield (column, usual speed m/s) of everything that carries the arm or the water."""
    channels: list[tuple[str, Array]] = [] if x.u0 is None else [(column("u0"), x.u0)]
    for key in ("base", "current"):
        pair = getattr(x, key)
        if pair is not None:
            channels += [(column(name), values) for name, values in zip(PAIRS[key], pair.T, strict=True) if "yaw" not in name]
    for name, values in channels:
        seen = np.abs(values[np.isfinite(values)])
        if len(seen):
            yield name, float(np.percentile(seen, USUAL))


def likely_unit(speed: float) -> tuple[str, float]:
    """Return the unit that makes `speed` (m/s) one of a carriage, and what it is in m/s."""
    return ("mm/s", 1e-3) if speed > 1e3 * SLOW else ("cm/s", 1e-2)


def _too_fast(x: Recording | SteadyTable, arm: Arm, steady: bool) -> Iterator[Oddity]:
    """One finding a column; what the user has stated a unit of is taken as given."""
    liquid = arm.fluid.density_kg_m3 >= LIQUID[0]
    for name, speed in usual_speeds(x):
        if speed <= (ODD if liquid else ODD_IN_GAS) or name in x.origin.stated:
            continue
        unit, smaller = likely_unit(speed)
        severity: Severity = "error" if liquid and speed > IMPOSSIBLE else "warning"
        what = (f"reaches {speed:.4g} m/s, faster than any {'towing tank' if liquid else 'wind tunnel'}; in {unit} that would be "
                f"{speed * smaller:.3g} m/s")
        remedy = f"map it with its unit, {mapping_text(x.origin, name, steady, unit=unit)} (unit: m/s where it is right)"
        yield Oddity(x.name, severity, name, what, remedy, in_file=f"convert {name} from {unit} to m/s in the file")


@check
class WaterSpeed(RecordingCheck):
    """Carriage, base and water move no faster than any tank allows."""

    id = "water_speed"
    looks_for = f"carriages and currents beyond {ODD:g} m/s in a liquid, {ODD_IN_GAS:g} m/s in a gas"
    remedy = "map the column with its unit"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding a column."""
        yield from _too_fast(reading.recording, reading.arm, False)


@check
class WaterSpeedInTable(TableCheck):
    """Steady runs are towed no faster than any tank allows."""

    id = "water_speed_in_table"
    looks_for = WaterSpeed.looks_for
    remedy = WaterSpeed.remedy

    def find(self, table: SteadyTable, arm: Arm) -> Iterator[Oddity]:
        """Yield one finding a column."""
        yield from _too_fast(table, arm, True)
