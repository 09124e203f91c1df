"""A recording of which nothing can be used: no stretch without gaps and NaN is long enough."""

from collections.abc import Iterator

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.filtering.preprocessing import MIN_ROWS


@check
class TooShort(RecordingCheck):
    """At least one stretch must hold enough rows for an acceleration."""

    id = "too_short"
    looks_for = f"recordings without {MIN_ROWS} complete rows in a row"
    remedy = f"accelerations need {MIN_ROWS} complete rows in a row; remove the file or record again"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield a finding where no stretch remains."""
        if reading.ordered and not reading.stretches:
            what = f"its {len(reading.recording)} rows hold no stretch free of gaps and empty cells"
            yield Oddity(reading.name, "error", "", what, self.remedy)
