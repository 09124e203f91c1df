"""The factor of an arrowhead matrix solves what that of the whole matrix solves."""

import numpy as np
import pytest

from nnhydro.diagnosis.model.arrowhead import Arrowhead

SIZES = {"two blocks": ((4, 3), 5), "one block": ((6,), 2), "no block": ((), 4), "an empty block": ((0, 3), 2), "no corner": ((3, 2), 0)}


def parts_of(sizes, corner, seed=0):
    """Blocks, borders and corner of a positive arrowhead matrix, and the matrix."""
    rng = np.random.default_rng(seed)
    total = sum(sizes) + corner
    M, blocks, borders, start = np.eye(total) * (total + 2.0), [], [], 0
    for m in sizes:
        at, A, B = slice(start, start + m), rng.uniform(-1, 1, (m, m)), rng.uniform(-1, 1, (m, corner))
        M[at, at] += A @ A.T
        M[at, total - corner:], M[total - corner:, at] = B, B.T
        blocks.append(M[at, at].copy())
        borders.append(B)
        start += m
    return blocks, borders, M[total - corner:, total - corner:].copy(), M


@pytest.mark.parametrize(("sizes", "corner"), SIZES.values(), ids=SIZES)
def test_it_is_the_cholesky_factor_of_the_whole_matrix(sizes, corner):
    *parts, M = parts_of(sizes, corner)
    factor, L, b = Arrowhead.of(*parts), np.linalg.cholesky(M), np.random.default_rng(1).uniform(-1, 1, (len(M), 3))
    np.testing.assert_allclose(factor.forward(b), np.linalg.solve(L, b), atol=1e-12)
    np.testing.assert_allclose(factor.forward(b[:, 0]), np.linalg.solve(L, b[:, 0]), atol=1e-12)
    np.testing.assert_allclose(factor.backward(b), np.linalg.solve(L.T, b), atol=1e-12)
    np.testing.assert_allclose(factor.log_determinant(), np.linalg.slogdet(M)[1], atol=1e-12)
    np.testing.assert_allclose(factor.inverse_diagonal(), np.diag(np.linalg.inv(M)), atol=1e-12)


def test_a_matrix_that_is_not_positive_is_refused():
    blocks, borders, corner, _ = parts_of((2,), 2)
    with pytest.raises(np.linalg.LinAlgError, match="not positive"):
        Arrowhead.of(blocks, [100 * B for B in borders], corner)
