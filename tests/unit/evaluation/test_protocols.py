"""What is held out is held out: groups stay whole, ranges lie outside, and a model of several arms takes over the right masses."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from campaigns import DEFAULT_LAWS, GIVEN, angles_only, campaign, planted, recording, steady_table, unlike_arms, write_folder
from rigs import arm

from nnhydro.errors import CampaignError, ConfigError
from nnhydro.evaluation.benchmark import BenchmarkOptions
from nnhydro.evaluation.protocols.learning_curve import sizes
from nnhydro.evaluation.protocols.leave_angle_sector_out import posture
from nnhydro.evaluation.protocols.leave_speed_range_out import normal_speed
from nnhydro.evaluation.protocols.protocol import DEFAULT, Fold, Material, Split, protocol_called, protocols
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign, open_campaigns
from nnhydro.recordings.splitting import Unit

ONE_ARM = sorted(set(protocols()) - {"leave-arm-out"})


def tank(count=8):
    """Recordings of unlike speeds, two of them repeats, and locked tows."""
    a = arm(2)
    made = [recording(a, planted(a), f"run{i}", seed=i + 1, seconds=2.0, rate=50.0, speed=0.15 * i, noise=0.01) for i in range(count)]
    again = replace(recording(a, planted(a), "again", seed=3, seconds=2.0, rate=50.0, speed=0.3, noise=0.02))
    return Campaign.of(a, [*made, again], (steady_table(a, planted(a), rows=60),))


def material(*campaigns, groups=None, fold_count=3):
    return Material(campaigns, (GIVEN,) * len(campaigns), tuple(groups or {} for _ in campaigns), fold_count, 0)


@pytest.mark.parametrize("name", ONE_ARM)
def test_no_group_is_fitted_and_held_out_at_once_and_repeats_stay_together(name):
    split = protocols()[name].split(material(tank(), groups={"run2": "run2", "again": "run2"}))
    for fold in split.folds:
        fitted, held_out = ({split.units[i].group for i in chosen} for chosen in (fold.fitted, fold.held_out))
        assert fitted
        assert held_out
        assert not fitted & held_out
    repeats = [i for i, unit in enumerate(split.units) if unit.group == "run2"]
    assert len(repeats) == 2
    assert all(len(set(repeats) & set(fold.held_out)) in (0, 2) for fold in split.folds)


@pytest.mark.parametrize("name", ONE_ARM)
def test_steady_rows_are_each_in_one_unit(name):
    whole = tank()
    split = protocols()[name].split(material(whole))
    rows = np.concatenate([unit.segments()[0].q for unit in split.units if unit.steady])
    assert sorted(map(tuple, rows)) == sorted(map(tuple, whole.steady[0].q))


def test_by_default_every_unit_is_held_out_once():
    split = protocol_called(DEFAULT).split(material(tank()))
    assert sorted(i for fold in split.folds for i in fold.held_out) == list(range(len(split.units)))


def test_the_fastest_recordings_are_faster_than_all_that_are_fitted():
    whole = tank()
    split = protocols()["leave-speed-range-out"].split(material(whole))
    top = [max(float(normal_speed(s, whole.arm)[s.keep].max()) for s in unit.segments()) for unit in split.units]
    fast, slow = split.folds
    assert min(top[i] for i in fast.held_out) > max(top[i] for i in fast.fitted)
    assert max(top[i] for i in slow.held_out) < min(top[i] for i in slow.fitted)
    assert any(split.units[i].steady for i in slow.held_out)


def test_the_normal_speed_is_that_of_the_physics():
    whole = tank()
    segment = whole.segments("run4", GIVEN)[0]
    flow = Flow(whole.arm, Motion.of(segment))
    ends = np.stack([flow.B.abs().numpy(), (flow.A * flow.L + flow.B).abs().numpy()]).max(axis=(0, 2))
    assert np.allclose(normal_speed(segment, whole.arm), ends, rtol=1e-12)


def test_sectors_of_the_posture_do_not_overlap():
    split = protocols()["leave-angle-sector-out"].split(material(tank()))
    middle = [float(np.median(posture(unit.segments()[0], arm(2)))) for unit in split.units]
    recorded = [[middle[i] for i in fold.held_out if not split.units[i].steady] for fold in split.folds]
    assert all(max(a) < min(b) for a, b in pairwise(recorded))


def test_angles_are_wrapped_to_one_turn():
    segment = tank().segments("run1", GIVEN)[0]
    turned = replace(segment, q=segment.q + 6 * np.pi)
    assert np.allclose(posture(segment, arm(2)), posture(turned, arm(2)), atol=1e-9)
    assert float(np.abs(posture(turned, arm(2))).max()) <= np.pi


def test_the_learning_curve_holds_out_the_same_and_shows_ever_more():
    split = protocols()["learning-curve"].split(material(tank()))
    assert len({fold.held_out for fold in split.folds}) == 1
    shown = [set(fold.fitted) for fold in split.folds]
    assert all(a < b for a, b in pairwise(shown))
    assert split.curve
    assert sizes(26) == (2, 4, 8, 16, 26)
    assert sizes(9) == (2, 4, 9)


def test_one_arm_alone_cannot_be_left_out():
    with pytest.raises(CampaignError, match="folder of campaigns"):
        protocols()["leave-arm-out"].split(material(tank()))
    with pytest.raises(CampaignError, match="numbers of joints"):
        protocols()["leave-arm-out"].split(material(tank(), campaign(arm(1), planted(arm(1)), 2, seconds=2.0, rate=50.0)))


def test_an_unknown_protocol_is_refused_with_the_names():
    with pytest.raises(ConfigError, match="learning-curve, leave-angle-sector-out"):
        protocol_called("leave-it")


def test_recordings_that_are_all_as_fast_leave_no_range_to_hold_out():
    a = arm(1)
    same = recording(a, planted(a), "one", seconds=2.0, rate=50.0)
    with pytest.raises(CampaignError, match="about the same speed"):
        protocols()["leave-speed-range-out"].split(material(Campaign.of(a, [same, replace(same, name="two")])))


def test_a_split_that_tears_a_group_is_refused():
    both = tuple(Unit(name, "same motion", False, tuple) for name in ("a", "b"))
    with pytest.raises(CampaignError, match="same motion"):
        Split(both, (Fold("torn", (0,), (1,)),))


@pytest.mark.slow
def test_every_model_is_benchmarked_on_an_arm_that_it_never_saw():
    options = BenchmarkOptions(["constant", "state", "network", "hybrid"], config=DEFAULT_LAWS, protocol="leave-arm-out")
    result = options.benchmark(unlike_arms())
    document = result.document()
    assert document["protocol"] == "leave-arm-out"
    assert len(document["versions"]["campaign_sha256"]) == 3
    assert document["models"]["constant"]["error"] < 1e-6
    assert all(np.isfinite(model["error"]) for model in document["models"].values())


def test_a_folder_of_campaigns_is_read_as_several_arms(tmp_path):
    for number, whole in enumerate(unlike_arms()):
        write_folder(whole, tmp_path / f"rig{number}")
    result = BenchmarkOptions(["constant"], protocol="leave-arm-out").benchmark(open_campaigns(tmp_path))
    assert [fold.name for fold in result.split.folds] == ["rig0", "rig1", "rig2"]
    assert {name.split("/")[0] for name in result.standings["constant"].misfit} == {"rig0", "rig1", "rig2"}


def test_the_learning_curve_is_told_fold_by_fold():
    whole = Campaign.of(arm(2), [angles_only(r) for r in tank().recordings()])
    result = BenchmarkOptions(["constant", "textbook"], 3, protocol="learning-curve").benchmark(whole)
    document = result.document()
    shown = [fold["fitted"] for fold in document["folds"]]
    assert shown == sorted(shown)
    assert document["models"]["constant"]["error"] == document["folds"][-1]["errors"]["constant"]
    assert len({fold["errors"]["textbook"] for fold in document["folds"]}) == 1


def test_a_kind_is_the_first_word_of_a_name_and_is_held_out_whole():
    a = arm(2)
    names = ("slew_fast", "slew2", "tow1", "tow_2", "Reverse")
    made = [recording(a, planted(a), name, seed=i + 1, seconds=2.0, rate=50.0, speed=0.1 * i) for i, name in enumerate(names)]
    split = protocols()["leave-kind-out"].split(material(Campaign.of(a, made)))
    held_out = {fold.name: {split.units[i].name for i in fold.held_out} for fold in split.folds}
    assert held_out == {"slew": {"slew_fast", "slew2"}, "tow": {"tow1", "tow_2"}, "reverse": {"Reverse"}}


def test_where_all_names_begin_alike_kinds_are_told_by_how_often_links_turn_back():
    a, t = arm(1), np.arange(0.0, 3.0, 0.02)
    made = []
    for i, hz in enumerate((2.0, 1.5, 0.5, 0.6, 0.1, 0.05)):
        r = recording(a, planted(a), f"run{i}", seed=i + 1, seconds=3.0, rate=50.0)
        swing = 0.3 * np.sin(2 * np.pi * hz * t[:len(r)])[:, None]
        w = 2 * np.pi * hz
        made.append(replace(r, q=swing, qd=0.3 * w * np.cos(w * t[:len(r)])[:, None], qdd=-w**2 * swing))
    split = protocols()["leave-kind-out"].split(material(Campaign.of(a, made)))
    held_out = [{split.units[i].name for i in fold.held_out} for fold in split.folds]
    assert held_out == [{"run0", "run1"}, {"run2", "run3"}, {"run4", "run5"}]
