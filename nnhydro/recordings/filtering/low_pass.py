"""The zero-phase low-pass of McLain & Rock: a Butterworth filter run forward and backward.

    gain(f) = 1 / (1 + (f/f_c)^(2 N)),   N the order of one pass            [-]

Two passes of order 4 give a gain of 0.5 at the cut-off and no delay.
Source: McLain & Rock (1998), section 2 (25 Hz, fourth order, forward and backward).
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import RecordingError, require

Array = NDArray[np.float64]


MIN_NEAR = 6  # rows at least through which the parabola at an end is drawn


def _extension(x: Array, pad: int, near: int) -> Array:
    """Return `pad` rows that go on after the last of `x` (n, ...): a parabola through its last `near` rows less the reflected rest."""
    flat = x.reshape(len(x), -1)
    trend = _powers(np.arange(-pad, pad + 1), near) @ (_parabola(near) @ flat[-near:])
    rest = flat[-1] - trend[pad]  # the extension starts at the last row itself
    tail = trend[pad + 1:] + 2 * rest - (flat[-pad - 1:-1] - trend[:pad])[::-1]
    result: Array = tail.reshape(pad, *x.shape[1:])
    return result


def _powers(row: NDArray[np.int64], near: int) -> Array:
    """1, r and r^2 (n, 3) of rows counted from the last, in `near` rows."""
    made: Array = (row[:, None] / near) ** np.arange(3)
    return made


@lru_cache(maxsize=64)  # recordings of one campaign mostly share a rate, and this takes as long as the filtering
def _parabola(near: int) -> Array:
    """What gives the coefficients (3,) of the parabola through `near` rows, (3, near)."""
    made: Array = np.asarray(np.linalg.pinv(_powers(np.arange(1 - near, 1), near)), dtype=float)
    return made


@lru_cache(maxsize=64)
def _sections(order: int, share: float) -> tuple[Array, Array]:
    """Second-order sections of a Butterworth filter with its cut-off at `share` of the Nyquist frequency, and their state at rest at 1."""
    from scipy.signal import butter, sosfilt_zi

    sections: Array = butter(order, share, output="sos")
    return sections, sosfilt_zi(sections)[..., None]


@final
@dataclass(frozen=True)
class LowPass:
    """Zero-phase low-pass; `cutoff_hz` in Hz, `order` of one pass."""

    cutoff_hz: float
    order: int = 4

    def __post_init__(self) -> None:
        require(np.isfinite(self.cutoff_hz) and self.cutoff_hz > 0, f"cut-off {self.cutoff_hz} Hz: give a positive frequency")
        require(1 <= self.order <= 12, f"filter order {self.order}: give 1 to 12")

    def gain(self, f: Array) -> Array:
        """Gain of both passes at the frequencies `f` in Hz (continuous-time formula)."""
        result: Array = 1.0 / (1.0 + (f / self.cutoff_hz) ** (2 * self.order))
        return result

    def apply(self, x: Array, dt: float) -> Array:
        """Return `x` (n, ...) evenly sampled every `dt` s, filtered along its first axis; a linear operator on `x`.

        Both ends are padded by a parabola through the last period of the cut-off, less the reflected rest: an odd reflection alone would
        force the acceleration to zero where a recording begins or ends in motion. A cut-off at or above 0.45 of the sampling rate
        passes everything. Raises RecordingError below four rows.
        """
        from scipy.signal import sosfilt

        require(len(x) >= 4, f"{len(x)} rows are too few to filter: at least 4 are needed", RecordingError)
        if self.cutoff_hz * dt >= 0.45:
            return x
        sos, rest = _sections(self.order, 2.0 * self.cutoff_hz * dt)
        # the ring of the filter lasts about one period of the cut-off; padding three of them keeps it off the record
        period = 1.0 / (self.cutoff_hz * dt)
        pad = min(len(x) - 1, int(np.ceil(3.0 * period)))
        near = min(len(x), max(int(np.ceil(period)), MIN_NEAR))
        padded = np.concatenate([_extension(x[::-1], pad, near)[::-1], x, _extension(x, pad, near)]).reshape(len(x) + 2 * pad, -1)
        for _ in range(2):  # forward, then backward
            padded = sosfilt(sos, padded, axis=0, zi=rest * padded[0])[0][::-1]
        result: Array = np.ascontiguousarray(padded[pad:pad + len(x)]).reshape(x.shape)
        return result

    def document(self) -> dict[str, float | int | str]:
        """Return the filter as model files store it."""
        return {"kind": "butterworth, forward and backward", "cutoff_hz": self.cutoff_hz, "order": self.order}
