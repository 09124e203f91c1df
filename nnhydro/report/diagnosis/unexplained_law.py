"""What no finding explains, drawn: the residual on held-out recordings over its most telling input, in bins, with a 95 % interval.

    mean  m = sum_u n_u m_u / n,    half = t s,   s^2 = R / (R - 1) sum_u (n_u / n)^2 (m_u - m)^2

m_u is the mean of the n_u rows that recording u of R has in a bin: rows of a recording are alike, so that recordings are what is counted.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.decision.heldout_errors import Residual
from nnhydro.diagnosis.result import DiagnosisResult
from nnhydro.report.diagnosis.finding_law import DrawnLaw
from nnhydro.report.widgets.trace import bin_edges

Array = NDArray[np.float64]
BINS = 20
FEWEST_ROWS, FEWEST = 3, 4  # of a recording in a bin, and recordings, for its mean to be drawn


def _mean(r: Array, which: NDArray[np.int64]) -> tuple[float, float] | None:
    """Mean over rows and half of its interval over recordings; None where too few recordings are there."""
    from scipy.special import stdtrit

    count = np.bincount(which)
    used = np.flatnonzero(count >= FEWEST_ROWS)
    if len(used) < FEWEST:
        return None
    means, n = np.bincount(which, r)[used] / count[used], count[used]
    m, recordings = float(means @ n / n.sum()), len(used)
    s = np.sqrt(recordings / (recordings - 1) * (((n / n.sum()) * (means - m)) ** 2).sum())
    return m, float(stdtrit(recordings - 1, 0.975)) * float(s)


def _law(parts: Sequence[Residual], joint: int, name: str) -> DrawnLaw | None:
    """The residual of a joint over one variable, in bins; None where fewer than two bins hold enough recordings."""
    if any(name not in part.state for part in parts):
        return None
    x, r = np.concatenate([part.state[name] for part in parts]), np.concatenate([part.r[:, joint - 1] for part in parts])
    numbers = {recording: k for k, recording in enumerate(dict.fromkeys(part.recording for part in parts))}
    which = np.concatenate([np.full(len(part.r), numbers[part.recording]) for part in parts])
    edges = bin_edges(x, BINS, 0.002)
    rows = []
    for a, b in pairwise(edges):
        inside = (x >= a) & (x <= b)
        found = _mean(r[inside], which[inside])
        if found is not None:
            rows.append((float(x[inside].mean()), *found))
    if len(rows) < 2:
        return None
    at, mean, half = np.array(rows).T
    return DrawnLaw(joint, name, np.column_stack([x, r]), at, mean, mean, half)


def unknown_laws(result: DiagnosisResult) -> list[DrawnLaw]:
    """Return, for every joint with an unexplained residual, its mean over the most informative input."""
    parts = [part for part in result.heldout.remains if part.dt > 0 and len(part.r) >= 2]
    if not result.remainder.detected or not parts:
        return []
    drawn = [_law(parts, law.joint, law.depends_on[0]) for law in result.remainder.learned if law.real and law.depends_on]
    return [law for law in drawn if law is not None]
