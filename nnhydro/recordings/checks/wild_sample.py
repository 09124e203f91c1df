"""Single values far outside all others: a lost reading, or a logger's code for "no value" such as -999."""

from collections.abc import Iterator

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import FAR, Reading, rows


@check
class WildSample(RecordingCheck):
    """No value lies far outside all others of its channel; what other checks say is drawn without it."""

    id = "wild_sample"
    looks_for = f"up to a few values {FAR:g} times as far from the median as any other"
    remedy = "a lost reading, or a logger's code for 'no value': leave the cell empty"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding a channel."""
        for name, found in reading.wild.items():
            row, value = found[0]
            more = f" and {len(found) - 1} more" if len(found) > 1 else ""
            what = f"reads {value:g}, far outside all other values of the channel"
            yield Oddity(reading.name, "warning", f"{name}, {rows(row)}{more}", what, self.remedy)
