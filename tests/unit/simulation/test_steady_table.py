"""The table of steady runs: means, and the scatter within a run."""

import numpy as np
import pytest
from tank_recipes import recipe

from nnhydro.simulation.campaign_writer import record_runs


def test_steady_means_scatter_less_the_longer_the_run_and_their_std_is_the_sensors() -> None:
    grid = {"kind": "steady", "name": "grid", "u0_m_s": np.linspace(0.3, 1.2, 400).tolist(), "q_rad": [[0.1], [0.2]], "duration_s": 1.0}
    (table,) = record_runs(recipe(motions=[grid], unseen=[], sensors={"torque_noise_Nm": 0.1}))
    assert np.std(table.torque["tau1_Nm"] - table.clean[:, 0]) == pytest.approx(0.01, rel=0.15)
    assert table.torque["tau1_std_Nm"].mean() == pytest.approx(0.1, rel=0.02)
