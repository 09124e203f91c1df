"""Left-out scores of many candidates beside one choice, at once: the choice is solved for once, each candidate by its Schur complement.

    S_u = D_u - B_u' A_u^-1 B_u,   theta_c = S_u^-1 (g_c - B_u' A_u^-1 g_b),   theta_b = A_u^-1 (g_b - B_u theta_c)

A_u, B_u, D_u, g the Gram matrices of the choice (b) and the candidate (c) over all units but u. The same numbers as `Bench.scored`.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.score import FLOOR, Bench, Index

Array = NDArray[np.float64]
CHUNK = 64  # candidates at once


def _solved(bench: Bench, base: Index, groups: Index) -> tuple[Array, Array]:
    """Left-out parameters (units + 1, candidates, q + w) and their columns (candidates, q + w); the last unit leaves nothing out."""
    G, q = bench.unit_sums, len(base)
    total = bench.total
    full = np.concatenate([total[None] - G, total[None]])  # (units + 1, P, P)
    A = full[:, base[:, None], base[None, :]] + np.diag(bench.penalty(base))
    count, w = groups.shape
    flat = groups.ravel()
    B, gb = full[:, base[:, None], flat[None, :]], full[:, base, -1]
    solved = np.linalg.solve(A, np.concatenate([B, gb[..., None]], axis=2))
    AB, Ag = solved[..., :-1].reshape(len(full), q, count, w), solved[..., -1]
    D = full[:, groups[:, :, None], groups[:, None, :]] + np.eye(w) * (1e-8 * np.diag(total)[groups] + 1e-12)[:, :, None]
    Bc = B.reshape(len(full), q, count, w)
    S = D - np.einsum("uqcv,uqcw->ucvw", Bc, AB, optimize=True)
    gc = full[:, flat, -1].reshape(len(full), count, w) - np.einsum("uqcw,uq->ucw", Bc, Ag, optimize=True)
    theta_c = np.linalg.solve(S, gc[..., None])[..., 0]
    theta_b = Ag[:, None, :] - np.einsum("uqcw,ucw->ucq", AB, theta_c, optimize=True)
    places = np.concatenate([np.broadcast_to(base, (count, q)), groups], axis=1)
    return np.concatenate([theta_b, theta_c], axis=2), places


def scores(bench: Bench, columns: Index, candidates: Sequence[tuple[int, ...]]) -> tuple[Array, Array]:
    """Return for candidates of one width w the total scores (c,) beside the `columns` chosen, and the fitted values (c, K + w).

    The values are those of `columns` in order, then the candidate's.
    """
    base = bench.index(columns)
    G, n = bench.by_unit
    totals, values = [], []
    for start in range(0, len(candidates), CHUNK):
        groups = bench.p + np.array(candidates[start:start + CHUNK], dtype=np.int64)
        theta, places = _solved(bench, base, groups)
        left = theta[:-1]  # (units, c, q + w)
        H = G[:, :, places[:, :, None], places[:, None, :]]  # (units, joints, c, r, r)
        Hx = np.matmul(H, left[:, None, :, :, None])[..., 0]
        g = G[:, :, places, -1]
        energy = G[:, :, -1, -1][..., None] + ((Hx - 2 * g) * left[:, None]).sum(axis=-1)  # (units, joints, c)
        rows = n[:, None, None]
        totals.append((rows / 2 * np.log(np.maximum(energy / rows, FLOOR))).sum(axis=(0, 1))
                      + 0.5 * (bench.prior * theta[-1][:, : bench.p] ** 2).sum(axis=1))
        values.append(theta[-1][:, bench.p:])
    return np.concatenate(totals), np.concatenate(values)
