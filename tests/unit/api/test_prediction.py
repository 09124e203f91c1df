"""Predicted torques: a sentence with their range, the first rows as text, all of them as a frame and as a file."""

import numpy as np
import pandas as pd

from nnhydro.api.prediction import SHOWN, Prediction

T = np.arange(12) / 10
TAU = np.column_stack([np.linspace(-1, 2, 12), np.linspace(0, 0.5, 12)])
MADE = Prediction("run1", T, TAU, 0.1 * np.ones_like(TAU), outside=np.linspace(0, 1, 12))


def test_the_sentence_gives_the_range_of_each_joint():
    assert MADE.verdict() == "run1, 12 rows: joint 1 -1 to 2 N m, joint 2 0 to 0.5 N m."


def test_a_carriage_that_is_driven_has_a_force():
    assert "N m" not in Prediction("run1", T, TAU[:, :1], None, sliding=True).verdict()


def test_text_shows_the_first_rows_and_the_frame_all():
    (sheet,) = MADE.sheets()
    assert len(sheet) == SHOWN < len(MADE.to_frame()) == len(MADE) == 12
    assert list(MADE.to_frame()) == ["t_s", "tau1_Nm", "tau2_Nm", "tau1_std_Nm", "tau2_std_Nm", "outside"]


def test_the_file_holds_what_the_frame_holds(tmp_path):
    written = pd.read_csv(MADE.save(tmp_path / "torque.csv"))
    assert list(written) == list(MADE.to_frame())
    np.testing.assert_allclose(written, MADE.to_frame(), rtol=1e-6, atol=1e-9)
