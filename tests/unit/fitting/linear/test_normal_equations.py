"""Normal equations of the linear part: sums for any target, and many penalties solved at a time, against the same in dense form."""

import pytest
import torch

from nnhydro.fitting.linear.normal_equations import CLOSED, STATED, Grams, Ridge, right_hand_sides

ROWS, SHARED, OWN = 300, 5, 3
TIERS = torch.tensor([0, 0, 1, 1, 2, *[2] * OWN, *[2] * OWN])


def rows(joints=2, seed=0):
    """Columns and target of rows, and who watches which of them: two members, a third each."""
    generator = torch.Generator().manual_seed(seed)
    columns, target = torch.randn(ROWS, joints, SHARED + OWN, generator=generator), torch.randn(ROWS, joints, generator=generator)
    third = torch.arange(ROWS) % 3
    return columns, target, torch.stack([third == 0, third == 1])


def dense(columns, target):
    """Weighted columns (joints rows, q), each joint with coefficients of its own behind those that all share, and right-hand sides."""
    s, joints = target.double().pow(2).mean(dim=0).sqrt(), columns.shape[1]
    A = torch.zeros(joints, len(columns), SHARED + joints * OWN, dtype=torch.float64)
    for j in range(joints):
        A[j, :, :SHARED] = columns[:, j, :SHARED].double() / s[j]
        A[j, :, SHARED + j * OWN:SHARED + (j + 1) * OWN] = columns[:, j, SHARED:].double() / s[j]
    return A, (target.double() / s).T


@pytest.mark.parametrize("joints", [1, 2, 3])
def test_sums_are_those_of_the_dense_problem_over_all_rows_and_over_those_that_a_member_trains_on(joints):
    columns, target, watch = rows(joints)
    A, z = dense(columns, target)
    s, g, own_g = right_hand_sides(columns, SHARED, target, watch)
    H, own_H = Grams.of(columns, watch).hessians(s, SHARED)
    for keep, found_H, found_g in ((torch.ones(ROWS, dtype=torch.bool), H, g), *zip(~watch, own_H, own_g, strict=True)):
        a, b = A[:, keep].flatten(0, 1), z[:, keep].flatten()
        torch.testing.assert_close(found_H, a.T @ a, rtol=1e-9, atol=1e-6)
        torch.testing.assert_close(found_g, a.T @ b, rtol=1e-9, atol=1e-6)


def test_the_sums_of_fewer_columns_are_part_of_those_of_all():
    columns, _, watch = rows()
    some, wanted = Grams.of(columns, watch).first(SHARED + 1), Grams.of(columns[..., :SHARED + 1], watch)
    torch.testing.assert_close(some.whole, wanted.whole)
    torch.testing.assert_close(some.seen, wanted.seen)


def problem():
    """Two members' problems, of which the second coefficient has a prior, and what they are made of."""
    columns, target, watch = rows()
    s, _, g = right_hand_sides(columns, SHARED, target, watch)
    whole, H = Grams.of(columns, watch).hessians(s, SHARED)
    size = torch.diagonal(whole)
    return Ridge.of(H, g, size, slice(1, 2), TIERS), H, g, size


@pytest.mark.parametrize("several", [[(1e-2, 1e-1, 1.0)], [(1e-2, weight, 1.0) for weight in (1e-3, 1.0, 10.0)],
                                     [(1e-2, CLOSED, weight) for weight in (1e-3, 1e-1)], [(CLOSED, CLOSED, CLOSED)]])
def test_each_penalty_gives_the_solution_of_its_dense_problem_and_closed_tiers_none(several):
    ridge, H, g, size = problem()
    for weights, found in zip(several, ridge.theta(several), strict=True):
        weight = torch.tensor(weights, dtype=torch.float64)[TIERS]
        open_ = weight < CLOSED
        open_[1] = True
        penalty = weight * size
        penalty[1] = STATED
        for member in range(2):
            wanted = torch.linalg.solve(H[member][open_][:, open_] + torch.diag(penalty[open_]), g[member][open_])
            torch.testing.assert_close(found[member, open_], wanted, rtol=1e-8, atol=1e-12)
            assert not found[member, ~open_].any()
            torch.testing.assert_close(ridge.of_member(member).theta([weights])[0, 0], found[member])
