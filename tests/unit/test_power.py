"""What a campaign can reveal, and the motion that settles what it cannot: the algebra, and planted effects of the stated size."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from nnhydro.diagnosis.blocks import Blocks, kept_rows
from nnhydro.diagnosis.contest import Contest, Judge, _less_offsets
from nnhydro.diagnosis.experiment import Proposal, _Planner
from nnhydro.diagnosis.feasible import draw, varied
from nnhydro.diagnosis.instances import Instance
from nnhydro.diagnosis.planned import planned
from nnhydro.diagnosis.planting import low_pass_share, planted
from nnhydro.diagnosis.power import correlation, power, visible_energies
from nnhydro.diagnosis.reference import reference
from nnhydro.diagnosis.rig import Rig, read_limits
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.strength import Price, Where, chance, smallest_own_strength, smallest_strength
from nnhydro.diagnosis.studied import named
from nnhydro.diagnosis.table import Table
from nnhydro.effects.torque_bias import TorqueBias
from nnhydro.effects.umbilical_stiffness import UmbilicalStiffness
from nnhydro.errors import ConfigError

MANY = ("wall_proximity", "torque_ripple", "flow_memory", "vortex_shedding", "wave_orbital", "link_interference", "torque_saturation",
        "backlash", "wake_development", "wake_reentry", "stribeck_friction")  # effects with many shapes, left out to be quick
PLAN = """name: small
arm:
  fluid: {density_kg_m3: 1000.0}
  links:
    - {length_m: 0.55, diameter_m: 0.07, mass_kg: 1.0, com_m: 0.27, inertia_kg_m2: 0.026}
    - {length_m: 0.45, diameter_m: 0.06, mass_kg: 1.4, com_m: 0.22, inertia_kg_m2: 0.024}
terms: {normal_drag: {C_D: 1.1}, added_mass: {C_M: 0.8}%s}
motions:
  - {kind: fourier, name: f1, q_rad: [0.3, 0.5], duration_s: 8, reach_rad: 0.9, rate_rad_s: 2.0}
  - {kind: fourier, name: f2, q_rad: [0.3, 0.5], duration_s: 8, reach_rad: 0.9, rate_rad_s: 2.0}
  - {kind: fourier, name: f3, q_rad: [0.0, -0.5], duration_s: 8, reach_rad: 0.9, rate_rad_s: 2.0}
  - {kind: fourier, name: f4, q_rad: [0.0, 1.0], duration_s: 8, reach_rad: 0.9, rate_rad_s: 1.0}
  - {kind: slew, name: s1, q_rad: [[0, 0], [1.2, 0.6], [0, 0]], duration_s: 2.0, pause_s: 0.5}
  - {kind: slew, name: s2, q_rad: [[0.5, 0], [-1.2, 1.0], [0, 0]], duration_s: 2.0, pause_s: 0.5}
  - {kind: tow, name: t1, q_rad: [0.2, 0.4], hold_s: 4, carriage: {u0_m_s: 0.6}}
sensors: {torque_noise_share: %s, encoder_counts_per_rev: 65536}
"""
TWELVE = Where(np.full(48, 1 / 48), np.repeat(np.arange(12), 4), 0.7, 2000.0)
PAID = Price(4.5, 1, 1.0)


def plan(folder, noise="0.01", more=""):
    path = folder / "plan.yaml"
    path.write_text(PLAN % (more, noise))
    return path


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """The small plan as a campaign, and what it can reveal of the effects with few shapes."""
    whole, _ = planned(plan(tmp_path_factory.mktemp("plan")))
    return whole, power(whole, without=MANY)


def row(found, effect, joint=0, parameter=None):
    return next(r for r in found.rows if r.instance.key == (effect, joint) and parameter in (None, r.parameter))


def test_the_chance_of_being_found_rises_with_strength():
    chances = [chance(strength, TWELVE, PAID) for strength in (2.0, 5.0, 7.0, 9.0, 14.0)]
    assert chances == sorted(chances)
    assert chances[0] < 0.05
    assert chances[-1] > 0.99


def test_an_effect_that_shows_in_three_recordings_is_not_found_at_any_strength():
    e = np.where(TWELVE.unit < 3, 1.0, 0.0)
    few = replace(TWELVE, e=e / e.sum())
    assert smallest_strength(few, PAID) is None
    assert smallest_own_strength(few, 2) is not None, "likelihoods of three confirm each other, signs of three do not"


def test_noise_that_is_correlated_from_row_to_row_asks_for_a_stronger_effect():
    plain, rough = smallest_strength(TWELVE, PAID), smallest_strength(replace(TWELVE, correlation=1.5), PAID)
    assert rough == pytest.approx(plain * np.sqrt(1.5), rel=0.1)


def test_a_long_campaign_asks_for_a_material_share_of_the_noise():
    found = smallest_strength(replace(TWELVE, rows=2e5, strongest=1.0), PAID)
    assert found == pytest.approx(np.sqrt(0.01 * 2e5), rel=0.1)


def test_the_visible_energy_is_what_least_squares_with_the_prior_leaves():
    rng = np.random.default_rng(0)
    tables, p = [rng.standard_normal((40, 6)) for _ in range(3)], 2
    tables = [np.column_stack([t[:, :2], 3 * t[:, 0] + 0.2 * t[:, 2], *t[:, 3:].T]) for t in tables]
    G = np.stack([t.T @ t for t in tables])[:, None]
    prior = np.array([2.0, 5.0])
    race = SimpleNamespace(bench=Bench(Blocks(G, np.full(3, 40.0), np.arange(3), p), p, prior))
    energies, whole = visible_energies(race)
    every = np.concatenate([*tables, np.column_stack([np.diag(np.sqrt(prior)), np.zeros((2, 4))])])
    for k in (p, p + 1, p + 2):
        left = every[:, k] - every[:, :p] @ np.linalg.lstsq(every[:, :p], every[:, k], rcond=None)[0]
        assert energies[:, 0, k - p].sum() == pytest.approx((left[:120] ** 2).sum(), rel=1e-5)
        assert whole[k - p] == pytest.approx((every[:, k] ** 2).sum())


def test_what_the_baseline_fits_cannot_be_revealed_and_says_so(small):
    mine = row(small[1], "added_mass", parameter="C_M[1]")
    assert mine.size is None
    assert mine.visible < 1e-3


def test_a_weighed_link_hides_more_of_a_payload_the_less_it_is_known(small, tmp_path):
    rough = tmp_path / "rough.yaml"
    rough.write_text((PLAN % ("", "0.01")).replace("0.024}", "0.024, known_to: 0.2}"))
    loose = power(planned(rough)[0], without=MANY)
    assert row(loose, "payload_mass").visible < row(small[1], "payload_mass").visible


def test_twice_the_noise_asks_for_twice_the_size(small, tmp_path):
    loud = power(planned(plan(tmp_path, "0.02"))[0], without=MANY)
    for effect, joint in (("torque_bias", 1), ("viscous_friction", 2), ("coulomb_friction", 1)):
        assert row(loud, effect, joint).size == pytest.approx(2 * row(small[1], effect, joint).size, rel=0.15)


def test_a_plan_is_run_by_the_baseline_alone_and_says_what_it_leaves_off(tmp_path):
    whole, left_off = planned(plan(tmp_path, more=", viscous_friction: {b: 0.5}"))
    plain, nothing = planned(plan(tmp_path))
    assert left_off == ("viscous_friction",)
    assert nothing == ()
    np.testing.assert_array_equal(whole.load("f1").tau, plain.load("f1").tau)


def test_a_plan_without_noise_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="torque_noise_Nm"):
        planned(plan(tmp_path, "0.0"))


def test_sums_of_planted_noise_scatter_as_the_correlation_says(small):
    found, rng = small[1], np.random.default_rng(0)
    segment = found.case.all_units[0].segments()[0]
    rows = kept_rows(segment)
    low_pass, passed = segment.low_pass, low_pass_share(segment)
    noise = low_pass.apply(rng.standard_normal((len(segment), 500)), segment.dt)[rows] / passed
    assert noise.std() == pytest.approx(1.0, rel=0.03)
    assert (noise.sum(axis=0) ** 2).mean() / len(rows) == pytest.approx(correlation(Table(found.case)), rel=0.2)


def rig():
    return Rig(np.array([[-1.0, 1.0], [-0.5, 2.0]]), np.array([1.5, 2.0]), np.array([6.0, 8.0]), 0.5, np.array([9.0, 3.0]), 8.0)


def test_every_motion_drawn_or_varied_stays_within_the_limits_of_the_rig(small):
    limits, rng = rig(), np.random.default_rng(1)
    drawn = draw(limits, small[0].arm, 100.0, 30, rng)
    assert len(drawn) == 30
    assert {m.document["kind"] for m in drawn} == {"slew", "fourier", "tow"}
    for motion in [*drawn, *varied(drawn[:5], limits, small[0].arm, 100.0, 20, rng)]:
        s = motion.state
        assert (s.q >= limits.q[:, 0] - 1e-6).all()
        assert (s.q <= limits.q[:, 1] + 1e-6).all()
        assert (np.abs(s.qd) <= limits.rate * 1.001).all()
        assert (np.abs(s.qdd) <= limits.acceleration * 1.001).all()
        assert np.abs(s.u0).max() <= 0.5 + 1e-9


def test_no_motion_is_towed_where_the_carriage_has_never_moved(small):
    drawn = draw(replace(rig(), u0=0.0), small[0].arm, 100.0, 20, np.random.default_rng(1))
    assert not any(m.state.u0.any() for m in drawn)


def contest(behind, limit=10.0):
    return Judge(None, None, None, Contest(("a", "b"), (), behind, np.full((2, 2), limit)))


def test_a_motion_that_adds_nothing_settles_nothing_and_a_telling_one_settles_all():
    judge = contest((0.0, 1.0))
    assert judge.chance(np.zeros((2, 2)), 1000.0) < 0.01
    assert judge.chance(np.full((2, 2), 400.0), 1000.0) > 0.99


def test_a_motion_recorded_often_adds_its_rows_so_often_to_those_at_hand():
    asked = {}

    class Asked:
        """A judge that notes what it is asked."""

        def apart(self, H):
            return H

        def gained(self, H, rows):
            asked["gained"] = H, rows
            return np.ones(2)

        def possible(self, H):
            asked["possible"] = H

        def chance(self, *given):
            asked["chance"] = given
            return 0.404

        def apart_by(self, gain, rows):
            asked["apart"] = gain, rows
            return 7.0

    H, G = np.eye(2), np.array([[0.0, 3.0], [3.0, 0.0]])
    planner = _Planner(Asked(), H, 500.0, np.array([[0.0, 1.0], [2.0, 0.0]]))
    assert planner.chance(SimpleNamespace(G=G, rows=40.0), 3) == 0.404
    np.testing.assert_array_equal(asked["gained"][0], H + 3 * G)
    assert asked["gained"][1] == 500.0 + 3 * 40.0
    np.testing.assert_array_equal(asked["possible"], H + 3 * G)
    gain, rows, _, often, _ = asked["chance"]
    np.testing.assert_array_equal(gain, [[1.0, 8.0], [7.0, 1.0]])
    assert (rows, often) == (120.0, 3)
    assert planner.merit(SimpleNamespace(G=G, rows=40.0), 3) == (0.4, 7.0)
    np.testing.assert_array_equal(asked["apart"][0], gain)
    assert asked["apart"][1] == 120.0


def test_a_member_that_is_behind_already_is_sooner_settled():
    gain = np.full((2, 2), 25.0)
    assert contest((0.0, 8.0)).chance(gain, 1e4) > contest((0.0, 0.0)).chance(gain, 1e4)


@pytest.mark.slow
def test_effects_of_the_stated_size_are_found_four_times_in_five(small):
    whole, found = small
    hits = []
    for effect, joint, parameter in (("coulomb_friction", 2, "level"), ("torque_bias", 1, "offset"), ("history_force", 0, "C_H"),
                                     ("viscous_friction", 1, "coefficient"), ("umbilical_stiffness", 2, "stiffness")):
        mine = row(found, effect, joint, parameter)
        for seed in range(5):
            case = planted(found.case, [(mine.instance, mine.direction * mine.size)], found.noise, seed)
            case = replace(case, reference=reference(None, whole.arm, case.all_units, case.model.preparation))
            hits.append(effect in {name for f in named(case, None, seed, MANY).findings for name in f.members})
    assert 0.6 <= np.mean(hits) <= 0.96  # 0.8 +- two standard deviations of 25 draws


@pytest.mark.slow
def test_an_effect_a_third_as_large_is_missed(small):
    found = small[1]
    mine = row(found, "viscous_friction", 1)
    case = planted(found.case, [(mine.instance, mine.direction * mine.size / 3)], found.noise, 1)
    assert named(case, None, 1, MANY).findings == []


@pytest.mark.parametrize(("chance_of_it", "words"), [
    (0.93, "record the proposed slew (4.0 s) 3 times: it settles the matter with a chance of 93 % (a motion drawn at random: 60 %)."),
    (0.04, "no motion is likely to tell coulomb_friction at joint 2 from stribeck_friction"),
    (0.494, "recorded 3 times, settles the matter with a chance of 49 %.")])
def test_a_proposal_that_would_hardly_settle_anything_says_so(chance_of_it, words):
    members = tuple(SimpleNamespace(key=(effect, 2)) for effect in ("coulomb_friction", "stribeck_friction"))
    motion = SimpleNamespace(document={"kind": "slew"}, t=np.linspace(0, 4, 9))
    assert words in Proposal(SimpleNamespace(members=members), motion, 3, 1.0, chance_of_it, 0.6, None).statement()


def test_a_size_that_can_be_revealed_has_a_strength_and_one_that_cannot_has_none(small):
    _, found = small
    assert {r.size is None for r in found.rows} == {True, False}
    assert all((r.size is None) == (r.strength is None) for r in found.rows)


def test_stated_limits_replace_what_the_rig_has_shown_and_the_rest_stays(tmp_path):
    path = tmp_path / "limits.yaml"
    path.write_text("q_rad: [[-2, 2], [-1, 1.5]]\ndq_rad_s: 3\nu0_m_s: 0.8\n")
    wider = rig().with_limits(read_limits(path))
    np.testing.assert_array_equal(wider.q, [[-2, 2], [-1, 1.5]])
    np.testing.assert_array_equal(wider.rate, [3, 3])
    np.testing.assert_array_equal(wider.acceleration, rig().acceleration)
    assert (wider.u0, wider.seconds, wider.stated) == (0.8, rig().seconds, True)


@pytest.mark.parametrize(("text", "line"), [
    ("dq_rads: 3\n", "unknown key 'dq_rads': did you mean 'dq_rad_s'"), ("q_rad: [[-1, 1]]\n", "q_rad has 1 ranges for an arm of 2 joint"),
    ("q_rad: [[1, -1], [0, 1]]\n", "the lower angle first"), ("tau_Nm: [1, 2, 3]\n", "limits: tau_Nm: 3 numbers for an arm of 2 joint")])
def test_limits_that_do_not_fit_are_refused_in_one_line(tmp_path, text, line):
    path = tmp_path / "limits.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=re.escape(line)):
        read_limits(path).check(2)


def test_a_rival_that_only_fits_with_absurd_values_is_no_rival_any_more():
    """A constant torque is a spring with a rest angle far away: what ends the matter is that the angle is known to be absurd."""
    bias, hose = SimpleNamespace(columns=(0,), own=()), SimpleNamespace(columns=(1, 2), own=())
    hose.instance = Instance(UmbilicalStiffness(joint=1, stiffness=(0.5,), preload=(0.0,)))
    bias.instance = Instance(TorqueBias(joint=1, offset=(0.1,)))
    race = SimpleNamespace(bench=SimpleNamespace(p=0, prior=np.zeros(0)),
                           values=lambda kept: (None, dict.fromkeys([k for c in kept for k in c.columns], 1.0)))
    judge = Judge(None, race, None, Contest((bias, hose), (), (0.0, 0.0), np.full((2, 2), 10.0)))
    q = np.linspace(-0.01, 0.01, 200)
    few = np.column_stack([np.ones(200), q, np.ones(200)])
    many = np.column_stack([np.ones(200), 100 * q, np.ones(200)])
    narrow, wide = judge.possible(few.T @ few), judge.possible(25 * many.T @ many)
    assert narrow[0, 1] > 0.2
    assert wide[0, 1] < 0.1
    assert judge.chance(np.zeros((2, 2)), 1e4, wide) > judge.chance(np.zeros((2, 2)), 1e4, narrow)


def test_what_a_constant_in_a_new_recording_explains_does_not_count():
    rng = np.random.default_rng(0)
    rows = [np.column_stack([rng.standard_normal(30) + 2, np.ones(30) * (j == 0), np.ones(30) * (j == 1), rng.standard_normal(30) + 5,
                             np.zeros(30)]) for j in range(2)]
    G = np.stack([r.T @ r for r in rows])
    plain = sum(np.cov(r[:, [0, 3]], rowvar=False, bias=True) * 30 for r in rows)
    np.testing.assert_allclose(_less_offsets(G, 1), plain, rtol=1e-9)


def test_a_rival_that_hardly_differs_stays_in_the_class_however_well_both_are_known():
    judge, gain = contest((0.0, 0.0)), np.full((2, 2), 100.0)
    assert judge.chance(gain, 1e4) > 0.9
    assert judge.chance(gain, 1e4, gained=np.array([1e4, 1e4])) < 0.01
    freer = replace(judge, contest=replace(judge.contest, hardly=np.zeros((2, 2), dtype=bool)))
    assert freer.chance(gain, 1e4, gained=np.array([1e4, 1e4])) > 0.9, "rivals of more parameters have no such excuse"
