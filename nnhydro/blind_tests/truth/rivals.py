"""Which other cause of the catalogue would look most like the hidden one, and how much of it that other cannot imitate.

    lambda_left = lambda * |x - (x.y) y / |y|^2| / |x|      x, y what the baseline's refit leaves of the hidden and of the other cause

The other cause is drawn a few times (joint, direction, length scales) at a middling size, so that lambda_left is an estimate: below the
campaign's limit the two can hardly be told apart, and a class of both names is the honest answer. Computed on at most five runs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nnhydro.blind_tests.truth.registry import makers, random_names, takes_belt
from nnhydro.blind_tests.truth.visibility import Yardstick
from nnhydro.blind_tests.truth.world import Array, Cause, Generator

RUNS = 5
DRAWS = 2
SHOWN = 3


def _share_left(x: Array, y: Array) -> float:
    """Return the share of x that y cannot imitate."""
    size = float(np.linalg.norm(y))
    if size < 1e-9:
        return 1.0
    return float(np.linalg.norm(x - y * (x @ y) / size**2) / max(float(np.linalg.norm(x)), 1e-12))


def nearest(rng: Generator, reference: Yardstick, found: Sequence[tuple[Cause, float]]) -> list[dict[str, float]]:
    """Return for each cause with its lambda the three nearest others: name -> lambda_left."""
    hidden = [reference.column([cause]) for cause, _ in found]
    left: list[dict[str, float]] = [{} for _ in found]
    if not found:
        return left
    for name in random_names(len(reference.arm.links)):
        if name == "added_mass" or (reference.arm.belt and not takes_belt(name)):
            continue
        for _ in range(DRAWS):
            draft = makers()[name](rng, reference.arm)
            y = reference.column([draft.make(float(np.sqrt(draft.low * draft.high)))])
            for (cause, size), x, result in zip(found, hidden, left, strict=True):
                if name != cause.id:
                    result[name] = min(result.get(name, np.inf), round(size * _share_left(x, y), 1))
    return [dict(sorted(result.items(), key=lambda item: item[1])[:SHOWN]) for result in left]
