"""Parts of a campaign: amplitudes say in which recordings a law acts, and a part is taken where the rest speaks against the whole."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from problems import design, law, search
from rigs import arm

from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.problem.activity import ActivityWindow, Sector
from nnhydro.diagnosis.search.activity_windows import (
    CLEAR,
    _amplitudes,
    _best_run,
    _confine,
    _knows_angles,
    _of_sectors,
    _silent,
    gains_by_recording,
    in_parts,
    laws_of_some_recordings,
)
from nnhydro.diagnosis.search.best_fit import remainder_without_unknown
from nnhydro.effects.catalogue import catalogue


def test_the_run_of_bins_in_which_a_law_acts_is_found_from_its_products_alone():
    rng = np.random.default_rng(3)
    parts = rng.standard_normal((400, 8))
    acting = np.array([0, 0, 1, 1, 1, 0, 0, 0])
    y = parts @ acting + 0.1 * rng.standard_normal(400)
    assert _best_run(parts.T @ parts, parts.T @ y) == (2, 5)
    assert _best_run(parts.T @ parts, parts.T @ (parts @ np.ones(8))) == (0, 8)
    a, sd = _amplitudes(parts.T @ parts / 0.01, parts.T @ y / 0.01)
    assert np.all(np.abs(a - acting) < 4 * sd)


@pytest.mark.parametrize(("amplitude", "sd", "silent"), [
    (0.0, 0.01, True), (0.9 * CLEAR, 0.01, True), (1.1 * CLEAR, 0.01, False), (1.0, 0.01, False),
    (0.2, 0.3, False),  # near 0, and not clearly below 1
    (0.3, 0.2, True),  # within two deviations of 0, and two below 1 less CLEAR
    (0.0, 0.5, False),  # where nothing moves, the prior says as little of 0 as of 1
])
def test_a_part_is_silent_where_its_amplitude_is_near_0_and_clearly_not_1(amplitude, sd, silent):
    assert _silent(np.array([amplitude]), np.array([sd]))[0] == silent


def test_where_nothing_moves_an_amplitude_is_that_of_its_prior():
    a, sd = _amplitudes(np.diag([0.0, 1e6]), np.array([0.0, 1e6]))
    np.testing.assert_allclose(a, [0.5, 1.0], atol=1e-5)
    np.testing.assert_allclose(sd, [1.0, 1e-3], rtol=1e-3)


def campaign(acts, moves=(1,) * 6, order=None, noise=(0.3,) * 6, **card):
    """A search among two laws, the first of which acts in recordings `acts` of six; `moves`: whether it is excited there at all.

    `noise` is what each recording is held to have.
    """
    a = law("a", joint=1)
    vars(a.effect).update({"random_intercept": False, "predictable_share": 1.0, **card})
    b = law("b", joint=1)
    vars(b.effect).update(random_intercept=False, predictable_share=1.0)
    of = design(31, groups=6, rows=60, noise=min(noise))
    group = of.problem.group_of
    of.problem.names = tuple(f"run{g}" for g in range(6))
    of.problem.arm = SimpleNamespace(n_links=0)  # no sectors of angles
    of.problem.stretches = [SimpleNamespace(group=g, place=None if order is None else np.array([float(order[g])])) for g in range(6)]
    X = np.random.default_rng(32).standard_normal((*of.y.shape, 2))
    X[..., 0] *= np.asarray(moves, float)[group][:, None]
    of.y = of.y + 0.8 * X[..., 0] * np.isin(group, acts)[:, None]
    one = search(of, (a, b), X, level=np.square(noise)[group][:, None])
    return one, in_parts(one, one.score((0,)), None)


def window_of(parts):
    (k,) = parts.best.chosen
    return parts.search.view.library.hypotheses[k].activity


def test_a_law_that_acts_in_some_recordings_is_confined_to_them_with_its_whole_value():
    one, parts = campaign([0, 2, 5])
    window = window_of(parts)
    assert window.recordings == ("run0", "run2", "run5")
    assert not window.since
    assert not window.until
    (at,) = parts.best.places(parts.search.view).values()
    k = parts.best.chosen[0]
    value = parts.best.fit.mean[at] * parts.search.view.library.scale[parts.search.view.library.at(k)]
    assert value[0] == pytest.approx(0.8, abs=0.1), "diluted over the whole campaign it would be half of that"
    assert parts.best.score > one.score((0,)).score


def test_quiet_recordings_do_not_hide_a_law_that_passes_for_the_noise_of_the_others():
    one, parts = campaign([1, 4], noise=[0.1, 1.0, 0.1, 0.1, 1.0, 0.1], varies=True)
    assert one.score((0,)).fit.mean[one.score((0,)).places(one.view)[0]] < 0.1, "of 0.8"
    assert window_of(parts).recordings == ("run1", "run4")


@pytest.mark.parametrize(("acts", "since", "until"), [([3, 4, 5], True, False), ([0, 1], False, True)])
def test_where_clocks_say_the_order_a_law_begins_or_ends(acts, since, until):
    window = window_of(campaign(acts, order=range(6))[1])
    assert (window.since, window.until) == (since, until)
    assert window.recordings == tuple(f"run{g}" for g in acts)


def test_where_a_law_acts_is_found_again_once_its_values_are_finer():
    """About other values, its columns may say of a recording what those about none did not: here that it acts in run5, too."""
    one, _ = campaign([3, 4, 5], order=range(6))
    of, group, whole = one.view.library.design, one.view.library.design.problem.group_of, one.view.library.hypotheses[0]
    too_few = replace(whole, activity=ActivityWindow(("run3", "run4")))
    X = one.view.library.columns(0)
    of.columns = lambda laws, model: np.concatenate([X] * len(laws), axis=2)
    confined = search(of, (too_few, one.view.library.hypotheses[1]),
                      np.concatenate([X * np.isin(group, [3, 4])[:, None, None], one.view.library.columns(1)], axis=2), level=0.3**2)
    assert window_of(in_parts(confined, confined.score((0,)), None)).recordings == ("run3", "run4", "run5")


def test_the_order_of_names_is_not_time():
    window = window_of(campaign([3, 4, 5])[1])
    assert window.recordings == ("run3", "run4", "run5")
    assert not window.since
    clocked = window_of(campaign([1, 3, 5], order=[0, 3, 1, 4, 2, 5])[1])
    assert (clocked.recordings, clocked.since) == (("run1", "run3", "run5"), True), "by the clock these are the last"


def test_a_law_that_acts_throughout_stays_whole():
    assert window_of(campaign(range(6))[1]) is None


def test_a_law_is_not_confined_where_the_rest_is_silent_because_nothing_moves_there():
    assert window_of(campaign(range(6), moves=[1, 1, 1, 0, 0, 0])[1]) is None


@pytest.mark.parametrize("card", [{"predictable_share": 0.5}, {"random_intercept": True}])
def test_a_law_that_may_only_be_late_is_not_asked_for_its_parts(card):
    _, parts = campaign([0, 2, 5], **card)
    assert all(h.effect.id != "a" or h.activity is None for h in parts.search.view.library.hypotheses)
    assert parts.best.chosen == (0,)


def test_what_acts_on_the_whole_arm_and_what_a_sensor_does_know_of_no_sector_of_a_joint():
    """A plane is not tilted while joint 1 lies between two angles only."""
    one, _ = campaign([0, 1])
    library = one.view.library
    library.design.columns = lambda laws, model: np.concatenate([library.columns(0)] * len(laws), axis=2)
    library.design.problem.arm = SimpleNamespace(n_links=2)
    sector = ActivityWindow(sector=Sector(1, -0.1, 0.6))
    library.hypotheses[1].effect.joint = 0
    grown = _confine(library, [0, 1], [sector], None)
    assert [h.effect.id for h in grown.hypotheses[2:]] == ["a"]
    assert _of_sectors(one, None, 1, np.ones(1), None) == []
    vars(library.hypotheses[1])["effect"] = catalogue()["torque_bias"].at_start(arm(2), joint=1)
    assert [h.effect.id for h in _confine(library, [0, 1], [sector], None).hypotheses[2:]] == ["a"]
    assert _of_sectors(one, None, 1, np.ones(1), None) == []


@pytest.mark.parametrize(("kind", "sectors"), [("torque_bias", False), ("torque_gain", False), ("joint_elasticity", True),
                                               ("coulomb_friction", True)])
def test_no_sensor_knows_in_which_sector_its_joint_stands(kind, sectors):
    assert _knows_angles(catalogue()[kind].at_start(arm(2), joint=2)) is sectors


def wave_and_pump(own):
    """A search among a wave with values of each recording's own and a pump that resembles it; `own` (6,): sizes of the true one."""
    wave, pump = law("wave", per_recording=True), law("pump")
    for one in (wave, pump):
        vars(one.effect).update(random_intercept=False, predictable_share=1.0)
    of = design(31, groups=6, rows=60, noise=0.3)
    of.problem.names = tuple(f"run{g}" for g in range(6))
    of.problem.arm = SimpleNamespace(n_links=0)
    of.problem.stretches = [SimpleNamespace(group=g, place=None) for g in range(6)]
    X = np.random.default_rng(33).standard_normal((*of.y.shape, 2))
    X[..., 0] = X[..., 1] + 0.7 * X[..., 0]
    of.y = of.y + (X * np.asarray(own)[of.problem.group_of][:, None]).sum(axis=2)
    return search(of, (wave, pump), X, level=0.3**2)


def test_beside_a_wave_of_each_recording_s_own_a_law_that_acts_in_some_recordings_is_sought():
    among = wave_and_pump([(0, 0.8 * acts) for acts in (1, 0, 0, 0, 0, 1)])
    parts = in_parts(among, among.score((0,)), None)
    assert [parts.search.key(k) for k in parts.best.chosen] == [("pump", 0)]
    assert window_of(parts).recordings == ("run0", "run5")


def test_a_law_that_gains_less_than_a_wave_is_not_sought_in_parts():
    among = wave_and_pump([(size, 0) for size in (0.8, -0.6, 0.3, -0.9, 0.5, 0.7)])
    assert gains_by_recording(among, among.score(()))[0] > 20
    assert laws_of_some_recordings(among, among.score(()), among.score((0,))) == []
    assert laws_of_some_recordings(among, among.score(()), among.score(())) == [1]
    assert in_parts(among, among.score((0,)), None).best.chosen == (0,)


@pytest.fixture(scope="module")
def to_and_fro():
    """A search among three laws; the second (two columns) acts in two recordings of six, with opposite signs."""
    of = design(41, groups=6, rows=60, noise=0.3)
    X = np.random.default_rng(42).standard_normal((*of.y.shape, 4))
    sign = np.select([of.problem.group_of == 1, of.problem.group_of == 4], [1.0, -1.0])
    of.y = of.y + 0.4 * X[..., 1] * sign[:, None]
    return search(of, (law("a"), law("b", width=2), law("c")), X, level=0.3**2)


def test_the_gain_is_the_evidence_of_each_recording_by_itself(to_and_fro):
    base = to_and_fro.score(())
    gains, left = gains_by_recording(to_and_fro, base), remainder_without_unknown(to_and_fro, base)
    view, want = to_and_fro.view, 0.0
    X = view.whitened.weigh(view.library.columns(1))
    for g in range(6):
        rows = view.whitened.group == g
        r, A = left[rows].ravel(), X[rows].reshape(-1, 2)
        V = np.eye(len(r)) + RHO**2 * A @ A.T
        want += max(0.0, float(r @ r - r @ np.linalg.solve(V, r)) / 2 - np.linalg.slogdet(V)[1] / 2)
    assert gains[1] == pytest.approx(want, rel=1e-9)
    assert gains[1] > 20 > max(gains[0], gains[2])


def test_it_is_found_where_the_whole_campaign_says_nothing(to_and_fro):
    base = to_and_fro.score(())
    assert to_and_fro.score((1,)).score < base.score
    assert laws_of_some_recordings(to_and_fro, base, base)[0] == 1
    assert laws_of_some_recordings(to_and_fro, base, base, most=1) == [1]
    assert 1 not in laws_of_some_recordings(to_and_fro, to_and_fro.score((1,)), to_and_fro.score((1,)))


def test_what_does_not_come_and_go_is_sought_in_some_recordings_only_where_the_unknown_says_more_than_chance(to_and_fro):
    base, effect = to_and_fro.score(()), to_and_fro.view.library.hypotheses[1].effect
    assert laws_of_some_recordings(to_and_fro, base, base, varying=True) == []
    vars(effect).update(varies=True)
    assert laws_of_some_recordings(to_and_fro, base, base, varying=True) == [1]
    vars(effect).update(varies=False)
