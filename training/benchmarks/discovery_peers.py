"""The peers of diagnosis_peers.py: sparse regression on the diagnosis' own candidate columns, and learners of the residual without names.

    y = Y z + X b + e      y torque less what the baseline expects, Y its columns with their prior, X the candidates; in units of the noise

Sparse regressions get what is kindest to them: the baseline refitted beside the candidates (Y projected off X and y), every hypothesis at
the value of its nonlinear parameters that explains most alone, columns of one size, and a penalty or threshold chosen on left-out
recordings. What explains less than 1 % of the residual's energy is not counted as their claim. Effects with a phase or offset of each
recording's own are not among their columns (and not among the hidden ones of the benchmark).
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.diagnosis.decision.heldout_errors import states
from nnhydro.diagnosis.noise.spectrum import first_noise
from nnhydro.diagnosis.problem.baseline import Baseline, baseline_of
from nnhydro.diagnosis.problem.columns import columns_on
from nnhydro.diagnosis.problem.design import design_of
from nnhydro.diagnosis.problem.hypothesis import Hypothesis, enumerate_hypotheses
from nnhydro.diagnosis.problem.problem import MOST_STUDIED, Stretch, draw_names, problem_of
from nnhydro.fitting.linear.least_squares import ridge
from nnhydro.fitting.linear.statistics import columns_and_offset
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
MATERIAL = 0.01  # of the residual's energy: what a claim must explain
FOLDS, MODELS, SEED = 4, 20, 0
THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5)  # of the residual's rms
GP_ROWS = 300


@final
@dataclass(frozen=True, eq=False)
class Data:
    """All rows of a campaign: candidates `known` with their columns, and what every peer starts from."""

    against: Baseline
    known: tuple[Hypothesis, ...]
    Y: Array  # (n, joints, p)
    X: Array  # (n, joints, K)
    y: Array  # (n, joints) N m
    state: Array  # (n, states)
    recording: NDArray[np.int64]  # (n,)
    noise: Array  # (joints,) N m

    def refit(self, X: Array, b: Array) -> Array:
        """Return the baseline's parameters z (p,) beside `X` (n, joints, k) with the coefficients `b`."""
        w = 1 / self.noise[None, :, None]
        Y, y = (self.Y * w).reshape(-1, self.Y.shape[2]), ((self.y - X @ b)[..., None] * w).ravel()
        return ridge(Y, y)

    def projected(self) -> tuple[Array, Array, Array]:
        """Return X (N, K) and y (N,) in units of the noise with the baseline projected off, and the recording of every row."""
        w = 1 / self.noise[None, :, None]
        flat = [(x * w).reshape(-1, x.shape[2]) for x in (self.Y, self.X, self.y[..., None])]
        Y, rest = flat[0], np.column_stack(flat[1:])
        rest = rest - Y @ ridge(Y, rest)
        return rest[:, :-1], rest[:, -1], np.repeat(self.recording, self.y.shape[1])


def _states(motion: Motion) -> Array:
    return torch.cat([motion.q, motion.qd, motion.qdd, motion.u0[:, None]], dim=1).numpy()


def _best(known: tuple[Hypothesis, ...], Y: Array, X: Array, y: Array) -> list[int]:
    """The instance of every effect and joint whose columns explain most alone; X (n, joints, K) holds all columns side by side."""
    Q = np.linalg.qr(Y.reshape(-1, Y.shape[2]))[0]
    flat, r = X.reshape(-1, X.shape[2]), y.ravel()
    flat, r = flat - Q @ (Q.T @ flat), r - Q @ (Q.T @ r)
    ends, best = np.cumsum([hypothesis.width for hypothesis in known]), dict[Any, tuple[float, int]]()
    for k, (hypothesis, end) in enumerate(zip(known, ends.tolist(), strict=True)):
        own = flat[:, end - hypothesis.width:end]
        gain = float(r @ own @ np.linalg.lstsq(own.T @ own, own.T @ r, rcond=1e-10)[0])
        if gain > best.get(hypothesis.key, (-1.0, 0))[0]:
            best[hypothesis.key] = (gain, k)
    return sorted(k for _, k in best.values())


def prepared(campaign: Campaign, baseline: str) -> Data:
    """Return the rows of `campaign`, the baseline calibrated, every hypothesis at its best values."""
    problem = problem_of(campaign, draw_names(campaign.names, MOST_STUDIED, SEED))
    against = baseline_of(baseline, campaign.arm, problem.units(), Preparation(LowPass(problem.edge)))
    design = design_of(problem, against)
    peaks = tuple(np.max([np.abs(s.segment.tau).max(axis=0) for s in problem.stretches if s.segment.tau is not None], axis=0).tolist())
    known = tuple(hypothesis for hypothesis in enumerate_hypotheses(campaign.arm, peaks) if not hypothesis.per_recording)
    parts = []
    for stretch in problem.stretches:
        segment = stretch.segment
        Y, offset = columns_and_offset(against.physics.loads, segment, campaign.arm)
        every = [Y @ against.prior.F, columns_on(known, against.physics, stretch), against.target(segment, Y, offset)[..., None]]
        parts.append((stretch, np.concatenate(every, axis=2)[segment.keep]))
    full = np.concatenate([rows for _, rows in parts])
    p = design.Y.shape[2]
    Y, X, y = full[..., :p], full[..., p:-1], full[..., -1]
    chosen = _best(known, Y, X, y)
    starts = np.cumsum([0, *(hypothesis.width for hypothesis in known)])
    columns = np.concatenate([np.arange(starts[k], starts[k + 1]) for k in chosen])
    noise = np.sqrt(first_noise(design).noise_variance.sum(axis=0) / design.duration)
    recording = np.concatenate([np.full(len(rows), stretch.group) for stretch, rows in parts])
    names = [f"{x}{j + 1}{unit}" for x, unit in (("q", "_rad"), ("dq", "_rad_s"), ("ddq", "_rad_s2")) for j in range(campaign.arm.n_links)]
    state = []
    for stretch, _ in parts:
        told = states(stretch.segment)
        state.append(np.column_stack([*(told[name] for name in names), stretch.segment.u0])[stretch.segment.keep])
    return Data(against, tuple(known[k] for k in chosen), Y, X[..., columns], y, np.concatenate(state), recording, noise)


@final
@dataclass(frozen=True, eq=False)
class Peer(TorqueModel):
    """The baseline with parameters z (p,), candidates `known` with coefficients b (K,), and a learner of what remains."""

    against: Baseline
    z: Array
    known: tuple[Hypothesis, ...] = ()
    b: Array | None = None
    learner: Callable[[Array], Array] | None = None

    def torque(self, motion: Motion) -> Tensor:
        """Return the torques (n, joints) N m."""
        n, physics = len(motion), self.against.physics
        arrays = [getattr(motion, name).numpy() for name in ("t", "q", "qd", "qdd", "u0", "du0")]
        segment = Segment("unseen", *arrays, None, np.ones(n, dtype=bool), stop_row=n)
        Y, offset = columns_and_offset(physics.loads, segment, self.arm)
        tau = offset + Y @ (self.against.prior.mean + self.against.prior.F @ self.z)
        if self.b is not None:
            tau = tau + columns_on(self.known, physics, Stretch(0, "unseen", segment, None), predicted=True) @ self.b
        return torch.from_numpy(tau if self.learner is None else tau + self.learner(_states(motion)))

    def document(self) -> dict[str, Any]:
        """Return nothing: a peer is never stored."""
        return {}


def _peer(data: Data, z: Array, **more: Any) -> Peer:
    physics = data.against.physics
    return Peer(physics.arm, physics.preparation, {}, data.against, z, **more)


@final
@dataclass(frozen=True)
class Claims:
    """Effects (id, joint) that a sparse regression says are there: those that explain a material share, and how many have any weight."""

    material: tuple[tuple[str, int], ...] = ()
    weighted: int = 0


def _claims(data: Data, X: Array, y: Array, b: Array) -> Claims:
    ends = np.cumsum([hypothesis.width for hypothesis in data.known]).tolist()
    energy = {hypothesis.key: float(((X[:, end - hypothesis.width:end] @ b[end - hypothesis.width:end]) ** 2).sum())
              for hypothesis, end in zip(data.known, ends, strict=True)}
    return Claims(tuple(key for key, e in energy.items() if e >= MATERIAL * float(y @ y)), sum(e > 0 for e in energy.values()))


def _splits(recording: NDArray[np.int64]) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    from sklearn.model_selection import GroupKFold

    return list(GroupKFold(FOLDS).split(recording, groups=recording))


def _ensemble(X: Array, y: Array, threshold: float) -> Array:
    from pysindy.optimizers import STLSQ, EnsembleOptimizer

    np.random.seed(SEED)  # noqa: NPY002  the library draws from numpy's global generator
    optimizer = EnsembleOptimizer(STLSQ(threshold=threshold), bagging=True, n_models=MODELS)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # "threshold eliminated all coefficients": an empty model is a fair answer here
        return np.asarray(optimizer.fit(X, y[:, None]).coef_)[0]


def pysindy(data: Data) -> tuple[Peer, Claims]:
    """Return the model and the claims of an ensemble of sequentially thresholded least squares (median coefficients)."""
    return _sparse(data, _sindy)


def _sindy(X: Array, y: Array, recording: NDArray[np.int64]) -> Array:
    """The largest threshold whose left-out error is within a standard error of the least."""
    splits = _splits(recording)
    wrong = np.array([[float(((y[out] - X[out] @ _ensemble(X[fit], y[fit], t)) ** 2).mean()) for fit, out in splits] for t in THRESHOLDS])
    mean, best = wrong.mean(axis=1), int(wrong.mean(axis=1).argmin())
    within = mean <= mean[best] + wrong[best].std(ddof=1) / np.sqrt(FOLDS)
    return _ensemble(X, y, THRESHOLDS[int(np.flatnonzero(within).max())])


def lasso(data: Data) -> tuple[Peer, Claims]:
    """Return the model and the claims of scikit-learn's LassoCV, its penalty chosen on left-out recordings."""
    def fit(X: Array, y: Array, recording: NDArray[np.int64]) -> Array:
        from sklearn.linear_model import LassoCV

        penalties = np.abs(X.T @ y).max() / len(y) * np.geomspace(1.0, 1e-3, 40)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of slow convergence at the smallest penalties, which are not chosen
            return np.asarray(LassoCV(alphas=penalties, cv=_splits(recording), fit_intercept=False, max_iter=3000).fit(X, y).coef_)

    return _sparse(data, fit)


def _sparse(data: Data, fit: Callable[[Array, Array, NDArray[np.int64]], Array]) -> tuple[Peer, Claims]:
    X, y, recording = data.projected()
    size, level = np.sqrt((X**2).mean(axis=0)) + 1e-300, float(np.sqrt((y**2).mean()))
    b = fit(X / size, y / level, recording) * level / size
    return _peer(data, data.refit(data.X, b), known=data.known, b=b), _claims(data, X, y, b)


def _learned(data: Data, make: Callable[[Array, Array], Callable[[Array], Array]]) -> tuple[Peer, Claims]:
    z = data.refit(data.X, np.zeros(data.X.shape[2]))
    mean, scale = data.state.mean(axis=0), data.state.std(axis=0) + 1e-9
    fitted = [make((data.state - mean) / scale, r) for r in (data.y - data.Y @ z).T]
    return _peer(data, z, learner=lambda s: np.column_stack([f((s - mean) / scale) for f in fitted])), Claims()


def gp(data: Data) -> tuple[Peer, Claims]:
    """Return the baseline with a Gaussian process of the state on each joint's residual (one length a state, noise fitted)."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    rows = np.linspace(0, len(data.y) - 1, min(GP_ROWS, len(data.y))).astype(int)

    def make(s: Array, r: Array) -> Callable[[Array], Array]:
        level = float(r.std()) + 1e-12
        kernel = ConstantKernel(0.5) * RBF(np.full(s.shape[1], 2.0), (0.1, 1e3)) + WhiteKernel(0.5, (1e-4, 10.0))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a length at its bound means that the state does not matter
            model = GaussianProcessRegressor(kernel, random_state=SEED).fit(s[rows], r[rows] / level)
        return lambda x: np.asarray(model.predict(x)) * level

    return _learned(data, make)


def trees(data: Data) -> tuple[Peer, Claims]:
    """Return the baseline with boosted trees of the state on each joint's residual."""
    from sklearn.ensemble import HistGradientBoostingRegressor

    return _learned(data, lambda s, r: HistGradientBoostingRegressor(max_iter=100, max_leaf_nodes=12, random_state=SEED).fit(s, r).predict)


PEERS: dict[str, Callable[[Data], tuple[Peer, Claims]]] = {
    "pysindy, ensemble": pysindy, "lasso": lasso, "gp residual": gp, "boosted trees": trees}
