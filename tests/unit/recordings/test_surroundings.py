"""Columns of a moving base and of measured water: read, derived, used in fits and predictions, and refused where they contradict."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import GIVEN, TINY, columns_of, planted, recording, sensor_torque, write_csv
from rigs import arm

from nnhydro.errors import RecordingError
from nnhydro.fitting.identify import identify
from nnhydro.fitting.network.train import train
from nnhydro.models.domain import DOMAIN
from nnhydro.models.prediction import predict
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.filtering.preprocessing import Preparation, prepare
from nnhydro.recordings.readers.files import read_recording
from nnhydro.recordings.repeats import repeated_recordings
from nnhydro.recordings.survey import survey

COLUMNS = {"base": ("base_x_m_s", "base_yaw_rad_s"), "dbase": ("dbase_x_m_s2", "dbase_yaw_rad_s2"),
           "current": ("current_x_m_s", "current_y_m_s"), "dcurrent": ("dcurrent_x_m_s2", "dcurrent_y_m_s2")}


def surrounded(a, name="run", seed=1, loads=None):
    """A recording on a base that moves and turns, in water that moves, every derivative given."""
    r = recording(a, planted(a), name, seed, speed=0.3)
    t = r.t
    base = np.column_stack([0.4 * np.sin(1.1 * t + seed), 0.5 * np.sin(0.7 * t)])
    dbase = np.column_stack([0.44 * np.cos(1.1 * t + seed), 0.35 * np.cos(0.7 * t)])
    current = np.column_stack([0.3 + 0.1 * np.sin(0.9 * t), -0.2 * np.cos(0.5 * t)])
    dcurrent = np.column_stack([0.09 * np.cos(0.9 * t), 0.1 * np.sin(0.5 * t)])
    r = replace(r, base=base, dbase=dbase, current=current, dcurrent=dcurrent)
    (segment,) = prepare(r, GIVEN)
    return replace(r, tau=sensor_torque(a, planted(a) if loads is None else loads, Motion.of(segment)))


def columns(r, without=()):
    found = columns_of(r)
    for key, names in COLUMNS.items():
        found |= dict(zip(names, getattr(r, key).T, strict=True))
    return {name: x for name, x in found.items() if name not in without}


def written(a, folder, runs, without=()):
    import yaml

    folder.mkdir(parents=True, exist_ok=True)
    (folder / "arm.yaml").write_text(yaml.safe_dump(a.document()))
    for r in runs:
        write_csv(folder / "recordings" / f"{r.name}.csv", columns(r, without))
    return folder


def test_the_columns_of_base_and_water_are_read(tmp_path):
    a = arm(2)
    r = surrounded(a)
    got = read_recording(write_csv(tmp_path / "run.csv", columns(r)), a)
    for key in COLUMNS:
        np.testing.assert_array_equal(getattr(got, key), getattr(r, key))
    assert not got.origin.unused


def test_the_new_name_of_motion_along_Y_is_the_old_u0(tmp_path):
    a = arm(1)
    given = columns(surrounded(a))
    renamed = {{"u0_m_s": "base_y_m_s", "du0_m_s2": "dbase_y_m_s2"}.get(name, name): x for name, x in given.items()}
    new, old = (read_recording(write_csv(tmp_path / f"{i}.csv", columns), a) for i, columns in enumerate((renamed, given)))
    np.testing.assert_array_equal(new.u0, old.u0)
    np.testing.assert_array_equal(new.du0, old.du0)


def test_two_columns_of_the_same_that_differ_are_refused(tmp_path):
    a = arm(1)
    given = columns(surrounded(a))
    path = write_csv(tmp_path / "run.csv", {**given, "base_y_m_s": given["u0_m_s"] + 0.1})
    with pytest.raises(RecordingError, match=r"'u0_m_s' and 'base_y_m_s' mean the same and differ"):
        read_recording(path, a)


def test_a_heading_without_its_rate_is_refused(tmp_path):
    a = arm(1)
    given = columns(surrounded(a), without=("base_yaw_rad_s", "dbase_yaw_rad_s2"))
    path = write_csv(tmp_path / "run.csv", {**given, "base_yaw_rad": 0.1 * given["t_s"]})
    with pytest.raises(RecordingError, match="add its derivative 'base_yaw_rad_s'"):
        read_recording(path, a)


def test_accelerations_of_base_and_water_are_derived_where_they_are_not_given():
    r = surrounded(arm(2))
    (known,) = prepare(r, GIVEN)
    (derived,) = prepare(replace(r, dbase=None, dcurrent=None), Preparation(None))
    for key in ("dbase", "dcurrent"):
        np.testing.assert_allclose(getattr(derived, key)[5:-5], getattr(known, key)[5:-5], atol=1e-4)


def test_the_heading_is_the_integral_of_the_yaw_rate_also_behind_a_gap():
    r = surrounded(arm(1))
    kept = r.rows((r.t < 1.5) | (r.t > 2.2), "gap")
    *_, after = prepare(kept, GIVEN)
    wanted = 0.5 / 0.7 * (1 - np.cos(0.7 * after.t))
    np.testing.assert_allclose(after.heading, wanted, atol=0.02)


def test_coefficients_are_found_on_a_base_that_moves_in_water_that_flows(tmp_path):
    a = arm(2)
    runs = [surrounded(a, f"run{i}", i + 1) for i in range(3)]
    exact = identify(Campaign.of(a, runs), "constant", seed=0).fit["parameters"]
    found = identify(open_campaign(written(a, tmp_path / "c", runs)), "constant").fit["parameters"]
    for link, C_D, C_M in ((1, 0.9, 0.8), (2, 1.3, 0.6)):
        for fit in (exact, found):
            assert fit[f"normal_drag.C_D[{link}]"]["value"] == pytest.approx(C_D, abs=0.02)
            assert fit[f"added_mass.C_M[{link}]"]["value"] == pytest.approx(C_M, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["network", "hybrid"])
def test_networks_see_base_and_water(kind):
    a = arm(2)
    runs = [surrounded(a, f"run{i}", i + 1) for i in range(4)]
    model = train(Campaign.of(a, runs), TINY.model_copy(update={"model": kind}))
    seen, blind = (predict(model, r.without_torque()).tau for r in (runs[0], replace(runs[0], current=None, dcurrent=None)))
    assert np.isfinite(seen).all()
    assert float(np.abs(seen - blind).max()) > 0.1 * float(np.abs(seen).max())


def test_a_prediction_uses_base_and_water(tmp_path):
    a = arm(2)
    runs = [surrounded(a, f"run{i}", i + 1) for i in range(3)]
    model = identify(open_campaign(written(a, tmp_path / "c", runs)), "constant")
    r = read_recording(tmp_path / "c" / "recordings" / "run0.csv", a, torque=False)
    wrong, right = (float(np.abs(predict(model, x).tau - runs[0].tau).mean() / np.abs(runs[0].tau).mean())
                    for x in (replace(r, base=None, dbase=None, current=None, dcurrent=None), r))
    assert right < 0.03 < 0.2 < wrong


def test_runs_that_differ_only_in_the_base_do_not_repeat_each_other():
    a = arm(1)
    one = surrounded(a, "one")
    assert repeated_recordings(Campaign.of(a, [one, replace(one, name="two")])) == (("one", "two"),)
    assert not repeated_recordings(Campaign.of(a, [one, replace(one, name="two", base=2 * one.base)]))


def test_check_says_what_of_base_and_water_was_given_and_how_fast_it_makes_the_arm(tmp_path):
    a = arm(1)
    r = surrounded(a)
    found = survey(open_campaign(written(a, tmp_path / "c", [r], ("dbase_x_m_s2", "dbase_yaw_rad_s2"))))
    assert {"base", "current"} <= set(found.entries[0].given)
    assert "dbase" in found.entries[0].derived
    still = survey(Campaign.of(a, [replace(r, base=None, dbase=None, current=None, dcurrent=None)]))
    assert found.links[0].top_speed_m_s > still.links[0].top_speed_m_s + 0.2


@pytest.mark.parametrize(("channels", "names"), [
    ({}, []), ({"current": (0.1, 0.0)}, ["measured current"]), ({"base": (0.2, 0.0)}, ["base motion along +X"]), ({"base": (0.0, 0.0)}, []),
    ({"base": (0.0, 0.1), "current": (0.0, 0.1)}, ["heading of the base", "measured current"])])
def test_a_model_s_record_says_what_moved_besides_the_joints_and_the_carriage(channels, names):
    a = arm(1)
    runs = [recording(a, planted(a), f"run{i}", i, speed=0.3) for i in range(2)]
    runs = [replace(r, **{name: np.tile(x, (len(r), 1)) for name, x in channels.items()}) for r in runs]
    assert identify(Campaign.of(a, runs), "constant").fit[DOMAIN]["surroundings"] == names
