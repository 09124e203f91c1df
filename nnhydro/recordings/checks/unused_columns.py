"""Columns of a file that nnhydro does not use: mostly harmless, unless one of them is the carriage's speed."""

import re
from collections.abc import Iterator

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading

CARRIAGE = re.compile(r"carriage|tow|trolley|u_?0|(?<![a-z])u(?![a-z])|speed|velocity", re.IGNORECASE)
SHOWN = 4


@check
class UnusedColumns(RecordingCheck):
    """Every column should be a channel, or known to be none."""

    id = "unused_columns"
    looks_for = "columns that are no channel; a carriage's speed among them would not be used"
    remedy = "fine if they are no channels; otherwise map them in columns.yaml"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield a warning where one of the columns could be the carriage's speed and none is given, else a note."""
        unused = reading.recording.origin.unused
        if not unused:
            return
        named = ", ".join(map(repr, unused[:SHOWN])) + (f" and {len(unused) - SHOWN} more" if len(unused) > SHOWN else "")
        towing = [name for name in unused if CARRIAGE.search(name)] if not reading.towed and reading.recording.u0 is None else []
        if towing:
            yield Oddity(reading.name, "warning", "u0_m_s", f"the carriage is taken to be at rest, but nnhydro does not use {named}",
                         f"if {towing[0]!r} is the carriage's speed, map it to u0_m_s with its unit in columns.yaml")
        else:
            yield Oddity(reading.name, "note", "", f"nnhydro does not use the columns {named}" if len(unused) > 1 else
                         f"nnhydro does not use the column {named}", self.remedy)
