"""What a benchmark says of its numbers: who won, against whom, and which command comes next."""

import subprocess
from dataclasses import replace

import numpy as np
import pytest
from rigs import arm
from standings import benchmark_of, misfit, standing

from nnhydro.evaluation.benchmark_result import Standing
from nnhydro.evaluation.interval_coverage import Coverage
from nnhydro.fitting.config import read_config
from nnhydro.models.baselines import baseline
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.recordings.filtering.preprocessing import Preparation


def test_a_unit_that_is_held_out_again_counts_with_its_last_fold():
    twice = Standing("x", [{"a": misfit(0.5)}, {"a": misfit(0.1)}])
    assert twice.pooled.error == pytest.approx(0.1)


def test_folds_add_up():
    first, second = (Standing("x", [fold], 2.0) for fold in standing("x", 0.1, 0.2, 0.3).by_fold)
    first.add(second)
    assert first.pooled.error == pytest.approx(0.2)
    assert first.fit_s == 4.0


def test_the_verdict_names_the_best_and_how_much_better_it_is():
    clear = benchmark_of(constant=0.2, hybrid=0.05).verdict()
    assert "hybrid predicts the torques best: 5.0 % error, 4.0 times better than constant (20.0 %)" in clear
    assert "not clearly better than constant" in benchmark_of(constant=0.051, hybrid=0.05).verdict()
    assert benchmark_of(constant=0.6, hybrid=0.55).verdict().startswith("No model explains these torques: the best, hybrid, leaves 55.0 %")


def test_what_a_model_had_seen_is_named_in_the_verdict():
    text = replace(benchmark_of(constant=0.1), seen={"old": ("a", "b")}, noise_floor=0.02).verdict()
    assert "a perfect model would leave 2.0 %" in text
    assert text.endswith("2 recordings not compared, because old had been fitted to them: a, b.")


@pytest.mark.parametrize(("errors", "floor", "command"), [
    ({"constant": 0.2}, None, "nnhydro diagnose"), ({"constant": 0.04}, None, "nnhydro identify"),
    ({"hybrid": 0.04}, None, "nnhydro train"), ({"gp": 0.04}, None, "nnhydro diagnose"),
    ({"constant": 0.08}, 0.05, "nnhydro identify"), ({"constant": 0.11}, 0.05, "nnhydro diagnose")])
def test_the_command_that_comes_next_asks_what_is_missing_where_much_is_left(errors, floor, command):
    assert replace(benchmark_of(**errors), noise_floor=floor).following("tank").startswith(command)


def test_the_command_after_a_network_that_won_trains_a_network(tmp_path):
    command = benchmark_of(network=0.04).following("tank")
    wrote, trains = command.partition("   ")[0].split(" && ")
    subprocess.run(wrote, shell=True, check=True, cwd=tmp_path)
    assert read_config(tmp_path / "network.toml").model == "network"
    assert trains == "nnhydro train tank --config network.toml --out my_model"


def test_errors_and_widths_are_those_of_a_fold():
    made = benchmark_of(constant=0.1)
    made.standings["constant"] = standing("constant", 0.1, 0.2, 0.4)
    assert made.fold_errors(0)["constant"] == pytest.approx(0.1)
    assert made.fold_errors(1)["constant"] == pytest.approx(0.3)
    assert made.folds == ((0,), (1, 2))
    held_out, fitted = Coverage(np.zeros(3), 4, 2.0, 4.0), Coverage(np.zeros(3), 4, 1.0, 4.0)
    made.standings["constant"].coverage, made.standings["constant"].fitted_coverage = [held_out], [fitted]
    assert made.fold_wider(0) == {"constant": 2.0}
    assert made.fold_wider(1) == {}


def test_coefficients_that_no_cylinder_has_are_named_once():
    a = arm(1)
    fitted = [StripTheory(a, Preparation(None), {}, "constant", baseline("constant").start(a).with_linear(
        np.array([*RigidBody.of_arm(a).linear_values().tolist(), C_D, 0.9]))) for C_D in (0.011, 1.1)]
    said = []
    for model in fitted:
        result = benchmark_of(constant=0.01, hybrid=0.02)
        result.standings["constant"].models[:] = [model, model]
        said.append(result.verdict())
    assert said[0].count("C_D[1] = 0.011 (cylinders have 0.3 to 2.5): check diameters, lengths, units") == 1
    assert "cylinders" not in said[1]
