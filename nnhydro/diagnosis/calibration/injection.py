"""Put effects of stated sizes into a campaign: the torques of baseline and effects, and noise of this campaign's spectrum, on its motions.

    y = Y z + sum_k x_k beta_k + e,     e ~ N(0, noise)          rows of the cosine domain, in which the noise is independent
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.model.evidence import WhiteRows
from nnhydro.diagnosis.model.sizes import without_unknown
from nnhydro.diagnosis.noise.spectrum import Noise
from nnhydro.diagnosis.problem.design import Design
from nnhydro.diagnosis.problem.hypothesis import Hypothesis
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]
T = TypeVar("T", WhiteRows, WeightedLibrary)


def inject(design: Design, noise: Noise, model: StripTheory, z: Array, effects: Sequence[tuple[Hypothesis, Array]], seed: int) -> Design:
    """Return `design` with the torque of the baseline at `z` (p,), of `effects` with their linear values, and new noise.

    Values per recording keep their size and get a random phase.
    """
    rng = np.random.default_rng(seed)
    y = design.Y @ z + np.sqrt(noise.noise_variance) * rng.standard_normal(design.y.shape)
    group = design.problem.group_of
    for hypothesis, values in effects:
        plain = replace(hypothesis, values_by_recording={}, working_model=None) if hypothesis.values_by_recording else hypothesis
        X = design.columns([plain], model)
        for g in range(design.problem.groups):
            turned = values
            if hypothesis.per_recording:
                turn = rng.standard_normal(len(values))
                turned = turn * np.linalg.norm(values) / np.linalg.norm(turn)
            y[group == g] += X[group == g] @ turned
    return Design(design.problem, design.baseline, design.Y, y, design.tau - design.y + y)


def with_torque(view: WeightedLibrary, y: Array) -> WeightedLibrary:
    """Return `view` with the whitened torque `y` (n, joints) in place of the measured one; products with it are computed anew."""
    old = view.whitened
    unknown = [(old.Phi * old.sw[:, j:j + 1]).T @ y[:, j] for j in range(old.joints)]
    b = np.concatenate([old.Y.reshape(y.size, old.p).T @ y.ravel(), *unknown])
    whitened = _copy(old, y=y, b=b, yy=float((y**2).sum()))
    columns = {k: replace(law, Xy=law.Xw.reshape(-1, law.Xw.shape[2]).T @ y.ravel()) for k, law in view._columns.items()}
    return _copy(view, whitened=whitened, Xy=view.products(y[..., None])[0], _columns=columns, _per_recording_best={})


def _copy(original: T, **changes: object) -> T:
    """A shallow copy of `original` with `changes`, without what it has cached of its torque."""
    made = object.__new__(type(original))
    made.__dict__.update({k: v for k, v in original.__dict__.items() if k != "_per_recording_products"} | changes)
    return made


def predict_whitened(view: WeightedLibrary, found: ScoredSet, remainder: ScoredSet) -> Array:
    """Return the whitened torque (n, joints) of `found`: baseline and effects fitted without the unknown, which is that of `remainder`."""
    whitened, columns = view.whitened, view.join(found.chosen)
    p, m = whitened.p, whitened.m
    mean = without_unknown(whitened, columns).mean
    made = whitened.Y @ mean[:p]
    for j in range(whitened.joints):
        made[:, j] += (whitened.Phi * whitened.sw[:, j:j + 1]) @ remainder.fit.mean[p + j * m: p + (j + 1) * m]
    for k, at in found.places(view).items():
        made += view.columns(k).Xw @ mean[at]
    return np.asarray(made)
