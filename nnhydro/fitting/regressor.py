"""The network as a scikit-learn estimator on a plain table of features: for pipelines, grid searches and cross-validation by groups.

    y = c + x K + s g(x)          g the ensemble of tanh networks of models/learned/network.py, fitted to what the linear part leaves

    x   features, standardised;  K, c  ridge regression in closed form;  s  rms of what it leaves, one an output

Some rows, whole groups where `groups` are given, are only watched: the penalty of K, when each member stops, and whether it may add to the
linear part at all is decided there. With `parity` (+1 or -1 a feature) the estimate is odd under the mirror that multiplies the features by
it: c = 0, K has odd features only, g is odd by construction. Source: as models/learned/network.py; the closed-form start is ours.
"""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted, validate_data
from torch import Tensor

from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.network.gradient_fit import TrainingState, gradient_fit
from nnhydro.fitting.network.rows import Rows
from nnhydro.models.learned.network import Ensemble, odd_output, soft_bound

Array = NDArray[np.float64]
PENALTIES = tuple(10.0**-k for k in range(8))  # of the ridge, times the number of rows
SHARES = 20  # without groups rows are dealt into so many, of which some are watched
FEWEST = 10  # rows below which none is spared for watching
FREE = 100.0  # bound of the scaled output: no bound in effect
FLAT = 1e-12  # a feature that varies less, relative to its size, is constant


def _ridge(x: Array, y: Array, train: NDArray[np.bool_], usable: NDArray[np.bool_]) -> Array:
    """Return K (features, outputs), zero where not `usable`, with the penalty that does best on the rows that are not in `train`."""
    A, b = x[train][:, usable], y[train]
    H, g = A.T @ A, A.T @ b
    K = np.zeros((x.shape[1], y.shape[1]))
    best, eye = np.inf, np.eye(len(H)) * len(A)
    for penalty in PENALTIES if not train.all() else PENALTIES[3:4]:
        found = np.linalg.solve(H + penalty * eye, g)
        error = float(((x[~train][:, usable] @ found - y[~train]) ** 2).sum()) if not train.all() else 0.0
        if error < best:
            best, K[usable] = error, found
    return K


class TorqueRegressor(RegressorMixin, BaseEstimator):  # type: ignore[misc]  # scikit-learn ships no types
    """Ensemble of tanh networks beside a linear part.

    `hidden` sizes of the layers; `members` of the ensemble; `epochs` at most, `patience` without improvement; `batch` rows per step;
    `learning_rate`, `weight_decay` of AdamW; `validation_share` of the rows (or groups) each member only watches; `parity` (features,) of
    +1 and -1, None for no symmetry; `random_state` of weights, order and watched rows. Invalid numbers raise ValueError in `fit`.
    """

    def __init__(self, hidden: Sequence[int] = (32, 32), members: int = 2, epochs: int = 200, patience: int = 15, batch: int = 256,
                 learning_rate: float = 5e-3, weight_decay: float = 1e-2, validation_share: float = 0.15,
                 parity: ArrayLike | None = None, random_state: Any = 0) -> None:
        self.hidden = hidden
        self.members = members
        self.epochs = epochs
        self.patience = patience
        self.batch = batch
        self.learning_rate = learning_rate
        self.weight_decay = weight_decay
        self.validation_share = validation_share
        self.parity = parity
        self.random_state = random_state

    def __sklearn_tags__(self) -> Any:
        """Tell scikit-learn that there may be several outputs."""
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags

    def _config(self, seed: int) -> TrainingConfig:
        return TrainingConfig(model="network", hidden=tuple(self.hidden), members=self.members, bound=FREE, epochs=self.epochs,
                              batch=self.batch, learning_rate=self.learning_rate, weight_decay=self.weight_decay, patience=self.patience,
                              validation_share=self.validation_share, seed=seed)

    def _sign(self, features: int) -> Array:
        """Parity (features,) as given, +1 where there is none."""
        if self.parity is None:
            return np.ones(features)
        sign = np.asarray(self.parity, dtype=float)
        if sign.shape != (features,) or not np.isin(sign, (-1.0, 1.0)).all():
            raise ValueError(f"parity must hold +1 or -1 for each of the {features} features, has shape {sign.shape}")
        return sign

    def _inputs(self, X: Array) -> Array:
        """Standardised features; without symmetry beside a constant that is odd, so that nothing of g cancels."""
        x = (X - self.centre_) / self.spread_
        return x if self.parity is not None else np.column_stack([x, np.ones(len(x))])

    def fit(self, X: ArrayLike, y: ArrayLike, groups: ArrayLike | None = None) -> Self:
        """Fit to features X (n, features) and targets y (n,) or (n, outputs); rows with the same `groups` (n,) are watched together."""
        checked: tuple[Array, Array] = validate_data(self, X, y, multi_output=True, y_numeric=True, dtype=np.float64)
        table, self.one_output_ = checked[0], checked[1].ndim == 1
        target = checked[1].astype(float).reshape(len(table), -1)
        random = check_random_state(self.random_state)
        config = self._config(int(random.randint(2**31)))
        unit, watched = self._watched_units(len(table), groups, random)
        odd = self._sign(table.shape[1]) < 0
        self.centre_ = np.where(odd, 0.0, table.mean(axis=0))
        spread = np.sqrt(((table - self.centre_) ** 2).mean(axis=0))
        self.spread_ = np.where(spread > FLAT * (np.abs(table).max(axis=0) + FLAT), spread, np.inf)
        self.offset_ = np.zeros(target.shape[1]) if self.parity is not None else target.mean(axis=0)
        x = self._inputs(table)
        usable = odd if self.parity is not None else np.ones(x.shape[1], dtype=bool)
        self.linear_ = _ridge(x, target - self.offset_, ~watched[0].numpy()[unit], usable)
        left = target - self.offset_ - x @ self.linear_
        self.scale_ = np.sqrt((left**2).mean(axis=0)) + 1e-12 * (np.abs(target).max(axis=0) + 1e-300)
        self._fit_network(x, left, unit, watched, config)
        return self

    def _watched_units(self, n: int, groups: ArrayLike | None, random: np.random.RandomState) -> tuple[NDArray[np.int64], Tensor]:
        """Return the unit of each row (n,) and which units are watched (members, units), by all members and for the penalty alike."""
        if groups is not None:
            _, unit = np.unique(np.asarray(groups), return_inverse=True)
        else:
            unit = random.permutation(np.arange(n) % min(SHARES, n))
        count = int(unit.max()) + 1
        watched = torch.zeros(self.members, count, dtype=torch.bool)
        if count > 1 and n >= FEWEST:
            chosen = random.permutation(count)[:min(count - 1, max(1, round(self.validation_share * count)))]
            watched[:, torch.from_numpy(chosen.copy())] = True
        return unit.astype(np.int64), watched

    def _fit_network(self, x: Array, left: Array, unit: NDArray[np.int64], watched: Tensor, config: TrainingConfig) -> None:
        """Fit the members to what the linear part leaves; one that does not help on the rows it watches is set to zero."""
        self.sign_ = self._sign(x.shape[1]) if self.parity is not None else np.append(np.ones(x.shape[1] - 1), -1.0)
        fresh = Ensemble.fresh((x.shape[1], *config.hidden, left.shape[1]), config.members, config.seed)
        rows = Rows(torch.from_numpy(x).float(), torch.from_numpy(self.sign_).float(), torch.ones(left.shape), torch.from_numpy(
            left / self.scale_).float(), torch.from_numpy(unit))
        state = TrainingState.fresh(fresh)
        ensemble = gradient_fit(fresh, rows, watched, config, state)
        look = watched[:, rows.unit] if bool(watched.any()) else torch.ones(len(watched), len(x), dtype=torch.bool)
        s = rows.target.pow(2).mean(dim=0).sqrt() + 1e-9
        alone = ((rows.target / s) ** 2).sum(dim=1).expand(len(look), -1).mul(look).sum(dim=1) / look.sum(dim=1)
        helps = (state.best_error < alone).double()[:, None, None]
        self.n_iter_ = state.epoch
        self.ensemble_ = ensemble.times(helps.expand(-1, 1, left.shape[1]))

    def predict(self, X: ArrayLike, return_std: bool = False) -> Any:
        """Return the estimate (n,) or (n, outputs); with `return_std` also the scatter of the members, of the same shape."""
        check_is_fitted(self)
        x = self._inputs(validate_data(self, X, reset=False, dtype=np.float64))
        g = soft_bound(odd_output(self.ensemble_, torch.from_numpy(x), torch.from_numpy(self.sign_)), FREE).numpy()
        mean, std = self.offset_ + x @ self.linear_ + self.scale_ * g.mean(axis=0), self.scale_ * g.std(axis=0)
        if self.one_output_:
            mean, std = mean[:, 0], std[:, 0]
        return (mean, std) if return_std else mean
