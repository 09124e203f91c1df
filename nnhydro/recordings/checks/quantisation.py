"""Coarse steps of encoders and torque sensors."""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Array, Reading

COARSE = 0.002  # of the range
WHOLE = 0.9  # share of steps that are whole multiples of the smallest
ALIKE = 0.9  # share of rows that lie one such step apart: more is a joint that turns at one speed


def step_of(x: Array) -> float:
    """Return the step of a quantised channel, 0 where it is none."""
    between = np.abs(np.diff(x[np.isfinite(x)]))
    steps = between[between > 1e-12 * max(float(np.ptp(x[np.isfinite(x)])), 1e-300)] if len(between) else between
    if len(steps) < 20:
        return 0.0
    step = float(np.percentile(steps, 1))
    multiples = steps / step
    whole = np.abs(multiples - np.round(multiples)) < 0.05 + 0.01 * multiples
    at_one_speed = (np.round(multiples) == 1).sum() > ALIKE * len(between)
    return step if bool(whole.mean() > WHOLE) and np.median(multiples) < 20 and not at_one_speed else 0.0


@check
class Quantisation(RecordingCheck):
    """Steps should be small against the range."""

    id = "quantisation"
    looks_for = f"angles or torques in steps of more than {COARSE:.1%} of their range"
    remedy = "the steps act as noise; a higher gain or finer encoder would help"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield a note a channel."""
        for name, x in reading.channels():
            if not name.startswith(("q", "tau")) or not np.isfinite(x).any():
                continue
            step, width = step_of(x), float(np.ptp(x[np.isfinite(x)]))
            if width > 0.02 * max(1.0, abs(float(np.nanmax(np.abs(x))))) and step > COARSE * width:
                unit = "rad" if name.startswith("q") else "N m"
                yield Oddity(reading.name, "note", name, f"has steps of {step:.2g} {unit}, {step / width:.1%} of its range", self.remedy)
