"""Where the baseline and the recordings differ: joint, recordings, region of state and frequency band of the residual's excess energy.

    share_j     excess of joint j's residual energy over the noise, as a share of all joints' excess
    conditions  the range of the state variable whose bins explain the largest share of the residual's energy or mean
    band        frequencies between which 90 % of the residual's power lies
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.decision.heldout_errors import Residual
from nnhydro.recordings.filtering.periodogram import hann_power

Array = NDArray[np.float64]
BINS = 10  # bins of a state variable
LEAST_EXPLAINED = 0.05  # share of the residual's variance that bins must explain before a region is named
MUCH_EXPLAINED = 0.25  # share from which a sentence says that the residual depends on a state
SHOWN = 4  # most names of recordings in a sentence


def few_names(recordings: Sequence[str]) -> str:
    """Return the names of recordings as a part of a sentence, the first SHOWN of many."""
    return f"{', '.join(recordings[:SHOWN])}{' and others' if len(recordings) > SHOWN else ''}"


@final
@dataclass(frozen=True)
class Location:
    """Where one joint's residual lies, as diagnosis.json holds it."""

    joint: int
    share: float
    where: str
    conditions: dict[str, list[float]]
    band_hz: list[float]
    recordings: list[str]
    follows: float = 0.0  # share of its variance that follows the state of `conditions`

    @property
    def sentence(self) -> str:
        """On which state the residual depends, or in which recordings it lies; empty where neither is plain."""
        few = few_names(self.recordings)
        if self.follows < MUCH_EXPLAINED:
            return f"lies in {few}" if few else ""
        (name, (low, high)), = self.conditions.items()
        return f"depends on {name}: it is largest from {low:.3g} to {high:.3g}{f', in {few}' if few else ''}"

    def document(self) -> dict[str, Any]:
        """Return the location for diagnosis.json."""
        return {"joint": self.joint, "share": self.share, "where": self.where, "conditions": self.conditions, "band_hz": self.band_hz,
                "recordings": self.recordings}


def _explained_share(x: Array, y: Array) -> tuple[float, Array, Array]:
    """Share of var(y) explained by bins of x of equal count, the bins' edges and their means of y."""
    edges = np.unique(np.quantile(x, np.linspace(0, 1, BINS + 1)))
    if len(edges) < 3:
        return 0.0, edges, np.zeros(max(len(edges) - 1, 0))
    which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
    count = np.bincount(which, minlength=len(edges) - 1)
    mean = np.bincount(which, y, minlength=len(edges) - 1) / np.maximum(count, 1)
    spread = float(((mean - y.mean()) ** 2 * count).sum() / max(((y - y.mean()) ** 2).sum(), 1e-300))
    return spread, edges, mean


def _region(edges: Array, size: Array) -> list[float]:
    """The range of bins around the largest in which `size` stays above half of it."""
    top = int(np.argmax(size))
    low = high = top
    while low > 0 and size[low - 1] > size[top] / 2:
        low -= 1
    while high < len(size) - 1 and size[high + 1] > size[top] / 2:
        high += 1
    return [float(edges[low]), float(edges[high + 1])]


def _band(parts: Sequence[Residual], joint: int) -> list[float]:
    """Frequencies in Hz between which 90 % of the residual's power lies, over recordings."""
    spectra = []
    for part in parts:
        if part.dt > 0 and len(part.r) >= 32:
            spectra.append(hann_power(part.r[:, joint] - part.r[:, joint].mean(), part.dt))
    if not spectra:
        return [0.0, 0.0]
    grid = np.linspace(0, min(float(f[-1]) for f, _ in spectra), 200)
    power = np.sum([np.interp(grid, f, p) for f, p in spectra], axis=0)
    share = np.cumsum(power) / np.sum(power)
    low, high = int(np.searchsorted(share, 0.05)), min(int(np.searchsorted(share, 0.95)), len(grid) - 1)
    return [float(grid[low]), float(grid[high])]


def _sentence(name: str, grows: bool, region: list[float], recordings: list[str]) -> str:
    where = f"{'depends' if grows else 'size depends'} on {name}, largest from {region[0]:.3g} to {region[1]:.3g}"
    return where + (f", in {', '.join(recordings[:SHOWN])}" if recordings else ", in every recording")


def _of_joint(parts: Sequence[Residual], joint: int, share: float) -> Location:
    r = np.concatenate([part.r[:, joint] for part in parts])
    names = [name for name in parts[0].state if all(name in part.state for part in parts)]
    candidates = []
    for name in names:
        x = np.concatenate([part.state[name] for part in parts])
        for y, signed in ((r, True), (r**2, False)):
            explained, edges, mean = _explained_share(x, y)
            if len(mean) >= 2:
                candidates.append((explained, name, signed, edges, np.abs(mean)))
    energy = {part.recording: 0.0 for part in parts}
    rows = dict.fromkeys(energy, 0)
    for part in parts:
        energy[part.recording] += float((part.r[:, joint] ** 2).sum())
        rows[part.recording] += len(part.r)
    mean_square = {name: energy[name] / max(rows[name], 1) for name in energy}
    typical = float(np.median(list(mean_square.values())))
    loud = [name for name, value in mean_square.items() if value > 4 * typical] if len(mean_square) > 3 else []
    best = max(candidates, key=lambda c: c[0]) if candidates else None
    if best is None or best[0] < LEAST_EXPLAINED:
        return Location(joint + 1, share, "spread over all states" + (f", mostly in {', '.join(loud[:SHOWN])}" if loud else ""), {},
                        _band(parts, joint), loud)
    region = _region(best[3], best[4])
    return Location(joint + 1, share, _sentence(best[1], best[2], region, loud), {best[1]: region}, _band(parts, joint), loud,
                    best[0] if best[2] else 0.0)


def locate(parts: Sequence[Residual], noise: Array) -> list[Location]:
    """Return one location a joint with excess residual energy, largest first; `noise` (joints,) N m."""
    energy = sum((part.r**2).sum(axis=0) for part in parts)
    rows = sum(len(part.r) for part in parts)
    excess = np.maximum(np.asarray(energy) - rows * noise**2, 0.0)
    if not excess.any():
        return []
    shares = excess / excess.sum()
    return [_of_joint(parts, j, float(shares[j])) for j in np.argsort(-shares).tolist() if shares[j] > 0.02]
