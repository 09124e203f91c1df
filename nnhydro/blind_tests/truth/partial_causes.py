"""Causes that act in a part of the campaign only: when, or where.

    tau = w tau(with the cause) + (1 - w) tau(without),     w (n,) in 0..1

    since    from one recording on                  until    up to one recording
    some     in recordings drawn at random          onset    from a moment within a recording on
    region   while one joint lies in a sector of its angles, with edges of a hundredth of a radian
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nnhydro.blind_tests.truth.world import Array, Generator, TrueRun

PARTS = ("since", "until", "some", "onset", "region")
KINDS = ("always", *PARTS)
FEWEST_WITH = 4  # recordings in which it acts, at least,
FEWEST_WITHOUT = 3  # and in which it does not
EDGE = 0.01  # rad


@dataclass(frozen=True)
class Part:
    """Where a cause acts: recordings by name, the moment in one of them, or a sector of a joint (from 1) in rad."""

    kind: str
    recordings: frozenset[str] = frozenset()
    later: bool = False  # whether it acts in what is recorded after the campaign
    moment: tuple[str, float] | None = None  # recording and s
    sector: tuple[int, float, float] | None = None

    def share(self, run: TrueRun) -> Array:
        """Return w (n,)."""
        if self.sector is not None:
            joint, low, high = self.sector
            q = run.q[:, joint - 1]
            return np.asarray(1 / (1 + np.exp(-(q - low) / EDGE)) / (1 + np.exp((q - high) / EDGE)))
        if self.moment is not None and run.name == self.moment[0]:
            return np.asarray(run.t >= self.moment[1], np.float64)
        acts = run.name in self.recordings or (self.later and run.name.startswith("motion"))
        return np.full(len(run.t), float(acts))

    def answer(self) -> dict[str, Any]:
        """Return what the sealed answer holds of it."""
        sector = None if self.sector is None else dict(zip(("joint", "low_rad", "high_rad"), self.sector, strict=True))
        return {"kind": self.kind, "recordings": sorted(self.recordings), "moment_s": None if self.moment is None else self.moment[1],
                "moment_in": None if self.moment is None else self.moment[0], "region": sector}


def draw_part(rng: Generator, kind: str, runs: Sequence[TrueRun], joint: int | None) -> Part | None:
    """Draw where a cause of `joint` acts; None for always."""
    names = [run.name for run in runs]
    first = int(rng.integers(FEWEST_WITHOUT, len(names) - FEWEST_WITH + 1))
    if kind == "since":
        return Part(kind, frozenset(names[first:]), later=True)
    if kind == "until":
        return Part(kind, frozenset(names[:len(names) - first]))
    if kind == "some":
        count = int(rng.integers(FEWEST_WITH, len(names) - FEWEST_WITHOUT + 1))
        return Part(kind, frozenset(str(name) for name in rng.choice(names, count, replace=False)))
    if kind == "onset":
        run = runs[first]
        return Part(kind, frozenset(names[first:]), True, (run.name, round(float(rng.uniform(0.3, 0.7) * run.t[-1]), 3)))
    if kind == "region":
        place = joint or int(rng.integers(1, runs[0].q.shape[1] + 1))
        q = np.concatenate([run.q[:, place - 1] for run in runs])
        start = float(rng.uniform(0.1, 0.5))
        low, high = np.quantile(q, [start, start + float(rng.uniform(0.3, 0.4))])
        return Part(kind, frozenset(names), True, None, (place, round(float(low), 4), round(float(high), 4)))
    return None
