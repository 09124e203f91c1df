"""Does what remains move two joints together? Then one cause loads both, as a mount that sways does: their sensors err separately.

    rho_g = r_1'r_2 / |r_1| |r_2|,   sum_g n_g rho_g^2 ~ chi^2 of one for each recording g        r_j: whitened rows of joint j in g, n_g

Errors of the angles move the torques of all joints together, too: these must be small beside what is common.
Source: coherence of two records, |P_xy|^2 / (P_xx P_yy), here without frequencies: SciPy, signal.coherence,
https://docs.scipy.org/doc/scipy-1.16.0/reference/generated/scipy.signal.coherence.html; the test is ours.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import Any, final

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from nnhydro.diagnosis.constants import FORM, MATERIAL, P_ALARM
from nnhydro.diagnosis.search.best_fit import best_fit
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search

Array = NDArray[np.float64]


@final
@dataclass(frozen=True)
class CommonCause:
    """Two joints (from 1) that what remains moves together, and the root mean square of the correlations, recording by recording."""

    joints: tuple[int, int]
    correlation: float

    @property
    def sentence(self) -> str:
        """Return what moves together, and what that means."""
        return (f"moves joints {self.joints[0]} and {self.joints[1]} together (correlation {self.correlation:.2f}): one cause loads both, "
                "such as a mount that sways or water that moves")

    def document(self) -> dict[str, Any]:
        """Return it for diagnosis.json."""
        return {"joints": list(self.joints), "correlation": round(self.correlation, 4)}


def _correlations(a: Array, b: Array, group: NDArray[np.intp]) -> tuple[Array, NDArray[np.intp]]:
    """Return the correlation (groups,) of two records in each recording, and the number of rows of each."""
    products = [np.bincount(group, x) for x in (a * b, a * a, b * b)]
    return products[0] / np.sqrt(np.maximum(products[1] * products[2], 1e-300)), np.bincount(group)


def common_cause(search: Search, found: ScoredSet) -> CommonCause | None:
    """Return the two joints that what remains beside `found` moves together most; None where it is little, chance, or errors of angles."""
    design, fit = search.view.library.design, best_fit(search, found)
    moving = design.problem.frequency >= 0
    if design.y.shape[1] < 2 or design.undriven or not moving.any():
        return None
    r, left = fit.residual[moving], (fit.residual / fit.whitened.sw)[moving]
    energy = (left**2).sum(axis=0)
    by_angles = design.input_variance[moving].sum(axis=0) / np.maximum(energy, 1e-300)
    size = np.sqrt(energy / design.duration) / np.maximum(design.scale, 1e-300)
    _, group = np.unique(design.problem.group_of[moving], return_inverse=True)
    causes = []
    for i, j in combinations(range(r.shape[1]), 2):
        rho, rows = _correlations(r[:, i], r[:, j], group)
        common = float((rows * rho**2).sum() / rows.sum())
        by_chance = float(chdtrc(len(rho), (rows * rho**2).sum()))
        if by_chance < P_ALARM and common * FORM > by_angles[[i, j]].max() and np.sqrt(common) * size[[i, j]].min() > MATERIAL:
            causes.append(CommonCause((i + 1, j + 1), float(np.sqrt(common))))
    return max(causes, key=lambda cause: cause.correlation, default=None)
