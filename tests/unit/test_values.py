"""Values of the findings with their covariance: sandwich, jackknife, tangents and spreads, against the same sums over plain rows."""

from types import SimpleNamespace

import numpy as np
import pytest
from races import SINGLE, K, P, candidate, fit, race, rows, tables
from scipy.stats import t as student

from nnhydro.diagnosis.race import columns_of, own_of
from nnhydro.diagnosis.shape_spread import spreads
from nnhydro.diagnosis.uncertainty import _tangents, _widened, fitted, likeness, own_values

PRIOR = np.array([4.0, 0.0, 50.0])


def shaped(value, column, name="shaped", span=(1.0, 4.0), own=()):
    """A candidate with one nonlinear parameter `v` at `value`."""
    return candidate(name, () if own else (column,), own, spans={"v": span}, effect=SimpleNamespace(v=(value,)))


def sandwich(made, columns, prior, theta=None):
    """Fit and covariance of the baseline's and the chosen columns over rows: bread, meat over blocks, jackknife over recordings."""
    r = rows(made)
    Z = r.Z[:, [*range(P), *(P + k for k in columns)]]
    theta = fit(Z, r.y, prior) if theta is None else theta
    q, blocks, units = Z.shape[1], int(r.block.max()) + 1, int(r.unit.max()) + 1
    precision = np.concatenate([np.broadcast_to(prior, P), np.zeros(q - P)])
    bread = np.linalg.inv(Z.T @ Z + np.diag(precision))
    left = r.y - Z @ theta
    s = np.stack([Z[r.block == b].T @ left[r.block == b] for b in range(blocks)])
    s = s - s.mean(axis=0)
    meat = s.T @ s * blocks / (blocks - q) + np.diag(precision)
    cov = bread @ meat @ bread
    unit_of = np.array([r.unit[r.block == b][0] for b in range(blocks)])
    moved = []
    for u in range(units):
        H = Z[r.unit == u].T @ Z[r.unit == u]
        moved.append(np.linalg.solve(np.linalg.inv(bread) - H, s[unit_of == u].sum(axis=0)))
    jackknife = (units - 1) / units * (np.array(moved) ** 2).sum(axis=0)
    wider = np.sqrt(np.maximum(1.0, jackknife / np.diag(cov))) * student.ppf(0.975, units - 1) / 1.96
    return theta, cov * np.outer(wider, wider)


@pytest.mark.parametrize(("chosen", "prior"), [((0,), 0.0), ((0, 4), 0.0), ((0, 4), PRIOR)])
def test_values_and_covariance_are_those_of_the_sandwich_widened_by_the_jackknife(chosen, prior):
    made = tables(1, {0: 0.3, 4: -0.2})
    found = race(made, prior=prior, chosen=chosen)
    theta, cov = sandwich(made, chosen, prior)
    told = fitted(found)
    np.testing.assert_allclose(told.theta, theta, rtol=1e-5)
    np.testing.assert_allclose(told.covariance, cov, rtol=1e-4, atol=1e-9)
    for place, k in enumerate(chosen):
        value, variance = told.of(SINGLE[k])
        assert value == pytest.approx([theta[P + place]], rel=1e-5)
        assert variance[0, 0] == pytest.approx(cov[P + place, P + place], rel=1e-4)


def test_values_stand_by_column_whatever_the_order_of_the_findings():
    made = tables(2, {0: 0.3, 4: -0.2})
    one, other = fitted(race(made, chosen=(0, 4))), fitted(race(made, chosen=(4, 0)))
    for k in (0, 4):
        np.testing.assert_allclose(one.of(SINGLE[k])[0], other.of(SINGLE[k])[0], rtol=1e-9)
        np.testing.assert_allclose(one.of(SINGLE[k])[1], other.of(SINGLE[k])[1], rtol=1e-9)


def test_leaving_a_recording_out_moves_the_fit_by_the_documented_step():
    """theta_(-u) - theta = -(A - H_u)^-1 s_u: the jackknife that widens is that of refits without each recording."""
    made = tables(3, {0: 0.3}, units=6)
    made[2][..., -1] += 4 * made[2][..., P]  # one recording with a law of its own
    r = rows(made)
    Z = r.Z[:, [0, 1, 2, P]]
    theta = fit(Z, r.y)
    steps = np.array([fit(Z[r.unit != u], r.y[r.unit != u]) for u in range(6)]) - theta
    s = np.stack([Z[r.unit == u].T @ (r.y - Z @ theta)[r.unit == u] for u in range(6)])
    H = np.stack([Z[r.unit == u].T @ Z[r.unit == u] for u in range(6)])
    tiny = 1e-9 * np.eye(4)
    wide = _widened(tiny, H, s, Z.T @ Z)
    factor = (student.ppf(0.975, 5) / 1.96) ** 2
    np.testing.assert_allclose(np.diag(wide), factor * 5 / 6 * (steps**2).sum(axis=0), rtol=1e-6)


def test_a_single_recording_widens_nothing_and_many_agreeing_ones_by_student_alone():
    cov = np.array([[2.0, 0.5], [0.5, 1.0]])
    assert _widened(cov, np.zeros((1, 2, 2)), np.ones((1, 2)), np.eye(2)) is cov
    for n in (2, 5, 40):
        wide = _widened(cov, np.zeros((n, 2, 2)), np.zeros((n, 2)), np.eye(2))
        np.testing.assert_allclose(wide, cov * (student.ppf(0.975, n - 1) / 1.96) ** 2, rtol=1e-6)


def test_intervals_of_a_planted_value_hold_it_nineteen_times_in_twenty():
    hits = []
    for seed in range(150):
        made = tables(100 + seed, {0: 0.3}, units=8, rows=(40, 60))
        value, cov = fitted(race(made, chosen=(0,))).of(SINGLE[0])
        hits.append(abs(value[0] - 0.3) <= 1.96 * np.sqrt(cov[0, 0]))
    assert 0.9 <= np.mean(hits) <= 0.995


def test_the_tangent_of_a_shape_is_the_difference_of_the_torques_at_its_neighbours():
    bank = tuple(shaped(v, k) for k, v in enumerate((1.0, 2.0, 4.0)))
    found = race(tables(4, {1: 0.5}), bank)
    ((direction, value),) = _tangents(found, bank[1], {1: 0.5})
    want = np.zeros(P + K + 1)
    want[P + 2], want[P] = 0.5 / 3, -0.5 / 3
    assert value == 2.0
    np.testing.assert_allclose(direction, want)
    ((at_end, _),) = _tangents(found, bank[2], {2: 0.5})
    want = np.zeros(P + K + 1)
    want[P + 2], want[P + 1] = 0.25, -0.25
    np.testing.assert_allclose(at_end, want)
    ((alone, _),) = _tangents(race(tables(4), bank[:1]), bank[0], {0: 0.5})
    assert (alone == 0).all()


def test_neighbours_of_a_shape_differ_in_that_parameter_alone_and_are_of_the_same_law():
    def of(v, w, k):
        return candidate("two", (k,), spans={"v": (1.0, 3.0), "w": (1.0, 3.0)}, effect=SimpleNamespace(v=(v,), w=(w,)))
    law = candidate("two", (4, 5), spans={"v": (1.0, 3.0), "w": (1.0, 3.0)}, effect=SimpleNamespace(v=(2.5,), w=(2.0,)))
    bank = (of(2.0, 2.0, 0), of(3.0, 2.0, 1), of(3.0, 5.0, 2), of(2.0, 1.0, 3), law)
    along_v, along_w = _tangents(race(tables(5), bank), bank[0], {0: 1.0})
    np.testing.assert_allclose(np.flatnonzero(along_v[0]), [P, P + 1])
    np.testing.assert_allclose(np.flatnonzero(along_w[0]), [P, P + 3])
    assert (along_v[1], along_w[1]) == (2.0, 2.0)


def test_a_shape_is_known_no_better_than_the_values_tried_lie_apart():
    bank = tuple(shaped(v, k, span=(v - 0.6, v + 0.6)) for k, v in enumerate((1.0, 9.0)))
    found = race(tables(6, {0: 2.0}), bank, chosen=(0,))
    assert spreads(found, bank[0])["v"] == pytest.approx(0.6 / np.sqrt(12), rel=1e-6), "the other value is out of the question"
    assert spreads(found, SINGLE[0]) == {}
    values, covariance = fitted(found).of(bank[0])
    assert values[1] == 1.0
    assert covariance[1, 1] >= 0.6**2 / 12


def test_a_shape_is_known_no_better_than_its_rivals_predict_worse():
    bank = tuple(shaped(v, k, span=(v, v)) for k, v in enumerate((1.0, 3.0)))
    made = tables(7, {0: 0.4})
    for table in made:  # the two shapes are nearly the same torque
        table[..., P + 1] = table[..., P] + 0.02 * table[..., P + 1]
    found = race(made, bank, chosen=(0,))
    behind = max(found.total([bank[1]], [bank[0]]) - found.total(), 0.0)
    assert spreads(found, bank[0])["v"] == pytest.approx(np.sqrt(4 * np.exp(-behind) / (1 + np.exp(-behind))), rel=1e-6)


def test_a_shape_that_predicts_no_worse_than_the_chosen_counts_as_much():
    bank = tuple(shaped(v, k, span=(v, v)) for k, v in enumerate((1.0, 3.0)))
    made = tables(7, {0: 0.4})
    for table in made:
        table[..., P + 1] = table[..., P] + 0.02 * table[..., P + 1]
    found = race(made, bank, chosen=(1,))
    assert found.total([bank[0]], [bank[1]]) < found.total()
    assert spreads(found, bank[1])["v"] == pytest.approx(np.sqrt(4 / (1 + 1)), rel=1e-6)


def phased(seed=8, units=9):
    """Tables in which column 2 has an amplitude of about 1.5 of each recording's own sign and size."""
    rng, made = np.random.default_rng(seed), tables(seed, {0: 0.3}, units=units)
    size = 1.5 * rng.choice([-1.0, 1.0], units) * (1 + 0.1 * rng.standard_normal(units))
    for table, a in zip(made, size, strict=True):
        table[..., -1] += a * table[..., P + 2]
    return made, size


def test_an_amplitude_of_each_recordings_own_is_told_as_its_root_mean_square_with_its_scatter():
    made, size = phased()
    own = candidate("own", (), (2,), effect=SimpleNamespace())
    found = race(made, (SINGLE[0], own), chosen=(0, 1))
    values, covariance = fitted(found).of(own)
    assert values == pytest.approx([np.sqrt((size**2).mean())], rel=0.02)
    squares = np.array([own_values(found, own, u)[0] ** 2 for u in range(len(made))])
    r = rows(made)
    noise = np.array([1 / (r.Z[r.unit == u][:, P + 2] ** 2).sum() for u in range(len(made))])
    amplitude = np.sqrt((squares - noise).mean())
    assert values[0] == pytest.approx(amplitude, rel=1e-6)
    error = (squares - noise).std(ddof=1) / np.sqrt(len(made)) / (2 * amplitude)
    assert covariance[0, 0] == pytest.approx(error**2, rel=1e-3)


def test_a_value_that_stands_beside_others_of_each_recordings_own_pays_for_their_direction():
    made, _ = phased()
    for table in made:
        table[..., P] += 0.5 * table[..., P + 2]
    own = candidate("own", (), (2,), effect=SimpleNamespace())
    found = race(made, (SINGLE[0], own), chosen=(0, 1))
    theta = np.array([*found.bench.scored(np.array([0]), np.array([2])).theta, 0.0])  # the own values are told apart
    told = fitted(found)
    np.testing.assert_allclose(told.theta, theta)
    np.testing.assert_allclose(told.covariance, sandwich(made, (0, 2), 0.0, theta)[1], rtol=1e-4)


def test_the_value_of_one_recording_is_that_of_a_fit_to_its_rows():
    made, size = phased()
    own = candidate("own", (), (2,), effect=SimpleNamespace())
    found = race(made, (SINGLE[0], own), chosen=(0, 1))
    theta = found.bench.left_out(found.bench.index(columns_of(found.chosen)), P + own_of(found.chosen))[0]
    r = rows(made)
    for u in range(len(made)):
        here = r.unit == u
        left = r.y[here] - r.Z[here][:, [0, 1, 2, P]] @ theta
        x = r.Z[here][:, P + 2]
        assert own_values(found, own, u) == pytest.approx([x @ left / (x @ x)], rel=1e-6)
        assert own_values(found, own, u) == pytest.approx([size[u]], abs=0.3)


def test_what_noise_adds_to_an_amplitude_is_taken_off_and_recordings_without_the_column_say_nothing():
    own = candidate("own", (), (2,), effect=SimpleNamespace())
    none = [fitted(race(tables(seed, units=40), (own,), chosen=(0,))).of(own)[0][0] for seed in range(6)]
    assert np.median(none) < 0.05, "noise alone gives a root mean square of a tenth"
    made, size = phased()
    for table, share in zip(made[:3], (0.0, 1e-4, 3e-4), strict=True):  # less than a millionth of the energy
        table[..., P + 2] *= share
    values, _ = fitted(race(made, (SINGLE[0], own), chosen=(0, 1))).of(own)
    assert values == pytest.approx([np.sqrt((size[3:] ** 2).mean())], rel=0.03)


def test_a_column_that_is_hardly_seen_does_not_drown_the_amplitude():
    """Shedding of the inner link moves the arm little: what noise makes of its amplitude is larger than all the others'."""
    own = candidate("own", (), (2, 3), effect=SimpleNamespace())
    made, size = phased()
    for table in made:
        table[..., P + 3] *= 1e-2
    values, covariance = fitted(race(made, (SINGLE[0], own), chosen=(0, 1))).of(own)
    assert values[0] == pytest.approx(np.sqrt(2 * (size**2).mean()), rel=0.05)  # as if both columns had the size of the one that is seen
    assert 0 < covariance[0, 0] < (0.2 * values[0]) ** 2


def test_recordings_that_hardly_see_an_amplitude_do_not_drown_it():
    own = candidate("own", (), (2,), effect=SimpleNamespace())
    made, size = phased(units=20)
    for table, a in zip(made[10:], size[10:], strict=True):
        table[..., -1] -= a * (1 - 5e-3) * table[..., P + 2]
        table[..., P + 2] *= 5e-3  # a fourteenth of the speed
    values, covariance = fitted(race(made, (SINGLE[0], own), chosen=(0, 1))).of(own)
    assert values[0] == pytest.approx(np.sqrt((size[:10] ** 2).mean()), rel=0.05)
    assert np.sqrt(covariance[0, 0]) < 0.1 * values[0]


def test_where_nothing_is_left_of_an_amplitude_its_interval_is_as_wide_as_what_could_have_been_seen():
    own = candidate("own", (), (2,), effect=SimpleNamespace())
    told = [fitted(race(tables(seed, units=40), (own,), chosen=(0,))).of(own) for seed in range(6)]
    assert any(values[0] <= 1e-6 for values, _ in told)
    assert all(0.01 < np.sqrt(covariance[0, 0]) < 0.2 for values, covariance in told if values[0] <= 1e-6)


def test_a_shape_with_values_of_each_recordings_own_has_the_width_of_the_parabola_through_the_scores():
    made, _ = phased()
    for table in made:
        table[..., P + 3] = 0.998 * table[..., P + 2] + 0.07 * table[..., P + 3]
    bank = tuple(shaped(v, None, "own", (v, v), own=(k,)) for k, v in ((2, 1.0), (3, 3.0)))
    found = race(made, bank, chosen=(0,))
    behind = found.total([bank[1]], [bank[0]]) - found.total()
    assert 0 < behind < 50
    assert spreads(found, bank[0])["v"] == pytest.approx(np.sqrt(6 * 4 / (2 * behind)), rel=1e-6)  # sigma^2 = 6 dx^2 / (2 score)
    values, covariance = fitted(found).of(bank[0])
    assert values[1:] == pytest.approx([1.0])
    assert covariance[1, 1] == pytest.approx(6 * 4 / (2 * behind), rel=1e-6)
    assert covariance[0, 1] == 0.0


@pytest.mark.parametrize(("apart", "told"), [(0.095, True), (0.11, False)])
def test_a_value_fifty_behind_tells_nothing_of_the_parabola(apart, told):
    made, _ = phased()
    for table in made:
        table[..., P + 3] = np.sqrt(1 - apart**2) * table[..., P + 2] + apart * table[..., P + 3]
    bank = tuple(shaped(v, None, "own", (v, v), own=(k,)) for k, v in ((2, 1.0), (3, 3.0)))
    found = race(made, bank, chosen=(0,))
    behind = found.total([bank[1]], [bank[0]]) - found.total()
    assert 45 < behind < 70
    assert (behind < 50) == told
    assert (spreads(found, bank[0])["v"] > 0) == told


@pytest.mark.parametrize(("apart", "decides"), [(1.0, True), (0.01, False)])
def test_a_shape_beside_own_values_is_known_no_better_than_recordings_agree_on_it(apart, decides):
    """Recordings whose energies are parabolas with minima of their own: each is left out, and the rest have a minimum again."""
    minimum, depth = apart * np.array([0.1, -0.2, 0.3, 0.0, 0.5]), np.array([3.0, 1.0, 2.0, 4.0, 0.5])
    bank = [shaped(v, None, "own", (0.9, 1.1), own=(k,)) for k, v in enumerate((1.0, 0.9, 1.1))]
    energy = {id(c): np.stack([depth * (c.instance.effect.v[0] - 1 - minimum) ** 2, 7 + 0 * depth], axis=1) for c in bank}
    scored = lambda extra=bank[:1], without=(): SimpleNamespace(energy=energy[id(extra[0])])  # noqa: E731
    total = lambda extra=bank[:1], without=(): 0.0 if extra[0] is bank[0] else 40.0  # noqa: E731
    found = SimpleNamespace(bank=SimpleNamespace(candidates=tuple(bank)), scored=scored, total=total)
    best = np.array([np.average(np.delete(minimum, u), weights=np.delete(depth, u)) for u in range(5)])
    whole = np.average(minimum, weights=depth)
    variance = 4 / 5 * ((best - whole) ** 2).sum() * (student.ppf(0.975, 4) / 1.96) ** 2 + whole**2
    parabola = 6 * 0.1**2 / (2 * 40.0)
    assert (variance > parabola) == decides
    assert spreads(found, bank[0])["v"] ** 2 == pytest.approx(max(parabola, variance) + 0.1**2 / 12, rel=1e-6)
    one = SimpleNamespace(bank=SimpleNamespace(candidates=tuple(bank[:2])), scored=scored, total=total)
    assert spreads(one, bank[0])["v"] ** 2 == pytest.approx(parabola + 0.1**2 / 12, rel=1e-6)  # one value beside it is no parabola


def test_each_of_two_shapes_beside_own_values_has_the_doubt_of_its_own_spacing():
    made, _ = phased()
    own = candidate("own", (), (2,), spans={"v": (1.0, 4.0), "w": (2.0, 8.0)}, effect=SimpleNamespace(v=(2.0,), w=(5.0,)))
    values, covariance = fitted(race(made, (SINGLE[0], own), chosen=(0, 1))).of(own)
    assert values[1:] == pytest.approx([2.0, 5.0])
    assert np.diag(covariance)[1:] == pytest.approx([1.5**2 / 12, 3.0**2 / 12])


def test_likeness_is_the_cosine_of_the_fitted_torques_off_what_the_rest_explains():
    made = tables(9, {0: 0.5, 4: 0.3})
    for table in made:
        table[..., P + 1] = table[..., P] + 0.5 * table[..., P + 1] + table[..., 0] - table[..., P + 4]
    found = race(made, chosen=(0, 4))
    r = rows(made)
    Z = r.Z[:, [0, 1, 2, P + 4]]
    one, other = (x - Z @ np.linalg.lstsq(Z, x, rcond=None)[0] for x in (r.Z[:, P], r.Z[:, P + 1]))
    cosine = one @ other / np.sqrt((one @ one) * (other @ other))
    assert likeness(found, SINGLE[0], SINGLE[1]) == pytest.approx(cosine, rel=1e-5)
    assert likeness(found, SINGLE[0], SINGLE[0]) == pytest.approx(1.0)
    assert likeness(found, SINGLE[0], candidate("own", (), (2,))) == 0.0


def test_what_is_not_known_of_a_shape_adds_to_what_its_tangent_says(monkeypatch):
    bank = tuple(shaped(v, k) for k, v in enumerate((1.0, 2.0, 4.0)))
    found = race(tables(4, {1: 0.5}), bank, chosen=(1,))
    spread = spreads(found, bank[1])["v"]
    told = fitted(found).of(bank[1])[1]
    monkeypatch.setattr("nnhydro.diagnosis.uncertainty.spreads", lambda *given: {"v": 0.0})
    np.testing.assert_allclose(told - fitted(found).of(bank[1])[1], np.diag([0.0, spread**2]), atol=1e-12)


def test_a_value_that_nothing_tells_has_a_wide_interval_and_no_overflow():
    wide = _widened(np.diag([1e-310, 1.0]), np.zeros((3, 2, 2)), np.full((3, 2), 1e6), np.eye(2))
    assert np.isfinite(wide).all()
    assert wide[1, 1] > 1e5
