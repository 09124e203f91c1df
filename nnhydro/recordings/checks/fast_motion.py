"""A small motion that would be faster than any in water: the time is too short, in minutes or scaled."""

from collections.abc import Iterator

from nnhydro.recordings.checks.degrees import FASTEST, tip_speed, too_little_for_degrees
from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.readers.map_line import mapping_text


@check
class FastMotion(RecordingCheck):
    """Tips of arms in a liquid are slower than 15 m/s."""

    id = "fast_motion"
    looks_for = "tips faster than any in water though their joints turn by less than half a turn"
    remedy = "is t_s in seconds? Map it with its unit or scale"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding for the time of a recording."""
        if reading.arm.dry or reading.arm.sliding or "t_s" in reading.recording.origin.stated:
            return
        fast = [(tip_speed(reading, joint), joint) for joint in range(reading.arm.n_links) if too_little_for_degrees(reading, joint)]
        speed, joint = max(fast, default=(0.0, 0))
        if speed > FASTEST:
            what = (f"joint {joint + 1} turns by {reading.moved[joint]:.3g} rad only, yet moves the tip at {speed:.3g} m/s: the time is "
                    "probably too short")
            yield Oddity(reading.name, "warning", "t_s", what, "is t_s in seconds? Map it, "
                         f"{mapping_text(reading.recording.origin, 't_s', unit='min')}, or with its 'scale:'",
                         in_file="convert t_s to s in the file")
