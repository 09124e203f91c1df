"""A model says its parameters, predicts the same from every kind of motion, and is the same after it was saved."""

import numpy as np
import pandas as pd
import pytest
from campaigns import angles_only, columns_of, write_folder

import nnhydro


def test_a_model_finds_what_was_planted_and_says_it_in_a_frame(fitted):
    frame = fitted.to_frame().set_index("parameter")
    for name, truth in (("normal_drag.C_D[1]", 0.9), ("normal_drag.C_D[2]", 1.3), ("added_mass.C_M[1]", 0.8)):
        assert frame.loc[name, "value"] == pytest.approx(truth, abs=0.1)
        assert frame.loc[name, "ci95_low"] <= frame.loc[name, "value"] <= frame.loc[name, "ci95_high"]
    assert fitted.name == "constant"
    assert fitted.arm.n_links == 2


def test_a_model_predicts_the_same_from_a_recording_a_frame_and_a_file(fitted, healthy, tmp_path):
    run = angles_only(healthy.load("run1"))
    folder = write_folder(nnhydro.Campaign.of(healthy.arm, [run]), tmp_path / "c")
    frame = pd.DataFrame(columns_of(run))
    made = [fitted.predict(run), fitted.predict(frame), fitted.predict(folder / "recordings" / "run1.csv")]
    for other in made[1:]:
        np.testing.assert_allclose(other.tau, made[0].tau, rtol=1e-12, atol=1e-12)
    table = made[0].to_frame()
    assert list(table) == ["t_s", "tau1_Nm", "tau2_Nm", "outside"]
    assert len(table) == len(run) == len(made[0])
    written = pd.read_csv(made[0].save(tmp_path / "torque.csv"))
    np.testing.assert_allclose(written, table, rtol=1e-8)


def test_a_model_is_the_same_after_it_was_saved(fitted, healthy, tmp_path):
    again = nnhydro.load_model(fitted.save(tmp_path / "model"))
    np.testing.assert_array_equal(again.predict(healthy.load("run2")).tau, fitted.predict(healthy.load("run2")).tau)
    pd.testing.assert_frame_equal(again.to_frame(), fitted.to_frame())
