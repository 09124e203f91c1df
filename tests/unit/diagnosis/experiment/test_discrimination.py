"""The next experiment: members of a class that a motion tells apart, by brute force, limits, and a campaign that leaves two in doubt."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from campaigns import planted, recording
from rigs import arm

from nnhydro.diagnosis import diagnose as whole
from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.diagnose import search_design
from nnhydro.diagnosis.experiment import proposal
from nnhydro.diagnosis.experiment.discrimination import DiscriminationProblem, Discriminator, chance_settled, discrimination_of
from nnhydro.diagnosis.experiment.motions import draw
from nnhydro.diagnosis.experiment.proposal import motions_at_random, next_experiment, shown_by
from nnhydro.diagnosis.experiment.rig_limits import Limits, Rig
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.diagnosis.problem.stated_friction import design_on
from nnhydro.effects.catalogue import catalogue
from nnhydro.errors import ConfigError
from nnhydro.recordings.campaign import Campaign

ARM = arm(2)
KEPT = ("torque_bias", "umbilical_stiffness", "coulomb_friction")
WITHOUT = [name for name in catalogue() if name not in KEPT]
TWO = DiscriminationProblem((0, 1), (), (0.0, 0.0), (("a", 1), ("b", 1)))


def biased():
    """Short motions about the middle with a constant torque at joint 1: a hose with a rest angle far away does it as well."""
    made = []
    for k in range(6):
        r = recording(ARM, planted(ARM), f"run{k}", seed=k + 1, noise=0.02)
        made.append(replace(r, tau=r.tau + np.array([0.4, 0.0])))
    return Campaign.of(ARM, made)


@pytest.fixture(scope="module")
def found():
    return search_design(design_on(problem_of(biased()), None), 0, WITHOUT)


def discriminator_of(found, members):
    """A discriminator of these effects at joint 1, whatever the class was."""
    search, hypotheses = found.search, found.search.view.library.hypotheses
    numbers = tuple(next(k for k, h in enumerate(hypotheses) if h.key == (effect, 1)) for effect in members)
    task = DiscriminationProblem(numbers, (), (0.0,) * len(numbers), tuple((m, 1) for m in members))
    return Discriminator(search, found.noise, found.model, task)


def test_a_motion_that_adds_nothing_settles_nothing_and_a_telling_one_settles_all():
    nothing, much = np.zeros((2, 2)), np.full((2, 2), 400.0)
    assert chance_settled(TWO, nothing, nothing) < 0.01
    assert chance_settled(TWO, much, much / 2) > 0.99


def test_a_member_that_is_behind_already_is_sooner_settled():
    gain = np.full((2, 2), 9.0)
    behind = replace(TWO, deficits=(0.0, 2.0))
    assert chance_settled(behind, gain, gain / 2) > chance_settled(TWO, gain, gain / 2)


def test_a_rival_that_must_fall_further_behind_is_later_settled():
    gain = np.full((2, 2), 36.0)
    assert chance_settled(TWO, gain, gain / 2, 25.0) < 0.2 < 0.9 < chance_settled(TWO, gain, gain / 2)


def test_what_is_left_of_the_truth_is_what_least_squares_with_the_priors_leaves():
    rng, p = np.random.default_rng(0), 3
    X = rng.standard_normal((200, p + 3))
    discriminator = object.__new__(Discriminator)
    values = [np.array([0, 0, 0, 0.7, 0, 0]), np.array([0, 0, 0, 0, 0.4, -0.2])]
    discriminator.__dict__.update(task=TWO, p=p, q=6, places=[np.array([3]), np.array([4, 5])], laws=[[0], [1]], values=values,
                          precision=np.concatenate([np.ones(p), np.full(3, RHO**-2)]))
    discriminator.moments = [np.outer(d, d) for d in discriminator.values]
    size2, margin = discriminator.noncentralities(X.T @ X)
    for a, b, own in ((0, 1, [4, 5]), (1, 0, [3])):
        take = [0, 1, 2, *own]
        stacked = np.concatenate([X[:, take], np.diag(np.sqrt(discriminator.precision[take]))])
        y = np.concatenate([X @ values[a], np.zeros(len(take))])
        left = y - stacked @ np.linalg.lstsq(stacked, y, rcond=None)[0]
        assert size2[a, b] == pytest.approx(left @ left)
    assert (np.diag(size2) == 0).all()
    dets = [0.5 * np.linalg.slogdet(np.eye(200) + X[:, t] / discriminator.precision[t] @ X[:, t].T)[1]
            for t in ([0, 1, 2, 3], [0, 1, 2, 4, 5])]
    assert margin[0, 1] == pytest.approx(size2[0, 1] / 2 + dets[1] - dets[0])
    assert margin[1, 0] == pytest.approx(size2[1, 0] / 2 + dets[0] - dets[1])


def test_of_a_rivals_laws_the_one_that_comes_nearer_counts():
    rng = np.random.default_rng(1)
    X = rng.standard_normal((300, 3))
    X = np.column_stack([X, X[:, 0]])  # the wider law of b holds a
    discriminator = object.__new__(Discriminator)
    discriminator.__dict__.update(task=TWO, p=0, q=4, places=[np.array([0]), np.array([1]), np.array([2, 3])], laws=[[0], [1, 2]],
                          values=[np.array([0.7, 0, 0, 0]), np.array([0, 0.7, 0, 0])], precision=np.full(4, RHO**-2))
    discriminator.moments = [np.outer(d, d) for d in discriminator.values]
    size2, margin = discriminator.noncentralities(X.T @ X)
    assert size2[0, 1] < 12 < 100 < size2[1, 0], "what the prior takes away is all that is left"
    assert 0 < margin[0, 1] < 15, "a value more is all that it costs"


@pytest.mark.slow
def test_recorded_columns_are_those_of_the_campaign_at_hand(found):
    discriminator = discriminator_of(found, ("torque_bias", "coulomb_friction"))
    k, whitened = discriminator.numbers[0], found.search.whitened
    x = found.search.view.columns(k).Xw.reshape(-1)
    at = discriminator.places[0]
    assert discriminator.H[at[0], at[0]] == pytest.approx(x @ x)
    np.testing.assert_allclose(discriminator.H[: discriminator.p, at[0]], whitened.Y.reshape(x.size, -1).T @ x)


def test_the_planned_motions_keep_to_the_torque_and_each_adds_what_it_holds_so_often(found):
    discriminator, problem = discriminator_of(found, ("torque_bias", "umbilical_stiffness")), found.design.problem
    rig = Rig.of(shown_by(problem))
    motions = draw(rig, problem.arm, 50.0, 6, np.random.default_rng(0))
    planned = discriminator.feasible(motions, np.full(2, np.inf))
    assert [motion.motion for motion in planned] == motions
    assert discriminator.feasible(motions, np.zeros(2)) == []
    best = max(planned, key=lambda x: discriminator.expected_gain(x, 6)[0].min())
    once, often = discriminator.expected_gain(best, 1), discriminator.expected_gain(best, 6)
    assert (often[0] >= once[0] - 1e-9).all()
    assert discriminator.chance(best, 6) >= discriminator.chance(best, 1) - 1e-9


def test_a_constant_is_not_in_doubt_for_a_hose_that_holds_it_as_a_special_case(found):
    assert [found.search.key(k) for k in found.decided.claimed.chosen] == [("torque_bias", 1)]
    assert discrimination_of(found.search, found.decided.claimed) is None


@pytest.mark.slow
def test_a_constant_or_a_hose_is_told_apart_by_the_motion_that_is_proposed(found, tmp_path, monkeypatch):
    task = discriminator_of(found, ("torque_bias", "umbilical_stiffness")).task
    monkeypatch.setattr(proposal, "discrimination_of", lambda search, claimed: task)
    limits = Limits(q_rad=((-2.0, 2.0), (-1.5, 1.5)), tau_Nm=(50.0, 20.0))
    made = next_experiment(found.search, found.noise, found.decided.claimed, found.model, 50.0, 0, limits)
    assert made.chance >= made.usual
    assert made.stated
    assert 3 <= made.recordings <= 6
    told = made.document("next_experiment.csv")
    assert {m["effect"] for m in told["separates"]} >= {"torque_bias"}
    made.write(tmp_path / "next.csv")
    lines = (tmp_path / "next.csv").read_text().splitlines()
    assert lines[0].startswith("t_s,q1_rad,q2_rad")
    assert len(lines) == len(made.motion.t) + 1
    again = next_experiment(found.search, found.noise, found.decided.claimed, found.model, 50.0, 0, limits)
    assert again.document() == made.document()


def test_nothing_is_proposed_where_nothing_is_in_doubt_or_nothing_moves(found):
    empty = found.search.score(())
    assert next_experiment(found.search, found.noise, empty, found.model, 50.0, 0) is None
    still = SimpleNamespace(stretches=[SimpleNamespace(segment=SimpleNamespace(steady=True, tau=np.zeros((3, 2)), keep=np.ones(3, bool)))])
    assert shown_by(still) == []


def test_motions_at_random_keep_to_the_limits_of_the_rig(found):
    drawn = motions_at_random(found.design.problem, found.model, 50.0, 4, 0)
    rig = Rig.of(shown_by(found.design.problem))
    assert len(drawn) == 4
    assert all(rig.allows(motion.state) for motion in drawn)


def test_a_proposal_that_fails_costs_nothing_but_itself(found, monkeypatch):
    def broken(*given):
        raise np.linalg.LinAlgError("singular")

    monkeypatch.setattr(whole, "next_experiment", broken)
    assert whole._plan_next(found, biased(), 0, None) == (None, {"next_experiment": "not planned: singular"})


@pytest.mark.parametrize("undriven", [True, False])
def test_a_motion_is_planned_for_a_machine_that_a_drive_moves_alone(undriven, monkeypatch):
    monkeypatch.setattr(whole, "next_experiment", lambda *given: "a motion")
    design = SimpleNamespace(undriven=undriven, problem=SimpleNamespace(names=biased().names))
    state = SimpleNamespace(design=design, search=None, noise=None, decided=SimpleNamespace(claimed=None), model=None)
    assert whole._plan_next(state, biased(), 0, None) == (None if undriven else "a motion", {})


def test_limits_of_another_arm_are_refused_before_anything_is_done():
    with pytest.raises(ConfigError, match="q_rad has 1 range for an arm of 2"):
        whole.diagnose(biased(), limits=Limits(q_rad=((-1.0, 1.0),)))
