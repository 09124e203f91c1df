"""The linear part of a learned model: the same ridge in dense form, member by member."""

from types import SimpleNamespace

import pytest
import torch

from nnhydro.features.strip_law.law import ARM, SURROUNDED
from nnhydro.fitting.linear.normal_equations import CLOSED
from nnhydro.fitting.network.linear_part import LinearPart, linear_part, with_free_functions
from nnhydro.fitting.network.rows import Rows

JOINTS, SHARED, ODD, LAW, STATED, UNITS = 2, 5, 3, 3, 1, 6  # columns: 3 of the law, 2 of the body of which 1 is stated, 3 odd features


def problem(seed=1, noise=0.3, n=240):
    """Rows and columns of a linear torque: body coefficients of about half a deviation, a law, odd features a joint."""
    generator = torch.Generator().manual_seed(seed)
    columns = torch.randn(n, JOINTS, SHARED + ODD, generator=generator)
    shared, odd = torch.tensor([1.0, -0.5, 0.3, 0.4, 0.8]), torch.tensor([[0.5, -1.0], [0.0, 0.2], [1.0, 0.1]])
    target = columns[..., :SHARED] @ shared + torch.einsum("njk,kj->nj", columns[..., SHARED:], odd)
    target = target * torch.tensor([1.0, 1.0]) + noise * torch.randn(n, JOINTS, generator=generator)
    parity = torch.tensor([-1.0, 1.0, -1.0, -1.0])
    rows = Rows(torch.randn(n, 4, generator=generator), parity, torch.ones(n, JOINTS), target, torch.arange(n) % UNITS)
    watched = torch.zeros(3, UNITS, dtype=torch.bool)
    watched[0, 0] = watched[1, 2] = watched[2, 5] = True
    return rows, SimpleNamespace(columns=columns, law_size=LAW, shared=SHARED, free_size=0, tiers=torch.full((LAW,), SURROUNDED)), watched


def dense(rows, linear):
    """The weighted columns (n joints, q) with odd features a joint each, right-hand sides, and the unit of each row."""
    s = rows.target.double().pow(2).mean(dim=0).sqrt()
    parts = []
    for j in range(JOINTS):
        A = torch.zeros(len(rows.x), SHARED + JOINTS * ODD, dtype=torch.float64)
        A[:, :SHARED] = linear.columns[:, j, :SHARED]
        A[:, SHARED + j * ODD:SHARED + (j + 1) * ODD] = linear.columns[:, j, SHARED:]
        parts.append((A / s[j], rows.target[:, j].double() / s[j], rows.unit))
    return (torch.cat(x) for x in zip(*parts, strict=True))


def ridge(A, z, h, law, arm):
    """argmin |A theta - z|^2 + sum lambda h theta^2 over all but the stated coefficients, of which 1e-3 theta^2 is said."""
    weight = arm * h
    weight[:LAW] = law * h[:LAW]
    weight[LAW:LAW + STATED] = 1e-3
    return torch.linalg.solve(A.T @ A + torch.diag(weight), A.T @ z)


def chosen_by_all(monkeypatch, law, arm):
    """Let all members choose these penalties of the law and of what the arm adds."""
    weights = [CLOSED] * (SURROUNDED + 1)
    weights[SURROUNDED], weights[ARM] = law, arm
    monkeypatch.setattr("nnhydro.fitting.network.linear_part.choice_of_each", lambda *asked: [tuple(weights)] * asked[-1])


@pytest.mark.parametrize(("law", "arm"), [(1e-3, 1e-3), (1.0, 1e-2)])
def test_members_solve_on_the_rows_that_they_train_on_with_a_penalty_for_each_tier(law, arm, monkeypatch):
    rows, linear, watched = problem()
    chosen_by_all(monkeypatch, law, arm)
    own, moved = linear_part(rows, linear, watched, STATED)
    A, z, unit = dense(rows, linear)
    h = (A**2).sum(dim=0)
    members = torch.stack([ridge(A[~seen[unit]], z[~seen[unit]], h, law, arm) for seen in watched])
    torch.testing.assert_close(own.shared, members[:, :SHARED], rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(own.odd, members[:, SHARED:].reshape(3, JOINTS, ODD).transpose(1, 2), rtol=1e-4, atol=1e-5)
    shown = ridge(A, z, h, law, arm)
    torch.testing.assert_close(moved.shared.mean(dim=0), shown[:SHARED], rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(moved.odd.mean(dim=0), shown[SHARED:].reshape(JOINTS, ODD).T, rtol=1e-4, atol=1e-5)


def test_what_is_stated_counts_where_rows_hardly_tell_the_coefficient(monkeypatch):
    rows, linear, watched = problem()
    chosen_by_all(monkeypatch, 1e-3, 1e-3)
    linear.columns[..., LAW] *= 2e-3  # what was asked for is now five hundred deviations away, and half of it is adopted
    own, _ = linear_part(rows, linear, watched, STATED)
    assert 1.0 < float(own.shared[0, LAW]) < 150.0


def test_members_differ_from_their_mean_alike_in_both():
    own, moved = linear_part(*problem(), STATED)
    for one, other in ((own.shared, moved.shared), (own.odd, moved.odd)):
        torch.testing.assert_close(one - one.mean(dim=0), other - other.mean(dim=0))
        assert float((one - one.mean(dim=0)).abs().max()) > 1e-4
        assert float((one.mean(dim=0) - other.mean(dim=0)).abs().max()) > 1e-6


def test_where_nothing_can_be_watched_all_members_are_the_fit_to_all():
    rows, linear, watched = problem()
    own, moved = linear_part(rows, linear, watched & False, STATED)
    A, z, _ = dense(rows, linear)
    want = ridge(A, z, (A**2).sum(dim=0), 1e-1, 1e-1)
    for part in (own, moved):
        torch.testing.assert_close(part.shared, want[:SHARED].expand(3, -1), rtol=1e-5, atol=1e-6)


def test_a_column_that_hardly_moves_has_no_coefficient_and_a_stated_one_keeps_what_was_stated():
    rows, linear, watched = problem()
    linear.columns[..., 0] = 0.0
    linear.columns[..., LAW] *= 1e-9
    own, _ = linear_part(rows, linear, watched, STATED)
    assert float(own.shared[:, 0].abs().max()) == 0.0
    assert float(own.shared[:, LAW].abs().max()) < 1e-3


def test_a_loud_joint_counts_no_more_than_a_quiet_one():
    rows, linear, watched = problem()
    plain, _ = linear_part(rows, linear, watched, 0)
    rows.target[:, 1] *= 100
    linear.columns[:, 1] *= 100
    louder, _ = linear_part(rows, linear, watched, 0)
    torch.testing.assert_close(louder.shared, plain.shared, rtol=1e-4, atol=1e-5)


def test_the_torque_of_the_linear_part_is_that_of_its_columns():
    part = LinearPart(torch.randn(3, SHARED).double(), torch.randn(3, ODD, JOINTS).double(), torch.zeros(3, 0, JOINTS).double())
    columns = torch.randn(7, JOINTS, SHARED + ODD).double()
    tau = part.of(columns)
    assert tau.shape == (7, 3, JOINTS)
    for e in range(3):
        for j in range(JOINTS):
            want = columns[:, j, :SHARED] @ part.shared[e] + columns[:, j, SHARED:] @ part.odd[e, :, j]
            torch.testing.assert_close(tau[:, e, j], want)


def test_free_functions_are_learned_where_the_mirror_does_not_hold_and_left_out_where_it_does():
    rows, linear, watched = problem(noise=0.05)
    generator = torch.Generator().manual_seed(3)
    free = torch.randn(len(rows.x), 1, 2, generator=generator).expand(-1, JOINTS, -1)
    wide = SimpleNamespace(columns=torch.cat([linear.columns, free], dim=2), law_size=LAW, shared=SHARED, free_size=2, tiers=linear.tiers)
    s = rows.target.double().pow(2).mean(dim=0).sqrt()
    assert with_free_functions(rows, wide, watched, STATED, s) is None
    assert with_free_functions(rows, linear, watched, STATED, s) is None, "there are none"
    rows.target.add_(free @ torch.tensor([2.0, -1.0]))
    assert with_free_functions(rows, wide, torch.zeros_like(watched), STATED, s) is None, "nobody watches"
    found = with_free_functions(rows, wide, watched, STATED, s)
    assert found is not None
    unseen, used = found
    torch.testing.assert_close(used.free.mean(dim=0), torch.tensor([[2.0, 2.0], [-1.0, -1.0]]).double(), rtol=0.0, atol=0.05)
    torch.testing.assert_close(unseen.free - unseen.free.mean(dim=0), used.free - used.free.mean(dim=0))
    torch.testing.assert_close(used.free_torque(wide.columns.double())[:, 0], free[:, 0].double() @ used.free[0])
