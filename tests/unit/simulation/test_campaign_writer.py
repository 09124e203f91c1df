"""From a recipe to a campaign: sensors as asked, the same bytes for the same seed, readable by the rest, clear refusals."""

import copy
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nnhydro.errors import NnhydroError
from nnhydro.physics.load_term import term_kinds
from nnhydro.recordings.campaign import open_campaign
from nnhydro.recordings.readers.files import read_recording
from nnhydro.simulation.campaign_writer import record_runs, runs, write_campaign
from nnhydro.simulation.recipe.recipe import Recipe, parse_recipe, read_recipe
from nnhydro.simulation.sensors import Sensors, record

LINK = {"length_m": 0.5, "diameter_m": 0.06, "mass_kg": 1.2, "com_m": 0.25, "inertia_kg_m2": 0.025}
BASE: dict[str, Any] = {
    "schema": "nnhydro/recipe/1", "seed": 3, "sample_rate_hz": 100,
    "arm": {"fluid": {"density_kg_m3": 1000.0}, "links": [LINK, LINK]},
    "terms": {"normal_drag": {"C_D": [1.0, 0.9]}, "added_mass": {"C_M": 0.8}},
    "sensors": {"torque_noise_Nm": 0.02, "encoder_counts_per_rev": 65536},
    "motions": [
        {"kind": "slew", "name": "reach", "q_rad": [[0, 0], [1, -0.5]], "duration_s": 1.5},
        {"kind": "fourier", "name": "swim", "q_rad": [0, 0.3], "duration_s": 6, "reach_rad": 1.0, "rate_rad_s": 1.5,
         "carriage": {"u0_m_s": 0.3, "ramp_s": 0}},
        {"kind": "steady", "name": "grid", "u0_m_s": [0.3, 0.8], "q_rad": [[-0.5, 0.0, 0.5], [0.2]]},
        {"kind": "tow", "name": "last", "q_rad": [0.3, 0.1], "hold_s": 1, "carriage": {"u0_m_s": 0.5}},
    ],
    "unseen": ["last"],
}
BELT = {**BASE["arm"], "drive": {"kind": "remote", "pulley_ratio": 1.5, "angle2": "absolute"}}


def recipe(**changes: Any) -> Recipe:
    return parse_recipe({**copy.deepcopy(BASE), **changes}, "recipe", Path())


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_the_campaign_opens_and_its_derived_rates_are_the_true_ones(tmp_path: Path) -> None:
    made = recipe()
    write_campaign(made, tmp_path / "tank")
    campaign = open_campaign(tmp_path / "tank")
    assert campaign.names == ("reach", "swim")
    assert len(campaign.steady[0]) == 6
    assert campaign.steady[0].tau_std is not None
    how = campaign.plan()
    for name in campaign.names:
        (segment,) = campaign.segments(name, how)
        true = made.references[name].at(segment.t)
        error = (segment.qd - true.qd)[segment.keep]
        assert np.sqrt((error**2).mean()) < 0.002 * np.abs(true.qd).max()  # measured 0.05 %
        np.testing.assert_allclose(segment.u0, true.u0, atol=1e-6)


def test_unseen_motions_hold_no_torque_and_their_answers_do(tmp_path: Path) -> None:
    made = recipe()
    write_campaign(made, tmp_path / "tank")
    assert "tau" not in (tmp_path / "tank/unseen/last.csv").read_text().splitlines()[0]
    seen = read_recording(tmp_path / "tank/unseen/last.csv", made.arm, torque=False)
    answer = np.genfromtxt(tmp_path / "tank/answers/last.csv", delimiter=",", names=True)
    assert answer.dtype.names == ("t_s", "tau1_Nm", "tau2_Nm", "tau1_clean_Nm", "tau2_clean_Nm")
    np.testing.assert_array_equal(answer["t_s"], seen.t)
    assert np.std(answer["tau1_Nm"] - answer["tau1_clean_Nm"]) == pytest.approx(0.02, rel=0.2)


def test_one_seed_gives_one_set_of_bytes_and_the_recipe_in_the_folder_gives_them_again(tmp_path: Path) -> None:
    t = np.linspace(0, 3, 301)
    np.savetxt(tmp_path / "way.csv", np.column_stack([t, 0.2 * np.sin(t), 0 * t]), delimiter=",", header="t_s,q1_rad,q2_rad", comments="")
    document = {**BASE, "motions": [*BASE["motions"], {"kind": "file", "name": "way", "file": "way.csv"}]}
    made = parse_recipe(document, "recipe", tmp_path)
    for folder in ("a", "b"):
        write_campaign(made, tmp_path / folder)
    write_campaign(read_recipe(tmp_path / "a/recipe.yaml"), tmp_path / "c")
    write_campaign(parse_recipe({**document, "seed": 4}, "recipe", tmp_path), tmp_path / "d")
    a, b, c, d = (contents(tmp_path / folder) for folder in "abcd")
    assert a == b == c
    assert a["recordings/reach.csv"] != d["recordings/reach.csv"]


def test_a_recording_does_not_depend_on_which_others_there_are_or_on_their_order() -> None:
    all_four = {r.name: r for r in record_runs(recipe())}
    alone = {r.name: r for r in record_runs(recipe(motions=[BASE["motions"][3], BASE["motions"][1]], unseen=[]))}
    for name, seen in alone.items():
        for column, x in (seen.motion | seen.torque).items():
            np.testing.assert_array_equal(x, (all_four[name].motion | all_four[name].torque)[column])


def test_the_noise_is_as_strong_as_asked() -> None:
    long = [{"kind": "rotation", "name": "turn", "q_rad": [0, 0], "dq_rad_s": [0.5, 0.2], "hold_s": 100.0}]
    made = recipe(motions=long, unseen=[], sensors={"torque_noise_Nm": [0.03, 0.0], "torque_noise_share": [0.0, 0.05]})
    (seen,) = record_runs(made)
    noise = np.column_stack(list(seen.torque.values())) - seen.clean
    wanted = [0.03, 0.05 * np.sqrt((seen.clean[:, 1] ** 2).mean())]
    np.testing.assert_allclose(noise.std(axis=0), wanted, rtol=0.04)  # three standard errors of 10 000 samples
    assert abs(np.corrcoef(noise[1:, 0], noise[:-1, 0])[0, 1]) < 0.04


def _noiseless(**sensors: Any) -> tuple[Any, Any]:
    """The run of a slew and what the sensors record of it."""
    made = recipe(motions=BASE["motions"][:1], unseen=[], sensors=sensors)
    (run,) = runs(made)
    return run, record(run, made.arm, made.settings.sensors, made.settings.steps, np.random.default_rng(0))


def test_encoders_count_in_steps_and_perfect_sensors_read_the_truth() -> None:
    run, perfect = _noiseless()
    np.testing.assert_allclose(perfect.torque["tau1_Nm"], run.tau[::10, 0], atol=1e-12)
    np.testing.assert_allclose(perfect.motion["q1_rad"], run.state.q[::10, 0], atol=1e-12)
    _, coarse = _noiseless(encoder_counts_per_rev=360)
    counts = np.degrees(coarse.motion["q1_rad"])
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    assert np.abs(coarse.motion["q1_rad"] - perfect.motion["q1_rad"]).max() <= np.pi / 360 + 1e-12


def test_torque_arrives_late_biased_and_smoothed_as_asked() -> None:
    run, late = _noiseless(torque_delay_s=0.03, torque_bias_Nm=[0.5, -0.2])
    np.testing.assert_allclose(late.torque["tau1_Nm"][3:], run.tau[::10, 0][:-3] + 0.5, atol=1e-9)
    _, slow = _noiseless(torque_low_pass_hz=5.0, torque_low_pass_order=1)
    lag = 1 / (2 * np.pi * 5.0)  # s, of a first-order low-pass at low frequencies
    t = slow.motion["t_s"]
    smooth = np.interp(t - lag, run.t, run.tau[:, 0])
    assert np.abs(slow.torque["tau1_Nm"] - smooth).max() < 0.1 * np.abs(run.tau[:, 0]).max()
    assert np.abs(slow.torque["tau1_Nm"] - smooth).max() < 0.5 * np.abs(slow.torque["tau1_Nm"] - run.tau[::10, 0]).max()


def test_jitter_and_dropouts_change_which_instants_are_seen_not_the_motion() -> None:
    run, seen = _noiseless(jitter_s=5e-4, dropout_share=0.2, dropout_s=0.05, velocities=True, accelerations=True)
    t = seen.motion["t_s"]
    assert (np.diff(t) > 0).all()
    assert 0.65 < len(t) / len(run.t[::10]) < 0.95
    np.testing.assert_allclose(seen.motion["q2_rad"], np.interp(t, run.t, run.state.q[:, 1]), atol=2e-6)
    np.testing.assert_allclose(seen.motion["dq2_rad_s"], np.interp(t, run.t, run.state.qd[:, 1]), atol=2e-5)


def test_behind_a_belt_the_second_channel_is_the_motors_angle_and_the_sensors_see_motor_torques(tmp_path: Path) -> None:
    made = recipe(arm=BELT, sensors={"velocities": True})
    write_campaign(made, tmp_path / "tank")
    direct = {run.name: run for run in runs(recipe())}["reach"]
    table = np.genfromtxt(tmp_path / "tank/recordings/reach.csv", delimiter=",", names=True)
    np.testing.assert_allclose(table["q2_rad"], direct.state.q[::10, 0] + direct.state.q[::10, 1] / 1.5, atol=1e-8)
    np.testing.assert_allclose(table["tau1_Nm"], (direct.tau[:, 0] - 1.5 * direct.tau[:, 1])[::10], atol=1e-8)
    read = open_campaign(tmp_path / "tank").load("reach")
    np.testing.assert_allclose(read.q, direct.state.q[::10], atol=1e-8)
    assert read.qd is not None
    np.testing.assert_allclose(read.qd, direct.state.qd[::10], atol=1e-7)


def test_steady_means_scatter_less_the_longer_the_run_and_their_std_is_the_sensors() -> None:
    grid = {"kind": "steady", "name": "grid", "u0_m_s": np.linspace(0.3, 1.2, 400).tolist(), "q_rad": [[0.1], [0.2]], "duration_s": 1.0}
    (table,) = record_runs(recipe(motions=[grid], unseen=[], sensors={"torque_noise_Nm": 0.1}))
    assert np.std(table.torque["tau1_Nm"] - table.clean[:, 0]) == pytest.approx(0.01, rel=0.15)
    assert table.torque["tau1_std_Nm"].mean() == pytest.approx(0.1, rel=0.02)


@pytest.mark.parametrize("kind", sorted(term_kinds()))
def test_every_load_term_can_be_part_of_the_truth(kind: str) -> None:
    (run,) = runs(recipe(motions=BASE["motions"][:1], unseen=[], terms={kind: "start"}))
    assert np.isfinite(run.tau).all()


def test_a_term_may_stand_there_twice_under_names_of_its_own() -> None:
    plain = recipe(terms={"normal_drag": {"C_D": 1.0}})
    two = recipe(terms={"near": {"kind": "normal_drag", "C_D": 0.4}, "far": {"kind": "normal_drag", "C_D": [0.6, 0.6]}})
    np.testing.assert_allclose(next(runs(two)).tau, next(runs(plain)).tau, atol=1e-12)


@pytest.mark.slow
def test_a_controlled_campaign_comes_from_the_same_recipe(tmp_path: Path) -> None:
    short = {"kind": "slew", "name": "reach", "q_rad": [[0, 0], [0.3, -0.15]], "duration_s": 0.3, "rest_s": 0.05}
    made = recipe(controller={"kind": "pd", "kp": 60, "kd": 6, "torque_limit_Nm": 30}, motions=[short], unseen=[])
    (run,) = runs(made)
    followed = made.references["reach"].at(run.t).q
    assert 1e-3 < np.abs(run.state.q - followed).max() < 0.3


def _without(key: str) -> dict[str, Any]:
    return {k: v for k, v in BASE.items() if k != key}


@pytest.mark.parametrize(("document", "message"), [
    ({**BASE, "sead": 1}, "recipe: unknown key 'sead': did you mean 'seed'"),
    (_without("arm"), "key 'arm' is missing"),
    ({**BASE, "terms": {"normal_drg": {"C_D": 1}}}, "terms.normal_drg: 'normal_drg' is not a load term: did you mean 'normal_drag'"),
    ({**BASE, "terms": {"normal_drag": {"C_D": [1, 2, 3]}}}, r"terms.normal_drag.C_D: 3 number\(s\) for this arm: give 2"),
    ({**BASE, "terms": {"normal_drag": {"C_D": float("nan")}}}, "terms.normal_drag.C_D: nan is not a finite number"),
    ({**BASE, "terms": {"normal_drag": {"C_D": -1}}}, "outside what physics allows"),
    ({**BASE, "terms": {"normal_drag": {}}}, "C_D is missing: cross-flow drag coefficient"),
    ({**BASE, "terms": {"normal_drag": {"C_D": 1, "cd": 2}}}, "unknown key 'cd' of normal_drag: did you mean 'C_D'"),
    ({**BASE, "terms": {"added_mass": {"C_M": 1, "reading": "odd"}}}, "terms.added_mass: .*'odd' is not one of document"),
    ({**BASE, "limits": {"q_rad": [[-1, 0.8], [-2, 2]]}}, "motion 'reach': q1_rad = .* at t = .* is outside the limits -1 to 0.8"),
    ({**BASE, "limits": {"u0_m_s": 0.2}}, "motion 'swim': u0_m_s = 0.3"),
    ({**BASE, "motions": [BASE["motions"][0]] * 2, "unseen": []}, "two motions are called 'reach'"),
    ({**BASE, "unseen": ["nobody"]}, "unseen: 'nobody' is not a motion"),
    ({**BASE, "controller": "pid"}, "controller: must be 'none' or a mapping"),
    ({**BASE, "controller": {"kind": "pd", "kp": [1, 2, 3], "kd": 1}}, "controller.kp: 3 numbers for an arm of 2"),
    ({**BASE, "controller": {"kind": "pd", "kp": 1, "kd": 1, "rate_hz": 333}}, "rate_hz must divide"),
    ({**BASE, "sensors": {"jitter_s": 0.005}}, "sensors.jitter_s: .* more than a tenth of a sample"),
    ({**BASE, "sensors": {"torque_low_pass_hz": 600}}, "torque_low_pass_hz: must be below"),
    ({**BASE, "sensors": {"torque_noise_Nm": [1, 2, 3]}}, "sensors.torque_noise_Nm: 3 numbers"),
    ({**BASE, "seed": -1}, "seed"),
    ({**BASE, "arm": "nowhere.yaml"}, "nowhere.yaml: cannot be read"),
    ({**BASE, "sample_rate_hz": 10000, "motions": [{**BASE["motions"][3], "hold_s": 3600}]}, "too many steps"),
])
def test_a_recipe_that_cannot_be_is_refused_in_one_line(document: dict[str, Any], message: str) -> None:
    with pytest.raises(NnhydroError, match=message) as caught:
        parse_recipe(copy.deepcopy(document), "recipe", Path())
    assert "\n" not in str(caught.value)


def test_a_folder_of_somebody_else_is_left_alone(tmp_path: Path) -> None:
    measured = tmp_path / "measured"
    measured.mkdir()
    (measured / "arm.yaml").write_text("precious")
    with pytest.raises(NnhydroError, match="holds other files"):
        write_campaign(recipe(), measured)
    assert contents(measured) == {"arm.yaml": b"precious"}


@pytest.mark.slow
def test_a_failing_simulation_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_campaign(recipe(), tmp_path / "tank")
    before = contents(tmp_path)
    bad = recipe(controller={"kind": "pd", "kp": 1e5, "kd": 1e4}, motions=BASE["motions"][:1], unseen=[])
    with pytest.raises(NnhydroError, match="runs away"):
        write_campaign(bad, tmp_path / "tank")
    assert contents(tmp_path) == before


SCALAR = st.one_of(st.none(), st.booleans(), st.integers(-10**400, 10**400), st.floats(), st.text(max_size=5), st.sampled_from(
    ["start", "arm", "none", "pd", "slew", "tow", "fourier", "file", "steady", "rotation"]))
ANYTHING = st.recursive(
    SCALAR, lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(st.text(max_size=5), inner, max_size=3)), max_leaves=6)


def _paths(node: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [path, *(p for key, value in items for p in _paths(value, (*path, key)))]


def _verdict(document: dict[str, Any]) -> str:
    """Empty where the recipe is understood; anything but a NnhydroError passes through."""
    try:
        parse_recipe(document, "recipe", Path("/nonexistent"))
    except NnhydroError as error:
        return str(error)
    return ""


@pytest.mark.slow
@given(st.sampled_from(_paths(BASE)[1:]), ANYTHING, st.text(max_size=6))
@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_whatever_stands_in_a_recipe_it_is_understood_or_refused_in_one_line(path: tuple[Any, ...], value: Any, extra: str) -> None:
    document = copy.deepcopy(BASE)
    node: Any = document
    for key in path[:-1]:
        node = node[key]
    if isinstance(node, dict) and len(extra) == 3:
        node[extra] = value
    else:
        node[path[-1]] = value
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "\n" not in _verdict(document)


def test_the_recipe_of_the_manual_works_as_it_stands(tmp_path: Path) -> None:
    path = Path(__file__).parents[3] / "docs/examples/two_link_tank.yaml"
    made = write_campaign(read_recipe(path), tmp_path / "tank")
    assert len(made) == 8
    assert yaml.safe_load((tmp_path / "tank/recipe.yaml").read_text())["seed"] == 1
    assert len(open_campaign(tmp_path / "tank").names) == 6


def test_sensors_default_to_perfect() -> None:
    assert not Sensors().noise_std(np.ones((5, 2))).any()
