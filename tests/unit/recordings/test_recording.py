"""What one file holds is whole, and never changes in place."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import planted, recording, steady_table
from rigs import arm

from nnhydro.errors import RecordingError
from nnhydro.recordings.recording import Recording

A = arm(2)
RUN = recording(A, planted(A), seconds=1.0, speed=0.5)


def test_a_recording_holds_copies_that_cannot_be_written_to():
    q = np.zeros((3, 1))
    made = Recording("run", np.arange(3.0), q)
    q[0] = 9.0
    assert not made.q.any()
    with pytest.raises(ValueError, match="read-only"):
        made.q[0] = 1.0


@pytest.mark.parametrize(("changes", "line"), [
    ({"tau": RUN.tau[:-1]}, r"run: tau has shape \(99, 2\), expected \(100, 2\)"), ({"u0": RUN.u0[:5]}, "u0 has shape"),
    ({"q": RUN.q[:, 0]}, r"expected \(n, links\)"), ({"base": np.zeros((100, 3))}, "base has shape")])
def test_channels_that_do_not_fit_together_are_refused(changes, line):
    with pytest.raises(RecordingError, match=line):
        replace(RUN, **changes)


def test_rows_are_taken_of_every_channel_and_noted():
    part = RUN.rows(slice(10, 20), "ten rows")
    assert len(part) == 10
    assert np.array_equal(part.tau, RUN.tau[10:20])
    assert np.array_equal(part.du0, RUN.du0[10:20])
    assert part.steps == ("ten rows",)
    assert part.duration == pytest.approx(0.09)


def test_a_motion_alone_has_no_torque_left():
    motion = replace(RUN, tau_sim=RUN.tau).without_torque()
    assert motion.tau is motion.tau_sim is None
    assert motion.steps[-1] == "torque removed"


def test_the_state_of_a_steady_run_is_all_that_says_what_the_arm_did():
    table = steady_table(A, planted(A), rows=5)
    assert np.array_equal(table.state, np.column_stack([table.q, table.qd, table.u0]))
    turning = replace(table, base=np.ones((5, 2)), heading=np.zeros(5))
    assert turning.state.shape == (5, 8)
    some = turning.rows(np.array([True, False, True, False, False]))
    assert some.run == ("0", "2")
    assert np.array_equal(some.rows(np.array([1])).tau, table.tau[2:3])
