"""A concealed world as the truth of a recipe: the blind tests' own torques, their own equation of motion, or a clear refusal."""

import copy
import warnings
from functools import cache

import numpy as np
import pytest
from concealed_worlds import (
    ARM,
    GAINS,
    QUICK,
    RATE,
    SLEW,
    SMALL,
    STILL,
    knows_all_but_what_is_hidden,
    law,
    recipe,
    reference,
    truth,
    whole_run,
    world,
)

from nnhydro.blind_tests.conceal import write_concealed
from nnhydro.blind_tests.truth import registry
from nnhydro.blind_tests.truth.campaign import MORNING, Wish, draw_campaign
from nnhydro.blind_tests.truth.tank import joint_torque, motor_torque, read
from nnhydro.blind_tests.truth.world import TrueArm
from nnhydro.cli.main import run as command
from nnhydro.diagnosis.calibration.planned_campaign import baseline_recipe
from nnhydro.errors import ConfigError
from nnhydro.recordings.arm import parse_arm
from nnhydro.recordings.campaign import open_campaign
from nnhydro.simulation.campaign_writer import record_runs, runs, write_campaign
from nnhydro.simulation.native_loop import track
from nnhydro.simulation.recipe import concealed_truth
from nnhydro.simulation.recipe.recipe import parse_recipe, read_recipe
from nnhydro.simulation.sensors import Sensors, record

REMEMBERS = {"wake_development", "flow_memory", "wake_reentry", "history_force", "vortex_shedding", "coulomb_friction",
             "stribeck_friction", "joint_elasticity", "backlash", "oscillating_mass", "flexible_mount", "unlisted:kick",
             "unlisted:cable_slap", "unlisted:warm_seal", "unlisted:slosh"}
EVERY = [*registry.names(), *registry.names("base_form"), *registry.names("unlisted")]


@pytest.fixture(scope="module", autouse=True)
def drawn_once():
    """The same concealed world is not searched for again."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(concealed_truth, "draw_world", cache(concealed_truth.draw_world))
        yield


@pytest.mark.usefixtures("no_rivals")
@pytest.mark.slow(seconds=2)
@pytest.mark.parametrize("effect", ["link_interference", "wake_development", "history_force", "torque_gain", "joint_elasticity", "none"])
def test_along_the_motions_of_the_blind_test_its_sealed_torques_come_out(effect, tmp_path):
    """The answer of `conceal` is computed on its own grid from its own motion; the recipe follows that motion from a file."""
    made = draw_campaign(3, 0, Wish(effect, links=2, size="small"))
    for name, unseen in made.unseen.items():
        run = unseen.run
        table = np.column_stack([run.t, np.cumsum(run.q, axis=1) if unseen.arm.belt else run.q, run.u0])
        np.savetxt(tmp_path / f"{name}.csv", table, delimiter=",", header="t_s,q1_rad,q2_rad,u0_m_s", comments="")
    motions = [{"kind": "file", "name": name, "file": f"{name}.csv"} for name in made.unseen]
    recipe = parse_recipe({"truth": {"concealed": {**SMALL, "effect": effect}}, "motions": motions, "sample_rate_hz": 50, "substeps": 2},
                          "recipe", tmp_path)
    assert recipe.arm.document() == parse_arm(made.arm, "arm").document()
    for found in record_runs(recipe):
        wanted = np.array(made.answer["unseen"][found.name]["tau_Nm"])
        error = np.sqrt(((found.clean - wanted) ** 2).mean(axis=0) / (wanted**2).mean(axis=0))
        assert (error[: len(wanted)] < 0.01).all(), error


def unlike(name, count=3):
    """The worlds of the first seeds that hide `name` in another shape or at another joint."""
    made = [world(name, seed=seed) for seed in range(count)]
    return list({(w.causes[0].shape, w.causes[0].joint): w for w in reversed(made)}.values())


@pytest.mark.slow(seconds=1)
@pytest.mark.parametrize("name", EVERY)
def test_every_effect_is_simulated_along_its_motion_and_stepped_exactly_or_refused(name):
    """What is stepped obeys the truth's equation over the whole run, with every memory that the truth's code has."""
    goal = {"m": reference()}
    for made in unlike(name):
        of = truth(made)
        of.require_possible(goal, QUICK, False, "recipe")
        (exact,) = of.runs(goal, None, QUICK, 1)
        assert np.isfinite(exact.tau).all()
        assert len(exact.tau) == 61
        if name in REMEMBERS:
            with pytest.raises(ConfigError, match=r"recipe: truth\.concealed: .*: use 'controller: none'"):
                of.require_possible(goal, QUICK, True, "recipe")
            continue
        of.require_possible(goal, QUICK, True, "recipe")
        run = track("m", goal["m"], of.loop_arm("m"), law(of), QUICK, 1)
        whole = whole_run("m", run.state, QUICK, of.loop_arm("m").run.seed)
        np.testing.assert_allclose(joint_torque(whole, of.world.arm, of.world.causes), run.tau, atol=1e-9 * np.abs(run.tau).max())


@pytest.mark.slow
def test_what_computed_torque_leaves_vanishes_with_the_size_of_what_is_hidden():
    """The model inside knows the arm but not the effect: the error is proportional to the effect, and next to none without it."""
    goal = reference()

    def tracked(share):
        of = truth(world("tip_drag" if share else "", share))
        run = track("m", goal, of.loop_arm("m"), law(of, knows_all_but_what_is_hidden(of)), RATE, 1)
        return run.state.q - goal.at(run.t).q, [cause.parameters["cd_area"][0] for cause in of.world.causes]

    (nothing, _), (small, (a,)), (large, (b,)) = (tracked(share) for share in (0.0, 0.4, 0.5))
    left = [np.abs(error - nothing).max() for error in (small, large)]
    assert left[1] / left[0] == pytest.approx(b / a, rel=0.1)
    assert np.abs(nothing).max() < 0.3 * np.abs(large).max(), "what is left without it comes from holding the torque for 5 ms"


@pytest.mark.slow
def test_a_wrong_torque_sensor_changes_what_is_recorded_and_not_how_the_arm_moves():
    goal = {"m": reference()}
    healthy, wrong = (truth(world(name, 0.9)) for name in ("", "torque_gain"))
    (plain,), (read_wrong,) = (of.runs(goal, law(of), RATE, 1) for of in (healthy, wrong))
    np.testing.assert_array_equal(read_wrong.state.q, plain.state.q)
    (cause,) = wrong.world.causes
    off = (read_wrong.tau - plain.tau)[:, cause.joint - 1]
    assert np.sign(off @ plain.tau[:, cause.joint - 1]) == np.sign(cause.parameters["gain"][0] - 1)
    assert np.abs(off).max() > 0.05 * np.abs(plain.tau[:, cause.joint - 1]).max()


def test_a_drift_goes_on_from_recording_to_recording_and_the_clock_tells_when():
    goal = {name: reference(STILL) for name in ("a", "b", "c")}
    warming = next(made for made in (world("torque_drift", 0.9, seed) for seed in range(9)) if made.causes[0].shape == "plain")
    drift, none = (list(truth(made).runs(goal, None, RATE, 1)) for made in (warming, world("")))
    off = [float(np.abs(d.tau - n.tau).mean()) for d, n in zip(drift, none, strict=True)]
    assert off[1] > off[0] + 1e-3
    assert off[2] > off[1] + 1e-3
    assert [run.start for run in drift] == pytest.approx([MORNING, MORNING + 240.6, MORNING + 481.2])


def test_a_belt_is_recorded_as_its_motors_feel_and_see_it():
    of, goal = truth(world("link_interference", arm=TrueArm(ARM.links, belt=True))), {"m": reference(of=TrueArm(ARM.links, belt=True))}
    (run,) = of.runs(goal, None, RATE, 1)
    seen = record(run, of.arm, Sensors(), 1, np.random.default_rng(0))
    state = goal["m"].at(run.t)
    wanted = motor_torque(joint_torque(whole_run("m", state, RATE, 0), of.world.arm, of.world.causes), of.world.arm)
    np.testing.assert_allclose(seen.clean, wanted, atol=1e-12)
    np.testing.assert_allclose(seen.motion["q2_rad"], state.q.sum(axis=1), atol=1e-12)


def test_the_chance_of_a_run_follows_from_the_recipes_seed_and_its_name():
    goal = {"a": reference(), "b": reference()}
    hum = world("unlisted:hum")
    (a, b), (again, _), (other, _) = (truth(hum, seed).runs(goal, None, RATE, 1) for seed in (5, 5, 6))
    np.testing.assert_array_equal(a.tau, again.tau)
    assert np.abs(a.tau - b.tau).max() > 1e-3
    assert np.abs(a.tau - other.tau).max() > 1e-3


def test_the_readings_are_those_of_the_blind_tests_own_chain():
    of, goal = truth(world("joint_elasticity", 0.6)), {"m": reference()}
    (run,) = of.runs(goal, None, RATE, 1)
    seen = read(whole_run("m", goal["m"].at(run.t), RATE, 0), of.world.arm, of.world.causes)
    assert np.abs(run.state.q - goal["m"].at(run.t).q).max() > 1e-3, "the drive runs ahead of the link"
    for got, want in ((run.state.q, seen.q), (run.state.qd, seen.qd), (run.state.qdd, seen.qdd), (run.tau, seen.tau)):
        np.testing.assert_array_equal(got, want)


@pytest.mark.usefixtures("no_rivals")
@pytest.mark.slow
def test_the_campaign_hides_the_answer_and_the_recipe_in_it_makes_it_again(tmp_path):
    made = recipe(tmp_path, controller={"kind": "computed_torque", "model": "constant", **GAINS}, sensors={"torque_noise_Nm": 0.01},
                  motions=[copy.deepcopy(SLEW), {**SLEW, "name": "n"}], unseen=["n"])
    write_campaign(made, tmp_path / "tank")
    write_campaign(read_recipe(tmp_path / "tank" / "recipe.yaml"), tmp_path / "again")
    files = {path.relative_to(tmp_path / "tank"): path for path in (tmp_path / "tank").rglob("*") if path.is_file()}
    for name, path in files.items():
        assert path.read_bytes() == (tmp_path / "again" / name).read_bytes()
        assert ("interference" in path.read_text()) == (name.name == "recipe.yaml")
    write_concealed(tmp_path / "blind", draw_campaign(3, 0, Wish("link_interference", links=2, size="small")))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        tank, blind = (open_campaign(tmp_path / name) for name in ("tank", "blind"))
    assert tank.arm.document() == blind.arm.document()
    assert next(iter(tank.recordings())).clock is not None
    assert made.truth_names == ("concealed",)
    planned, left_off = baseline_recipe(made, None)
    assert (planned.concealed, left_off) == (None, ("concealed",))
    assert len(list(runs(planned))) == 2


@pytest.mark.parametrize(("keys", "message"), [
    ({"concealed": {"effect": "link_interferance"}}, r"truth\.concealed\.effect link_interferance: not known: did you mean"),
    ({"concealed": {"links": 1}}, r"truth\.concealed\.effect link_interference: needs two links: leave truth\.concealed\.links out"),
    ({"concealed": {"links": 3}}, r"truth\.concealed\.links 3: choose 1 or 2"),
    ({"concealed": {"strength": "huge"}}, r"truth\.concealed\.strength huge: not known"),
    ({"concealed": {"index": 999}}, r"truth\.concealed\.index: must be at most 998"),
    ({"concealed": {"joint": 1}}, r"unknown key 'truth\.concealed\.joint'"),
    ({"truth": {"conceald": SMALL}}, r"unknown key 'truth\.conceald': did you mean 'concealed'\?"),
    ({"terms": {"normal_drag": "start"}}, "leave out arm and terms"),
    ({"motions": [SLEW, {"kind": "steady", "name": "grid", "u0_m_s": [0.3], "q_rad": [[0.0], [0.0]]}]}, "no steady tables: .* 'grid'"),
    ({"motions": [{**SLEW, "duration_s": 1500.0}]}, "motion 'm': .* steps are too many for a concealed world"),
    ({"concealed": {"effect": "wake_development"}, "controller": {"kind": "pd", "kp": 1.0}}, r"truth\.concealed: .* 'controller: none'"),
    ({"concealed": {"effect": "backlash"}, "controller": {"kind": "pd", "kp": 1.0}}, "between drive and link"),
])
def test_what_cannot_be_simulated_is_refused_in_one_line_with_its_key(keys, message, tmp_path):
    with pytest.raises(ConfigError, match=message) as refusal:
        recipe(tmp_path, **keys)
    assert str(refusal.value).startswith("tank.yaml: ")
    assert "\n" not in str(refusal.value)


def test_the_command_ends_with_2_and_one_line(tmp_path, capsys):
    (tmp_path / "tank.yaml").write_text("truth: {concealed: {effect: nothing}}\nmotions: [{kind: slew, name: m, q_rad: [[0], [1]]}]\n")
    assert command(["simulate", str(tmp_path / "tank.yaml"), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "tank.yaml: truth.concealed.effect nothing: not known" in error
    assert not (tmp_path / "out").exists()
