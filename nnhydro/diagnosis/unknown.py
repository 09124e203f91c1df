"""What is systematic but has no name: a learner that knows no physics, judged on recordings that it has not seen.

Its inputs are the state, what the joints did lately, the time in the recording and the recording's place in the campaign: without time a
thermal drift passes silently. R2 = 1 - sum (r - learned)^2 / sum r^2 over left-out recordings, a joint.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.locate import Residual
from nnhydro.diagnosis.locks import sign_flip_p

Array = NDArray[np.float64]
LATELY = (0.15, 0.6)  # s, memories of the joint rates
FOLDS = 4
TREES, LEAVES = 80, 12
LEAST_ROWS = 200
TELLING = 0.25  # of R2: what an input must be worth to be named
REAL, SURE = 0.05, 0.01  # R2 and p from which something systematic is said to be left


@final
@dataclass(frozen=True)
class Learned:
    """What the learner predicts of one joint's residual on recordings it has not seen, and which inputs it needs for that."""

    joint: int
    r2: float
    p_value: float
    depends_on: tuple[str, ...]

    @property
    def real(self) -> bool:
        """Whether something systematic is there beyond chance."""
        return self.r2 >= REAL and self.p_value <= SURE


def _memory(x: Array, dt: float, span: float) -> Array:
    from scipy.signal import lfilter

    keep = float(np.exp(-dt / span))
    return np.asarray(lfilter([1 - keep], [1, -keep], x, zi=[keep * x[0]])[0], np.float64)


def inputs(parts: Sequence[Residual]) -> dict[str, Array]:
    """Return the learner's inputs by name, rows of all moving `parts` one after the other."""
    names = [name for name in parts[0].state if all(name in part.state for part in parts)]
    found: dict[str, list[Array]] = {}
    for place, part in enumerate(parts):
        columns: dict[str, Array] = {name: part.state[name] for name in names}
        n = len(part.r)
        for name in [name for name in names if name.startswith("dq")]:
            for span in LATELY:
                columns[f"{name} over the last {span:g} s"] = _memory(part.state[name], part.dt, span)
        columns |= {"time in the recording": part.dt * np.arange(n, dtype=np.float64),
                    "place in the campaign": np.full(n, place / max(len(parts) - 1, 1))}
        for name, x in columns.items():
            found.setdefault(name, []).append(np.asarray(x))
    return {name: np.concatenate(pieces) for name, pieces in found.items()}


def _folds(parts: Sequence[Residual], seed: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number of recording and of fold of every row."""
    recordings = {name: k for k, name in enumerate(dict.fromkeys(part.recording for part in parts))}
    which = np.concatenate([np.full(len(part.r), recordings[part.recording]) for part in parts])
    dealt = np.random.default_rng(seed).permutation(len(recordings)) % min(FOLDS, len(recordings))
    return which, dealt[which]


def learned(residuals: Sequence[Residual], seed: int, explain: bool = True) -> list[Learned]:
    """Return for every joint what can be predicted of `residuals` from state, history, time and recording; [] for too few recordings."""
    from sklearn.ensemble import HistGradientBoostingRegressor

    parts = [part for part in residuals if part.dt > 0 and len(part.r) >= 2]
    if not parts or sum(len(part.r) for part in parts) < LEAST_ROWS or len({part.recording for part in parts}) < FOLDS:
        return []
    named = inputs(parts)
    X, r = np.column_stack(list(named.values())), np.concatenate([part.r for part in parts])
    which, fold = _folds(parts, seed)
    rng, found = np.random.default_rng(seed), []
    for j in range(r.shape[1]):
        y, said, worth = r[:, j], np.zeros(len(r)), np.zeros(X.shape[1])
        for k in range(int(fold.max()) + 1):
            out = fold == k
            model = HistGradientBoostingRegressor(max_iter=TREES, max_leaf_nodes=LEAVES, min_samples_leaf=20, l2_regularization=1.0,
                                                  random_state=seed).fit(X[~out], y[~out])
            said[out] = model.predict(X[out])
            for i in range(X.shape[1]) if explain else ():
                mixed = X[out].copy()
                mixed[:, i] = rng.permutation(mixed[:, i])
                worth[i] += float(((y[out] - model.predict(mixed)) ** 2).sum() - ((y[out] - said[out]) ** 2).sum())
        total = max(float((y**2).sum()), 1e-300)
        count = np.maximum(np.bincount(which), 1)
        gain = np.log(np.bincount(which, y**2) / count + 1e-300) - np.log(np.bincount(which, (y - said) ** 2) / count + 1e-300)
        r2 = 1 - float(((y - said) ** 2).sum()) / total
        order = [i for i in np.argsort(-worth).tolist() if r2 > 0 and worth[i] / total > TELLING * r2][:3]
        found.append(Learned(j + 1, r2, sign_flip_p(gain), tuple(list(named)[i] for i in order)))
    return found
