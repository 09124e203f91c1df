"""A prediction says what of it lies outside the training, and what looks wrong with its motion."""

import json
from dataclasses import replace

import numpy as np
import pytest
from campaigns import TINY, angles_only, campaign, columns_of, planted, recording, write_csv, write_folder
from rigs import arm

from nnhydro.cli.main import run
from nnhydro.fitting.identify import identify
from nnhydro.fitting.network.train import train
from nnhydro.models.domain import DOMAIN, Domain, domain_of
from nnhydro.models.prediction import predict
from nnhydro.models.storage import load_model, save_model
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.splitting import units

A = arm(2)


def runs(numbers, **keys):
    return [recording(A, planted(A), f"run{k}", seed=k, seconds=4.0, rate=50.0, **keys) for k in numbers]


@pytest.fixture(scope="module")
def whole():
    return Campaign.of(A, runs(range(1, 9)))


@pytest.fixture(scope="module")
def model(whole):
    return identify(whole, "constant")


def share(model, r):
    return predict(model, r.without_torque()).outside_share


def test_new_motions_of_the_same_kind_lie_inside(model):
    assert np.mean([share(model, r) for r in runs(range(20, 30))]) < 0.1


@pytest.mark.parametrize("change", [
    lambda r: replace(r, qd=8 * r.qd, qdd=64 * r.qdd), lambda r: replace(r, u0=np.full(len(r), 5.0), du0=np.zeros(len(r))),
    lambda r: replace(r, q=np.degrees(r.q), qd=np.degrees(r.qd), qdd=np.degrees(r.qdd))], ids=["eight times as fast", "towed", "degrees"])
def test_motions_of_another_kind_lie_outside(model, change):
    (r,) = runs([20])
    assert share(model, change(r)) > 0.8


def test_the_region_is_stored_with_the_model(model, tmp_path):
    (r,) = runs([20])
    loaded = load_model(save_model(model, tmp_path / "m"))
    np.testing.assert_array_equal(predict(loaded, r).outside, predict(model, r).outside)
    assert len(json.dumps(loaded.fit[DOMAIN])) < 100_000


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["network", "hybrid"])
def test_networks_know_their_region_too(whole, kind):
    model = train(whole, TINY.model_copy(update={"model": kind}))
    (r,) = runs([20])
    assert share(model, r) < 0.3
    assert share(model, replace(r, qd=8 * r.qd, qdd=64 * r.qdd)) > 0.8


def test_the_reach_is_that_of_held_out_recordings(whole):
    every = units(whole, whole.plan())
    few, many = domain_of(every[:2], A), domain_of(every, A)
    assert few.reach > many.reach > 0  # with fewer recordings a new one lies farther away, and that is no reason for alarm


def test_outside_grows_from_0_to_1_with_the_distance(model):
    (r,) = runs([20])
    values = [float(predict(model, replace(r, qd=k * r.qd, qdd=k**2 * r.qdd)).outside.max()) for k in (1, 4, 16, 64)]
    assert values == sorted(values)
    assert 0 <= values[0] < values[-1] <= 1
    assert values[-1] > 0.9


def test_a_model_that_does_not_say_says_nothing(model):
    (r,) = runs([20])
    assert predict(replace(model, fit={}), r).outside is None
    assert Domain.parse({"spread": [1.0], "points": [[1.0, 2.0]], "reach": 1.0}) is None


@pytest.fixture(scope="module")
def place(model, tmp_path_factory):
    root = tmp_path_factory.mktemp("place")
    save_model(model, root / "model")
    (r,) = runs([20])
    write_csv(root / "same.csv", columns_of(r, torque=False))
    write_csv(root / "degrees.csv", {k: np.degrees(x) if "rad" in k else x for k, x in columns_of(r, torque=False).items()})
    write_csv(root / "foreign.csv", {"time": r.t, "a": np.degrees(r.q[:, 0]), "b": np.degrees(r.q[:, 1])})
    (root / "map.yaml").write_text("columns: {t_s: time, q1_rad: {from: a, unit: deg}, q2_rad: {from: b, unit: deg}}\n")
    return root


def test_degrees_are_not_predicted_in_silence(place, tmp_path, capsys):
    """They used to give tens of thousands of newton metres, and exit 0."""
    assert run(["predict", str(place / "model"), str(place / "degrees.csv"), "--out", str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    assert "probably degrees" in err
    assert "100% of the rows lie outside what the model was trained on" in out
    header, *rows = (tmp_path / "degrees.csv").read_text().splitlines()
    assert header == "t_s,tau1_Nm,tau2_Nm,outside"
    assert min(float(row.split(",")[-1]) for row in rows) > 0


def test_strict_refuses_what_looks_wrong_or_lies_outside(place, tmp_path, capsys):
    assert run(["predict", str(place / "model"), str(place / "degrees.csv"), "--out", str(tmp_path / "t"), "--strict"]) == 2
    assert "probably degrees" in capsys.readouterr().err
    assert not (tmp_path / "t").exists()
    (r,) = runs([20])
    write_csv(tmp_path / "fast.csv", columns_of(replace(r, qd=8 * r.qd, qdd=64 * r.qdd, q=r.q), torque=False))
    assert run(["predict", str(place / "model"), str(tmp_path / "fast.csv"), "--out", str(tmp_path / "t"), "--strict"]) == 2
    (known,) = runs([3])
    write_csv(tmp_path / "known.csv", columns_of(known, torque=False))
    assert run(["predict", str(place / "model"), str(tmp_path / "known.csv"), "--out", str(tmp_path / "t"), "--strict"]) == 0


def test_rates_of_0_while_the_angles_move_are_said_and_strictly_refused(place, tmp_path, capsys):
    (r,) = runs([3])
    write_csv(tmp_path / "zero.csv", columns_of(replace(r, qd=0 * r.q, qdd=None), torque=False))
    command = ["predict", str(place / "model"), str(tmp_path / "zero.csv"), "--out", str(tmp_path / "t")]
    assert run([*command, "--strict"]) == 2
    assert "dq1_rad_s: is 0 throughout while q1_rad moves by" in capsys.readouterr().err
    assert run(command) == 0
    assert "warning zero: dq2_rad_s: is 0 throughout" in capsys.readouterr().err


def test_programs_read_the_share(place, tmp_path, capsys):
    assert run(["predict", str(place / "model"), str(place / "degrees.csv"), "--out", str(tmp_path), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["outside_share"] == [1.0]
    assert "degrees" in document["warnings"][0]


def test_a_motion_in_foreign_columns_is_predicted_with_a_mapping(place, tmp_path):
    assert run(["predict", str(place / "model"), str(place / "foreign.csv"), "--out", str(tmp_path / "a"), "--map",
                str(place / "map.yaml"), "--quiet"]) == 0
    (r,) = runs([20])
    write_csv(tmp_path / "plain.csv", columns_of(angles_only(replace(r, u0=None)), torque=False))
    assert run(["predict", str(place / "model"), str(tmp_path / "plain.csv"), "--out", str(tmp_path / "b"), "--quiet"]) == 0
    one, other = (np.loadtxt(tmp_path / name, delimiter=",", skiprows=1) for name in ("a/foreign.csv", "b/plain.csv"))
    np.testing.assert_allclose(one, other, atol=1e-6)


# what identify says of absurd fits

def test_identify_warns_of_coefficients_that_no_cylinder_has(tmp_path, capsys):
    thin = A.model_copy(update={"links": tuple(k.model_copy(update={"diameter_m": k.diameter_m / 4}) for k in A.links)})
    folder = write_folder(Campaign.of(thin, runs(range(1, 5), noise=0.02)), tmp_path / "c")
    assert run(["identify", str(folder), "--out", str(tmp_path / "m")]) == 0
    out = capsys.readouterr().out
    assert "warning C_D[1] = " in out
    assert "cylinders have 0.3 to 2.5" in out


def test_identify_warns_where_most_of_the_torque_is_left(tmp_path, capsys):
    rng = np.random.default_rng(1)
    nonsense = Campaign.of(A, [replace(r, tau=rng.standard_normal(r.tau.shape)) for r in runs(range(1, 5))])
    folder = write_folder(nonsense, tmp_path / "c")
    assert run(["identify", str(folder), "--out", str(tmp_path / "m")]) == 0
    out = capsys.readouterr().out
    assert "of the torque is left" in out
    assert f"Next: nnhydro check {folder}, then nnhydro diagnose" in out


def test_a_good_fit_raises_no_warning():
    assert identify(campaign(A, planted(A), 4, noise=0.02), "constant").fit["warnings"] == []
