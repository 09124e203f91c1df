"""From a recipe to a campaign: sensors as asked, the same bytes for the same seed, readable by the rest, clear refusals."""

from pathlib import Path

import numpy as np
import pytest
from tank_recipes import BASE, recipe

from nnhydro.errors import NnhydroError
from nnhydro.recordings.campaign import open_campaign
from nnhydro.recordings.readers.files import read_recording
from nnhydro.simulation.campaign_writer import record_runs, runs, write_campaign
from nnhydro.simulation.recipe.recipe import parse_recipe, read_recipe


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


@pytest.mark.slow
def test_a_controlled_campaign_comes_from_the_same_recipe(tmp_path: Path) -> None:
    short = {"kind": "slew", "name": "reach", "q_rad": [[0, 0], [0.3, -0.15]], "duration_s": 0.3, "rest_s": 0.05}
    made = recipe(controller={"kind": "pd", "kp": 60, "kd": 6, "torque_limit_Nm": 30}, motions=[short], unseen=[])
    (run,) = runs(made)
    followed = made.references["reach"].at(run.t).q
    assert 1e-3 < np.abs(run.state.q - followed).max() < 0.3


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
