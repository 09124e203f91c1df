"""One arm under control: it obeys its own equation, and the controller sees its encoders."""

import numpy as np
import pytest
from concealed_worlds import GAINS, QUICK, STILL, knows_all_but_what_is_hidden, law, reference, truth, whole_run, world

from nnhydro.simulation.controller import Controller
from nnhydro.simulation.native_loop import track


@pytest.mark.parametrize("control", [{"kind": "pd", "kp": 40.0, "kd": 5.0}, {"kind": "pid", "kp": 40.0, "kd": 5.0, "ki": 30.0},
                                     {"kind": "computed_torque", "model": "textbook", **GAINS},
                                     {"kind": "sliding_mode", "model": "constant", "kp": 3.0, "boundary": 1.0}], ids=lambda c: c["kind"])
def test_every_kind_of_controller_moves_the_arm_by_the_torques_of_its_sensors(control):
    """Late, limited and by encoder steps; what the sensors read of the run is what the controller ordered."""
    sees = {"encoder_counts_per_rev": 65536, "delay_s": 1 / QUICK, "torque_limit_Nm": [30.0, 6.0]}
    of, goal = truth(world("link_interference", 0.9)), {"m": reference()}
    made = Controller(**control, **sees).torque_law(of.arm, QUICK)
    ordered, (read_by_sensors,) = track("m", goal["m"], of.loop_arm("m"), made, QUICK, 1), of.runs(goal, made, QUICK, 1)
    np.testing.assert_allclose(read_by_sensors.tau, ordered.tau, atol=1e-9)
    np.testing.assert_array_equal(ordered.tau[0], 0.0)
    assert (np.abs(ordered.tau).max(axis=0) <= [30.0, 6.0]).all()
    assert np.ptp(ordered.state.q[:, 0]) > 0.6


@pytest.mark.slow
def test_the_controller_sees_what_the_encoders_read():
    """With an offset a of the encoder the links stop at goal - a, and the recording says that they are at the goal."""
    of, goal = truth(world("encoder_offset", 0.7)), {"m": reference({**STILL, "rest_s": 0.8})}
    (run,) = of.runs(goal, law(of, knows_all_but_what_is_hidden(of)), QUICK, 1)
    (cause,) = of.world.causes
    links = track("m", goal["m"], of.loop_arm("m"), law(of, knows_all_but_what_is_hidden(of)), QUICK, 1)
    end, a = goal["m"].at(run.t).q[-1], run.state.q[-1] - links.state.q[-1]
    assert abs(a[cause.joint - 1]) > 0.05
    np.testing.assert_allclose(run.state.q[-1], end, atol=2e-3)
    np.testing.assert_allclose(links.state.q[-1] + a, run.state.q[-1], atol=1e-12)
    whole = whole_run("m", links.state, QUICK, 0)
    np.testing.assert_allclose(run.state.q, links.state.q + cause.angle(whole, links.tau), atol=1e-12)
