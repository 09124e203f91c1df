"""What every set of features must do, whoever wrote it; none is named here except for the wake's own physics."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from rigs import arm, assert_close, at_rest, half_turned, hub_at_rest, mirrored_about_Y, run, scaled, states

from nnhydro.errors import ConfigError
from nnhydro.features.feature_set import dimensional, feature_sets, features
from nnhydro.features.history import since_reversal
from nnhydro.features.scaling import morison_scale
from nnhydro.features.wake import LASTING, STATES, TRAVEL, memories, next_state, stations, swinging_memories, time_memories, travel_memories
from nnhydro.models.learned.learned import view_of
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.travel.wake_memory import relax

SETS = pytest.mark.parametrize("name", feature_sets())
DIMENSIONLESS = pytest.mark.parametrize("name", [name for name in feature_sets() if not dimensional(name)])
LINKS = pytest.mark.parametrize("links", [1, 2, 3])
NU = 1e-6  # m2/s, of tests/rigs.py
ROUNDING = {"rtol": 1e-9, "atol": 1e-9}  # sines of pi - q, divided by small scales
LARGEST = 1e3  # no feature exceeds this, however wild the motion: light, thin links in heavy water give some tens


def floor(a, size=0.1):
    return torch.full((a.n_links,), size, dtype=torch.float64)


def seen(name, a, motion, size=0.1):
    """The features of one set."""
    return features(view_of(a, motion, floor(a, size)), [name])


speeds = st.sampled_from([0.0, 1e-300, -1e-12, 1e-6, 0.05, -0.7, 2.0, -30.0, 1e4, -1e8])


@DIMENSIONLESS
@given(data=st.data())
def test_features_are_bounded_for_any_state(name, data):
    links, density = data.draw(st.integers(1, 3)), data.draw(st.sampled_from([0.0, 1000.0]))
    values = np.array(data.draw(st.lists(speeds, min_size=12 * links, max_size=12 * links))).reshape(4, 3, links)
    carriage = np.array(data.draw(st.lists(speeds, min_size=8, max_size=8))).reshape(4, 2)
    motion = Motion.at(*values.transpose(1, 0, 2), *carriage.T)
    x = seen(name, arm(links, density), motion).matrix()
    assert bool(torch.isfinite(x).all())
    assert float(x.abs().max()) < LARGEST if x.numel() else True


@DIMENSIONLESS
@given(data=st.data())
def test_features_are_bounded_along_any_run(name, data):
    values = np.array(data.draw(st.lists(speeds, min_size=36, max_size=36))).reshape(6, 3, 2)
    carriage = np.array(data.draw(st.lists(speeds, min_size=12, max_size=12))).reshape(6, 2)
    motion = replace(Motion.at(*values.transpose(1, 0, 2), *carriage.T), steady=False)
    x = seen(name, arm(2), motion).matrix()
    assert bool(torch.isfinite(x).all())
    assert float(x.abs().max()) < LARGEST if x.numel() else True


@SETS
@LINKS
@pytest.mark.parametrize("density", [0.0, 1000.0])
def test_features_at_rest_are_finite_and_the_odd_ones_vanish(name, links, density):
    motion = at_rest(links)
    assert bool(torch.isfinite(seen(name, arm(links, density), motion).matrix()).all())
    motion.q[:, 1:] = 0.0  # a bent arm has a left and a right even at rest, a straight one has not
    odd = seen(name, arm(links, density), motion).odd
    assert float(odd.abs().max()) == 0.0 if odd.numel() else True


@SETS
@LINKS
@pytest.mark.parametrize("gravity", [0.0, 9.81])
@pytest.mark.parametrize("make", [states, run])
def test_the_mirror_image_changes_the_sign_of_odd_features_alone(name, links, gravity, make):
    a = arm(links, gravity_m_s2=gravity)
    x, y = (seen(name, a, motion) for motion in (make(links), mirrored_about_Y(make(links))))
    assert_close(y.odd, -x.odd, **ROUNDING)
    assert_close(y.even, x.even, **ROUNDING)


@SETS
@LINKS
@pytest.mark.parametrize("make", [states, run])
def test_half_a_turn_of_the_rig_changes_no_feature(name, links, make):
    x, y = (seen(name, arm(links), motion).matrix() for motion in (make(links), half_turned(make(links))))
    assert_close(y, x, **ROUNDING)


@SETS
@LINKS
def test_parity_names_a_sign_for_every_feature(name, links):
    x = seen(name, arm(links), states(links, 5))
    assert x.matrix().shape == (5, len(x.parity()))
    assert x.parity().tolist() == [-1.0] * x.odd.shape[1] + [1.0] * x.even.shape[1]


@SETS
def test_rows_of_a_steady_motion_know_nothing_of_each_other(name):
    motion, order = states(2), torch.randperm(50, generator=torch.Generator().manual_seed(1))
    shuffled = replace(motion, **{key: getattr(motion, key)[order] for key in ("q", "qd", "qdd", "u0", "du0")})
    assert_close(seen(name, arm(2), shuffled).matrix(), seen(name, arm(2), motion).matrix()[order])


@SETS
def test_the_future_does_not_reach_back(name):
    motion = run(2, rows=200)
    other = replace(motion, **{key: getattr(motion, key).clone() for key in ("q", "qd", "qdd", "u0", "du0")})
    for key in ("q", "qd", "qdd", "u0", "du0"):
        getattr(other, key)[120:] += 1.0
    x, y = (seen(name, arm(2), m).matrix() for m in (motion, other))
    assert torch.equal(x[:120], y[:120])


@SETS
def test_a_finer_time_step_gives_the_same_features(name):
    coarse, fine = (seen(name, arm(2), run(2, rows=rows)).matrix() for rows in (601, 6001))
    assert float((fine[::10] - coarse)[50:].abs().mean()) < 0.005


@DIMENSIONLESS
@pytest.mark.parametrize("k", [0.5, 3.0])
def test_a_larger_rig_at_the_same_rates_differs_in_nothing_but_viscosity(name, k):
    motion = run(2, rows=400)
    larger = replace(motion, u0=k * motion.u0, du0=k * motion.du0)
    a, b = arm(2), scaled(arm(2), k)
    thick = b.model_copy(update={"fluid": b.fluid.model_copy(update={"kinematic_viscosity_m2_s": k**2 * a.fluid.kinematic_viscosity_m2_s})})
    moving = slice(100, None)  # a speed below which things count as at rest is in m/s, whatever the rig's size
    x, y, z = (seen(name, rig, m, size).matrix()[moving] for rig, m, size in ((a, motion, 0.1), (thick, larger, 0.1 * k**5),
                                                                            (b, larger, 0.1 * k**5)))
    assert_close(y, x, rtol=0.03, atol=0.03)
    of_viscosity = (z != y).any(dim=0)
    assert_close(z[:, ~of_viscosity], x[:, ~of_viscosity], rtol=0.03, atol=0.03)


@SETS
def test_the_density_alone_does_not_change_the_features_of_an_arm_of_its_weight(name):
    motion, a = run(2), arm(2)
    heavy = a.model_copy(update={"fluid": a.fluid.model_copy(update={"density_kg_m3": 3000.0}), "links": tuple(
        link.model_copy(update={"mass_kg": 3 * link.mass_kg, "inertia_kg_m2": 3 * link.inertia_kg_m2}) for link in a.links)})
    assert_close(seen(name, heavy, motion, 0.3).matrix(), seen(name, a, motion, 0.1).matrix())


def test_an_unknown_set_is_refused_with_the_names():
    with pytest.raises(ConfigError, match=", ".join(feature_sets())):
        seen("no-such", arm(1), states(1))


@LINKS
@pytest.mark.parametrize("drive", ["direct", {"kind": "remote", "pulley_ratio": 1.5}], ids=str)
def test_the_scale_is_positive_and_grows_with_the_square_of_the_speed(links, drive):
    if drive != "direct" and links != 2:
        return
    a = arm(links, drive=drive)
    motion = states(links)
    faster = replace(motion, qd=10 * motion.qd, qdd=100 * motion.qdd, u0=10 * motion.u0, du0=100 * motion.du0)
    none = torch.zeros(links, dtype=torch.float64)
    slow, fast = (morison_scale(Flow(a, m), none) for m in (motion, faster))
    assert float(slow.min()) > 0
    assert_close(fast, 100 * slow)
    assert_close(morison_scale(Flow(a, at_rest(links)), floor(a)), floor(a).expand(20, -1))


def tow(speeds_m_s, dt=0.01):
    """A link across the tow, locked, at the given carriage speeds."""
    n = len(speeds_m_s)
    zero = np.zeros((n, 1))
    return Motion(tensor(np.arange(n) * dt), tensor(zero), tensor(zero), tensor(zero), tensor(speeds_m_s), tensor(np.zeros(n)))


def remembered(motion, a=None):
    flow = Flow(a or arm(1), motion)
    w, found = memories(flow, stations(flow))
    return w, found


def off(speed=1.0, rows=400):
    """A link set off at once at `speed` m/s, a hundredth of a metre a row."""
    return tow(np.full(rows, speed) * (np.arange(rows) > 0), dt=0.01 / speed)


def test_a_steady_tow_from_rest_fills_the_wake_after_a_few_diameters():
    w, found = remembered(off())
    memory = torch.stack(travel_memories(found))[:, :, 0, 0]
    assert bool((memory.diff(dim=1) >= 0).all())
    assert bool((memory[:-1] >= memory[1:]).all()), "a longer memory is later"
    assert_close(memory[:2, -1], w[-1, 0, :1].expand(2), rtol=1e-6, atol=1e-6)


def test_memories_over_travel_rise_late_and_know_no_speed():
    (slow, fast) = (torch.stack(travel_memories(remembered(off(v))[1]))[:, :, 0, 0] / v for v in (0.3, 2.0))
    assert_close(slow, fast, rtol=1e-9, atol=1e-12)
    rise = fast[-1].diff()
    assert int(rise.argmax()) * 0.01 > 0.5 * TRAVEL[-1] * float(arm(1).D[0]), "two stages: nothing at once"


def test_memories_over_time_are_exponentials_of_the_boundary_layer_time():
    _, found = remembered(off())
    t = torch.arange(399, dtype=torch.float64) * 0.01
    for v, share in zip(time_memories(found), LASTING, strict=True):
        r = 0.01 / (share * arm(1).D[0] ** 2 / NU)
        first = 1 - (1 - np.exp(-r)) / r  # the speed rises in a straight line over the first row
        assert_close(v[1:, 0, 0], 1 - (1 - first) * torch.exp(-t * r / 0.01), rtol=1e-9, atol=1e-9)


def test_no_memory_leaves_the_range_of_the_speed_and_none_obeys_the_planted_equation():
    u = np.concatenate([np.zeros(1), np.full(60, 0.5), np.full(60, -0.8), np.zeros(60)])
    _, found = remembered(tow(u))
    every = torch.stack([*travel_memories(found), *time_memories(found)])[:, :, 0, 0]
    assert float(every.max()) <= 0.5
    assert float(every.min()) >= -0.8
    planted = relax(tensor(u), tensor(np.abs(u) * 0.01) / arm(1).D[0] / 0.9, tensor([0.0])[0])
    lengths = np.geomspace(0.1, 10.0, 60)
    first = [relax(tensor(u), tensor(np.abs(u) * 0.01) / arm(1).D[0] / k, tensor([0.0])[0]) for k in lengths]
    assert min(float((m - x).abs().max()) for m in every for x in [planted, *first]) > 0.02


def test_set_off_a_memory_swings_once_in_five_diameters_and_settles():
    w, found = remembered(off(rows=4000))
    a, b = (x[:, 0, 0] / w[-1, 0, 0] for x in swinging_memories(found))
    assert 0.1 < float(a.max()) - 1 < 0.3, "it swings beyond the speed"
    assert_close(torch.stack([a[-1], b[-1]]), torch.tensor([1.0, 0.0]).double(), rtol=1e-6, atol=1e-6)


def test_row_by_row_the_bank_is_that_of_the_whole():
    motion = tow(np.sin(np.arange(200) * 0.07))
    w, found = remembered(motion)
    state, D, nu = torch.zeros(STATES, 1, w.shape[2], dtype=torch.float64), arm(1).D, NU
    dt = torch.diff(motion.t, prepend=motion.t[:1])
    for k in range(len(w)):
        state = next_state(w[k], dt[k], tensor(D), nu, state)
        assert_close(state, torch.stack(found)[:, k], rtol=1e-9, atol=1e-12)


def test_a_recording_that_begins_under_tow_begins_with_a_full_wake():
    w, (*full, across, last) = remembered(tow(np.full(50, 0.5)))
    assert all(torch.allclose(m, w, rtol=1e-12) for m in (*full, last))
    assert float(across.abs().max()) < 1e-12


def test_joints_that_move_from_the_first_row_on_have_no_wake_yet():
    motion = tow(np.zeros(20))
    w, found = remembered(replace(motion, qd=torch.ones_like(motion.qd)))
    assert float(w[0].abs().max()) > 0
    assert all(not m[0].any() for m in found[:-1])


def test_steady_runs_have_a_full_wake():
    motion = states(2)
    w, (*full, across, last) = remembered(motion, arm(2))
    assert all(torch.equal(m, w) for m in (*full, last))
    assert not across.any()


def test_after_a_reversal_the_wake_still_has_the_old_sign():
    w, found = remembered(tow(np.concatenate([np.full(300, 0.5), np.full(300, -0.5)])))
    for m in travel_memories(found):
        assert bool((m[301] > 0).all())
        assert bool((w[301] < 0).all())
    assert bool((travel_memories(found)[0][-1] < 0).all())


def test_a_link_at_rest_keeps_its_wake():
    _, found = remembered(hub_at_rest(tow(np.zeros(20))))
    assert all(not m.any() for m in found)
    held = relax(tensor(np.zeros(30)), tensor(np.zeros(30)), tensor([0.7])[0])
    assert bool((held == 0.7).all())


def turning(u):
    """Travel and time since the last reversal of the outer end of a locked link under the carriage speeds u, with the time."""
    motion = tow(u)
    s, t = since_reversal(Flow(arm(1), motion))
    return s[:, 0, 1], t[:, 0, 1], motion.t


def test_travel_and_time_start_anew_where_a_link_end_turns_back():
    s, t, clock = turning(np.concatenate([np.zeros(1), np.full(200, 0.5), np.zeros(100), np.full(200, -0.5)]))
    assert_close(s[200], 0.5 * clock[200])
    assert float(s[300]) == float(s[200])  # a stop is no reversal
    assert float(t[300]) == pytest.approx(3.0)
    assert float(s[301]) == pytest.approx(0.005)
    assert float(s[-1]) == pytest.approx(0.5 * 2.0)
    assert float(t[-1]) == pytest.approx(2.0)


def test_a_run_that_begins_under_way_has_moved_for_ever_until_it_turns_back():
    s, t, _ = turning(np.concatenate([np.full(100, 0.5), np.full(100, -0.5)]))
    assert bool(torch.isinf(s[:100]).all())
    assert bool(torch.isinf(t[:100]).all())
    assert float(s[100]) == pytest.approx(0.005)
    assert bool(torch.isfinite(s[100:]).all())


def test_every_input_of_the_documents_can_be_asked_for():
    asked = {"raw", "dimensional", "groups", "morison", "angles", "arm", "travel", "low-pass", "wake", "friction"}
    assert asked <= set(feature_sets())
    assert {name for name in feature_sets() if dimensional(name)} == {"raw", "dimensional"}
