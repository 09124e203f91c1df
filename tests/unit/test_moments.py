"""Moments, sectors, suggestions and remainders, each against brute force on small numbers."""

from types import SimpleNamespace

import numpy as np
import pytest
from races import NOISE, SINGLE, P, Plain, blocks_of, candidate, fit, instance, race, raced, rows, tables
from rigs import arm

from nnhydro.diagnosis.experiment import Proposal
from nnhydro.diagnosis.feasible import draw
from nnhydro.diagnosis.lines import Line
from nnhydro.diagnosis.locks import TRIED
from nnhydro.diagnosis.moments import Rows, _scan, left_by, moment, projected, sector
from nnhydro.diagnosis.nearest import Near, _why, nearest
from nnhydro.diagnosis.noise import flexible_noise, quiet_noise
from nnhydro.diagnosis.remainder import Remainder, mismatch_p
from nnhydro.diagnosis.rig import Limits, Rig
from nnhydro.diagnosis.suggestion import Feature, Suggested, Suggestion, _Sums, _terms, features
from nnhydro.diagnosis.unknown import Learned
from nnhydro.errors import ConfigError


def recordings(acts, count=4, n=40, seed=1, noise=0.3):
    """Rows of a column with the value 1.5 where acts(place) says so; places run from -1 to 1."""
    rng, made = np.random.default_rng(seed), []
    for k in range(count):
        place = -1 + 2 * (k + np.arange(n) / n) / count
        x = rng.standard_normal((n, 2, 1))
        r = 1.5 * x[..., 0] * acts(place)[:, None] + noise * rng.standard_normal((n, 2))
        state = {"q1_rad": rng.uniform(-1, 1, n), "q2_rad": rng.uniform(-1, 1, n)}
        piece = SimpleNamespace(recording=f"run{k}", place=place, t=0.1 * np.arange(n), state=state)
        made.append(Rows(piece, x / noise, r / noise))
    return made


@pytest.mark.parametrize("begins", [True, False])
def test_the_moment_is_where_the_likelihood_of_rows_turns(begins):
    at = -0.2  # in the middle of run1, which lasts from -0.5 to 0
    made = recordings(lambda place: (place >= at) == begins)
    gain, place, name, t = moment(made, np.array([1.5]), ["run1", "run2"], begins)
    assert place == pytest.approx(at, abs=0.03)
    assert name == "run1"
    assert t == pytest.approx(4.0 * (at + 0.5) / 0.5, abs=0.25)
    change = [1.5 * one.x[..., 0] for one in made[1:3]]
    e = np.concatenate([((one.r**2 - (one.r - c) ** 2) / 2).sum(axis=1) for one, c in zip(made[1:3], change, strict=True)])
    after = np.array([e[k:].sum() if begins else e[:k].sum() for k in range(len(e) + 1)])
    assert gain == pytest.approx(after.max() - after[[0, 40, 80]].max())


@pytest.mark.parametrize(("at", "name"), [(-0.2, "run1"), (0.3, "run2")])
def test_the_moment_may_lie_in_either_of_the_two_recordings(at, name):
    _, place, told, _ = moment(recordings(lambda place: place >= at), np.array([1.5]), ["run1", "run2"], True)
    assert told == name
    assert place == pytest.approx(at, abs=0.03)


def test_a_moment_between_two_recordings_or_near_the_end_of_one_is_none_within():
    for at in (0.0, 0.02, -0.02):
        assert moment(recordings(lambda place, at=at: place >= at), np.array([1.5]), ["run1", "run2"], True) is None
    assert moment(recordings(lambda place: place >= 0.0), np.array([1.5]), ["elsewhere"], True) is None
    hidden = recordings(lambda place: place >= -0.2)
    for one in hidden:
        one.piece.place = None
    assert moment(hidden, np.array([1.5]), ["run1"], True) is None


def test_the_best_run_of_parts_is_that_of_all_runs_of_five_or_more():
    rng = np.random.default_rng(2)
    X = rng.standard_normal((20, 30, 2))
    y = np.where((np.arange(20) >= 6) & (np.arange(20) < 13), 1.0, 0.0)[:, None] * X[..., 0] + 0.1 * rng.standard_normal((20, 30))
    H, g = np.einsum("prk,prl->pkl", X, X), np.einsum("prk,pr->pk", X, y)
    gain, over, a, b = _scan(H, g)
    gains = {(i, j): 0.5 * g[i:j].sum(0) @ np.linalg.solve(H[i:j].sum(0), g[i:j].sum(0)) for i in range(20) for j in range(i + 5, 21)}
    assert (a, b) == max(gains, key=gains.get) == (6, 13)
    assert gain == pytest.approx(gains[6, 13], rel=1e-4)
    assert over == pytest.approx(gains[6, 13] - gains[0, 20], rel=1e-4)


@pytest.mark.parametrize(("low", "high"), [(-0.2, 0.5), (None, 0.1), (0.3, None)])
def test_a_sector_is_where_the_joint_was_when_the_effect_acted(low, high):
    made = recordings(lambda place: np.zeros(len(place)), count=8, n=120)
    for one in made:
        q = one.piece.state["q2_rad"]
        inside = (q >= (-9 if low is None else low)) & (q < (9 if high is None else high))
        one.r[:] += 1.5 * one.x[..., 0] * inside[:, None]
    gain, over, found = sector(made, 2, np.array([0]))
    assert found.joint == 2
    for told, want in ((found.low, low), (found.high, high)):
        assert (told is None) == (want is None)
        assert told is None or told == pytest.approx(want, abs=0.06)
    x, r = np.concatenate([one.x[..., 0] for one in made]).ravel(), np.concatenate([one.r for one in made]).ravel()
    everywhere = 0.5 * (x @ r) ** 2 / (x @ x)
    assert gain - over == pytest.approx(everywhere, rel=1e-3)
    assert over > 100
    assert sector(made, 1, np.array([0]))[0] < gain


def test_a_joint_that_hardly_moved_has_no_sectors():
    made = recordings(lambda place: place > 0)
    for one in made:
        one.piece.state["q1_rad"] = np.round(one.piece.state["q1_rad"], 0)
    assert sector(made, 1, np.array([0])) is None


@pytest.mark.parametrize(("unit", "told"), [
    ((0, 0, 0), "N m"), ((1, 0, 0), "N m/rad"), ((1, 0, -1), "N m s/rad"), ((2, 0, -2), "N m s^2/rad^2"), ((0, 1, -1), "N m s/m"),
    ((1, 1, -1), "N m s/(rad m)"), ((-1, 0, 0), "N m rad"),
])
def test_the_unit_of_a_coefficient_makes_a_torque_of_its_feature(unit, told):
    assert Feature("f", unit, frozenset(), "k").coefficient_unit == told


def test_a_product_has_the_units_and_signals_of_both_and_a_square_its_sign():
    a, b = Feature("q1", (1, 0, 0), frozenset({"q"}), "angle 1"), Feature("u0", (0, 1, -1), frozenset({"u"}), "carriage")
    both = a.times(b)
    assert (both.name, both.unit, both.signals, both.kind) == ("q1 · u0", (1, 1, -1), {"q", "u"}, "product")
    assert (a.times(a).name, a.times(a).unit) == ("q1²", (2, 0, 0))


def segment(links=1, rows_=9):
    rng = np.random.default_rng(1)
    x = rng.uniform(-2, 2, (3, rows_, links))
    return type("Stretch", (), {"__len__": lambda self: rows_, "q": x[0], "qd": x[1], "qdd": x[2], "u0": rng.uniform(0.5, 1, rows_),
                                "t": 5.0 + 0.1 * np.arange(rows_), "n_links": links})()


def test_features_are_simple_functions_of_the_state_and_products_of_two_kinds():
    s = segment()
    named, F = features(s, 0.4, (), True)
    q, qd, qdd, u, t = s.q[:, 0], s.qd[:, 0], s.qdd[:, 0], s.u0, s.t - 5.0
    simple = {"1": 1 + 0 * t, "q1": q, "sin q1": np.sin(q), "cos q1": np.cos(q), "dq1": qd, "|dq1| dq1": np.abs(qd) * qd,
              "sign(dq1)": np.tanh(qd / 0.02), "ddq1": qdd, "u0": u, "|u0| u0": np.abs(u) * u, "t": t, "place": 0.4 + 0 * t}
    values = dict(zip([f.name for f in named], F.T, strict=True))
    for name, x in simple.items():
        np.testing.assert_allclose(values[name], x, err_msg=name)
    for name, x in {"q1²": q**2, "q1 · dq1": q * qd, "t²": t**2, "place²": 0.16 + 0 * t, "ddq1 · u0": qdd * u}.items():
        np.testing.assert_allclose(values[name], x, err_msg=name)
    assert not {"q1 · sin q1", "dq1²", "1²", "1 · q1", "u0²", "dq1 · |dq1| dq1"} & set(values), "of one kind, or known already"
    units = {f.name: f.unit for f in named}
    assert (units["|dq1| dq1"], units["u0"], units["|u0| u0"], units["t"], units["ddq1"]) == ((2, 0, -2), (0, 1, -1), (0, 2, -2), (0, 0, 1),
                                                                                              (1, 0, -2))


def test_only_features_of_the_signals_that_a_learner_needed_are_tried():
    named, F = features(segment(2), 0.0, ("dq2_rad_s over the last 0.6 s",), False)
    assert F.shape[1] == len(named)
    assert all("dq2_rad_s" in f.signals for f in named if f.name != "1")
    assert {"1", "dq2", "q1 · dq2"} <= {f.name for f in named}
    assert "u0" not in {f.name for f in features(segment(2), 0.0, (), False)[0]}


def sums(seed=1, units=6, m=2, K=4, n=50, prior=(3.0, 0.0)):
    """Random rows [nuisance, features, torque] with the second feature in the torque, and their sums; the joint is half of the rows."""
    rng = np.random.default_rng(seed)
    Z = rng.standard_normal((units, n, m + K))
    y = Z[..., 0] + 2.0 * Z[..., m + 1] + 0.5 * rng.standard_normal((units, n))
    full = np.concatenate([Z, y[..., None]], axis=2)
    every = np.einsum("unp,unq->upq", full, full)
    alone = np.einsum("unp,unq->upq", full[:, ::2], full[:, ::2])
    return full, _Sums(every, alone, np.array(prior), [Feature(f"f{k}", (0, 0, 0), frozenset(), "k") for k in range(K)])


def nuisance(full, units, m=2, prior=(3.0, 0.0)):
    A = full[units].reshape(-1, full.shape[2])
    stacked = np.vstack([A[:, :m], np.diag(np.sqrt(prior))])
    return A, lambda x: np.linalg.lstsq(stacked, np.concatenate([x, np.zeros(m)]), rcond=None)[0]


def test_sums_off_the_nuisance_are_those_of_projected_rows_with_its_prior():
    full, told = sums()
    units = np.arange(6) != 2
    A, refit = nuisance(full, units)
    G, g, B = told.reduced(units)
    left = np.stack([A[:, k] - A[:, :2] @ refit(A[:, k]) for k in range(2, 7)], axis=1)
    kept = np.stack([refit(A[:, k]) for k in range(2, 7)], axis=1)
    want = left.T @ A[:, 2:]
    np.testing.assert_allclose(G, want[:-1, :-1], rtol=1e-6, atol=1e-5)
    np.testing.assert_allclose(g, want[:-1, -1], rtol=1e-6, atol=1e-5)
    np.testing.assert_allclose(B, kept, rtol=1e-6, atol=1e-7)


def test_squared_errors_are_those_of_the_joints_rows_with_the_nuisance_of_the_fitted_units():
    full, told = sums()
    fitted, out = np.arange(6) < 4, np.arange(6) >= 4
    c = np.array([0.0, 1.7, 0.0, 0.3])
    A, refit = nuisance(full, fitted)
    theta = refit(A[:, -1] - A[:, 2:6] @ c)
    for place, u in enumerate(np.flatnonzero(out)):
        R = full[u, ::2]
        want = ((R[:, -1] - R[:, 2:6] @ c - R[:, :2] @ theta) ** 2).sum()
        assert told.squares(c, fitted, out)[place] == pytest.approx(want, rel=1e-6)


def test_terms_come_in_the_order_in_which_they_explain_most_and_dead_features_not_at_all():
    full, told = sums()
    every = np.ones(6, dtype=bool)
    path = told.path(every, 3)
    assert [np.count_nonzero(c) for c in path] == [1, 2, 3]
    assert np.flatnonzero(path[0]).tolist() == [1]
    assert path[0][1] == pytest.approx(2.0, abs=0.1)
    np.testing.assert_allclose(told.on(np.flatnonzero(path[2]), every), path[2], rtol=1e-6)
    full[..., 3] = full[..., 0] * 1.0  # the feature is the nuisance
    dead = _Sums(np.einsum("unp,unq->upq", full, full), told.joint, told.prior * 0, told.names)
    assert all(c[1] == 0 for c in dead.path(every, 2))


@pytest.mark.parametrize(("apart", "dead"), [(0.005, True), (0.02, False)])
def test_a_feature_is_dead_where_the_nuisance_leaves_less_than_a_ten_thousandth_of_its_energy(apart, dead):
    full, told = sums(prior=(0.0, 0.0))
    full[..., 3] = full[..., 0] + apart * full[..., 3]
    full[..., -1] += 5.0 / apart * (full[..., 3] - full[..., 0])  # what is left of it is in the torque
    near = _Sums(np.einsum("unp,unq->upq", full, full), told.joint, told.prior, told.names)
    assert all((c[1] == 0) == dead for c in near.path(np.ones(6, dtype=bool), 2))


def test_a_suggested_terms_interval_is_the_jackknifes_over_recordings():
    _, told = sums(units=8)
    (one,) = _terms(told, 0)
    assert one.feature.name == "f1"
    fits = []
    for out in (None, *range(8)):
        units = np.arange(8) != (-1 if out is None else out)
        G, g, _ = told.reduced(units)
        fits.append(g[1] / G[1, 1])
    from scipy.stats import t as student

    half = student.ppf(0.975, 7) * np.sqrt(7 / 8 * ((np.array(fits[1:]) - fits[0]) ** 2).sum())
    assert one.value == pytest.approx(fits[0])
    assert one.ci95 == pytest.approx((fits[0] - half, fits[0] + half))
    assert one.ci95[0] < 2.0 < one.ci95[1]
    two = _terms(told, 1)
    assert two[0].feature.name == "f1", "the largest torque first"


def test_a_formula_is_told_with_signs_units_and_shares():
    terms = (Suggested(Feature("q1", (1, 0, 0), frozenset(), "k"), 2.0, (1.0, 3.0)),
             Suggested(Feature("1", (0, 0, 0), frozenset(), "k"), -0.5, (-1.0, 0.0)))
    made = Suggestion(2, terms, 0.61, 0.7)
    assert made.formula() == "2 N m/rad · q1 - 0.5 N m"
    assert "joint 2 goes like 2 N m/rad · q1 - 0.5 N m, which predicts 61 %" in made.sentence()
    assert "(a learner without physics: 70 %)" in made.sentence()
    assert made.document()["terms"][1] == {"term": "1", "value": -0.5, "unit": "N m", "ci95": [-1.0, 0.0]}


def learned_(r2=0.5, p=0.001, joint=1, on=("q1_rad",)):
    return Learned(joint, r2, p, on)


@pytest.mark.parametrize(("found", "learners", "lines", "p"), [
    (0.5, (), (), 0.5), (0.5, (learned_(0.3, 0.002),), (), 0.002), (0.5, (learned_(0.2, 0.002),), (), 0.5),
    (0.5, (learned_(0.3, 0.02),), (), 0.5), (0.5, (), (0.01,), 0.04), (0.001, (learned_(0.3, 0.002),), (0.01,), 0.001),
    (0.5, (learned_(0.3, 0.002), learned_(-0.1, 0.9, 2)), (), 0.004), (0.5, (learned_(0.3, 0.002), learned_(0.4, 0.001, 2)), (), 0.002),
])
def test_a_mismatch_is_what_search_lines_and_a_clear_learner_say_each_paid_for(found, learners, lines, p):
    rest = Remainder(True, 0.1, learners, tuple(Line(1, x, 5.0, 0.1, 0.5) for x in lines))
    assert mismatch_p(found, rest) == pytest.approx(p)


def test_the_remainder_tells_what_it_depends_on_and_how_much_can_be_predicted():
    told = Remainder(True, 0.1, (learned_(0.51234), learned_(-0.2, 0.9, 2, ("t",))), (Line(2, 1e-4, 5.0, 0.1, 0.5),)).document()
    assert told["depends_on"] == ["frequency", "q1_rad"]
    assert told["predictable"] == [0.512, 0.0]
    assert (told["detected"], told["share"], told["nearest"], told["suggestions"]) == (True, 0.1, [], [])
    assert "5.00 Hz" in told["lines"][0]


def test_the_nearest_cards_are_the_two_that_gain_most_at_the_joint_with_what_keeps_them_out():
    made = tables(7, {0: 0.25, 1: 0.2, 2: 0.15, 4: 0.1})
    bank = tuple(candidate(f"effect_{k}", (k,), joint=j) for k, j in enumerate((1, 2, 1, 0, 0, 2)))
    found = race(made, bank)
    told = nearest(found, [1], 0)
    assert [(one.effect, one.joint) for one in told] == [("effect_0", 1), ("effect_2", 1)]
    assert told[0].gain > told[1].gain > 0
    assert {one.effect for one in nearest(found, [1, 2], 0)} >= {"effect_0", "effect_1", "effect_2"}
    assert told[0].sentence().startswith("effect_0 at joint 1: ")
    assert Near("a", 0, 1.234, "why").document() == {"effect": "a", "joint": None, "gain": 1.23, "why": "why"}
    assert Near("a", 0, 1.234, "why").sentence() == "a: why"


def test_the_first_lock_that_stays_shut_is_what_keeps_a_card_out():
    found = race(tables(8, {0: 0.5}))
    assert _why(found, SINGLE[0], 50.0, 0.02).startswith("what it explains may be chance (p = 0.02")
    assert _why(found, SINGLE[3], 50.0, 0.005).startswith("it does not predict left-out recordings better")
    assert _why(found, SINGLE[0], 50.0, 0.005).startswith("it was taken back")
    found.first_gain = 2600.0
    assert _why(found, SINGLE[0], 50.0, 0.005).startswith("it adds too little beside what was found")
    loud = race(tables(13, {2: 0.25}, units=8, noise=np.array([3.0, 3.0]), rows=(900, 1000)), noise=np.array([3.0, 3.0]))
    assert _why(loud, SINGLE[2], 50.0, 0.005).startswith("it explains only 0.")
    assert not _why(found, SINGLE[0], 74.0, 0.02).startswith("what it explains may be chance"), "lock 1 opens to what is gained, too"
    own = candidate("own", (), (2,))
    assert _why(race(tables(8), (own,)), own, 10.0, 0.001).startswith("what it explains may be chance (p = 1 ")
    paid = 6 * np.log(3 * TRIED / 0.01)  # a hundredth of three tests of all hypotheses each
    assert _why(race(tables(8), (own,)), own, paid - 0.1, 0.001).startswith("what it explains may be chance (p = 0.01 ")
    assert not _why(race(tables(8), (own,)), own, paid + 0.1, 0.001).startswith("what it explains may be chance")


def test_the_quiet_noise_is_the_lower_quartile_over_recordings():
    made = tables(9, units=8)
    for table in made[4:]:
        table[..., -1] += 5 * np.random.default_rng(1).standard_normal(table[..., -1].shape)
    blocks, prior = blocks_of(made), np.zeros(P)
    r = rows(made, np.ones(2))
    n = np.array([len(table) for table in made])
    for j in range(2):
        Z, y, unit = r.Z[r.joint == j], r.y[r.joint == j], r.unit[r.joint == j]
        left = (y - Z @ fit(Z, y)) ** 2
        each = np.array([left[unit == u].sum() for u in range(8)]) / n
        want = np.sqrt(np.quantile(each, 0.25) * n.sum() / (n.sum() - Z.shape[1] / 2))
        assert quiet_noise(blocks, prior)[j] == pytest.approx(want, rel=1e-4)
    assert (quiet_noise(blocks, prior) < 0.6 * flexible_noise(blocks, prior)).all()
    even = blocks_of(tables(9, units=8))
    assert quiet_noise(even, prior) == pytest.approx(NOISE, rel=0.2)


SHOWN = Rig(np.array([[-1.0, 2.0], [0.5, 1.0]]), np.array([1.5, 0.8]), np.array([6.0, 4.0]), 0.5, np.array([9.0, 3.0]), 10.0)


def test_what_the_user_states_of_a_rig_takes_the_place_of_what_was_shown():
    told = SHOWN.with_limits(Limits.model_validate({"q_rad": [[-2, 2], [-1, 1]], "dq_rad_s": 3.0, "ddq_rad_s2": [8.0, 5.0], "u0_m_s": 0.0,
                                                    "tau_Nm": [20.0, 6.0], "seconds": 100.0}))
    assert told.q.tolist() == [[-2, 2], [-1, 1]]
    assert told.rate.tolist() == [3.0, 3.0]
    assert (told.acceleration.tolist(), told.tau.tolist()) == ([8.0, 5.0], [20.0, 6.0])
    assert (told.u0, told.seconds, told.stated) == (0.0, 60.0, True)
    part = SHOWN.with_limits(Limits.model_validate({"u0_m_s": 0.9}))
    assert (part.u0, part.seconds, part.stated) == (0.9, 10.0, True)
    assert part.q is SHOWN.q
    assert part.rate is SHOWN.rate
    assert SHOWN.with_limits(None) is SHOWN
    assert Limits.model_validate({"u0_m_s": 100, "seconds": 3600}).u0_m_s == 100
    for given in ({"u0_m_s": 100.5}, {"u0_m_s": -0.1}, {"seconds": 3600.5}, {"seconds": 0}):
        with pytest.raises(ValueError, match=next(iter(given))):
            Limits.model_validate(given)
    for broken, said in (({"q_rad": [[-1, 1]]}, "1 ranges for an arm of 2"), ({"q_rad": [[1, 1], [0, 1]]}, "the lower angle first"),
                         ({"dq_rad_s": [1.0, 2.0, 3.0]}, "dq_rad_s")):
        with pytest.raises(ConfigError, match=said):
            SHOWN.with_limits(Limits.model_validate(broken))


def test_where_the_arm_rests_about_the_moment_its_middle_is_told():
    made = recordings(lambda place: place >= -0.25, n=200, noise=0.1)
    for one in made:
        still = (one.piece.place > -0.4) & (one.piece.place < -0.1)  # two fifths of run1
        one.x[still] = 0.0
    _, place, _, _ = moment(made, np.array([1.5]), ["run1", "run2"], True)
    assert place == pytest.approx(-0.25, abs=0.02)


def test_a_motion_is_written_as_columns_that_are_read_again(tmp_path):
    motion = draw(SHOWN, arm(2), 50.0, 1, np.random.default_rng(1))[0]
    made = Proposal(None, motion, 3, 1.0, 0.9, 0.1, arm(2))
    made.write(tmp_path / "next.csv")
    header, *lines = (tmp_path / "next.csv").read_text().splitlines()
    columns = motion.columns(arm(2))
    assert header.split(",") == list(columns)
    np.testing.assert_allclose(np.array([[float(x) for x in line.split(",")] for line in lines]), np.column_stack(list(columns.values())),
                               rtol=1e-8, atol=1e-12)
    assert (tmp_path / "next.csv").read_text().endswith("\n")


def test_the_lowest_angles_are_a_part_of_their_own():
    made = recordings(lambda place: np.zeros(len(place)), count=8, n=120, noise=0.05)
    q = np.concatenate([one.piece.state["q2_rad"] for one in made])
    edge = np.quantile(q, 1 / 60)
    for one in made:
        one.r[:] += 1.5 * one.x[..., 0] * np.where(one.piece.state["q2_rad"] < edge, -1.0, 1.0)[:, None]
    x, r = np.concatenate([one.x[..., 0] for one in made]), np.concatenate([one.r for one in made])
    inside = q >= edge
    gain, over, found = sector(made, 2, np.array([0]))
    assert (found.low, found.high) == (pytest.approx(edge), None)
    alone, whole = (0.5 * (x[rows_] * r[rows_]).sum() ** 2 / (x[rows_] ** 2).sum() for rows_ in (inside, np.ones(len(q), dtype=bool)))
    assert gain == pytest.approx(alone, rel=1e-4)
    assert over == pytest.approx(alone - whole, rel=1e-3)


def test_rows_are_what_the_baseline_and_the_others_leave_over_the_noise_of_their_joint():
    made = tables(11, {0: 0.5, 4: 0.4}, units=3)
    known = [instance(f"effect_{k}", (k,)) for k in (0, 1, 4)]
    table, theta = Plain(made), np.array([1.0, -2.0, 0.5, 0.3])
    for one, full in zip(left_by(table, None, known[1], [known[2]], theta, NOISE), made, strict=True):
        rest = full[..., -1] - full[..., [0, 1, 2, P + 4]] @ theta
        np.testing.assert_allclose(one.r, rest / NOISE)
        np.testing.assert_allclose(one.x, full[..., [P + 1]] / NOISE[:, None])
    bench = raced(table, [known[2], *known[:2]]).bench
    r = rows(made)
    Z = r.Z[:, [0, 1, 2, P + 4]]
    off = [x - Z @ np.linalg.lstsq(Z, x, rcond=None)[0] for x in (r.Z[:, P], r.Z[:, P + 1], r.y)]
    told = projected(table, None, known[:2], [known[2]], bench, NOISE)
    for j in range(2):
        seen = [np.column_stack([one.x[:, j], one.r[:, j]]) for one in told]
        for x, want in zip(np.concatenate(seen).T, off, strict=True):
            np.testing.assert_allclose(x, want[r.joint == j], rtol=1e-4, atol=1e-5)
