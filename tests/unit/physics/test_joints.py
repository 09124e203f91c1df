"""What the laws of friction share: a smooth sign, and contacts that bend before they slip."""

from dataclasses import replace

import pytest
import torch
from rigs import assert_close, run

from nnhydro.errors import ModelError
from nnhydro.physics.carried import StepMemory
from nnhydro.physics.joints import DRY_WIDTH, SLOW, bent_sign, diagonal_columns, dry_width, require_bending, require_positive, smooth_sign
from nnhydro.physics.motion import Motion, tensor


def turning(rate, seconds=1.0, rows=401):
    """One joint at a constant rate."""
    t = torch.linspace(0, seconds, rows, dtype=torch.float64)
    qd, still = torch.full((rows, 1), rate, dtype=torch.float64), torch.zeros(rows, dtype=torch.float64)
    return Motion(t, rate * t[:, None], qd, 0 * qd, still, still)


def test_the_sign_is_odd_zero_at_rest_and_one_beyond_a_few_widths():
    rate = tensor([-1.0, -0.02, 0.0, 0.02, 1.0])
    sign = smooth_sign(rate, 0.02)
    assert_close(sign, -smooth_sign(-rate, 0.02))
    assert sign[2] == 0
    assert_close(sign[3], torch.tanh(torch.ones((), dtype=torch.float64)))
    assert sign[4] == pytest.approx(1.0, abs=1e-12)


def test_the_step_is_narrow_beside_a_slow_joint_and_no_wider_than_its_limit():
    assert dry_width(DRY_WIDTH) == DRY_WIDTH / SLOW
    assert dry_width(100.0) == dry_width(0.0) == DRY_WIDTH


@pytest.mark.parametrize("rate", [0.5, -0.5])
def test_a_contact_that_bends_follows_its_equation(rate):
    """At a constant rate dz/dt = (sign - z) |qd| / z_0 has the solution sign (1 - exp(-|qd| t / z_0))."""
    motion = turning(rate)
    want = (1 if rate > 0 else -1) * -torch.expm1(-0.5 * motion.t / 0.1)
    assert_close(bent_sign(motion, 1, 0.1), want, 1e-9, 1e-9)


def test_without_bending_and_in_steady_rows_the_sign_is_that_of_the_rate():
    motion = run(2)
    for found in (bent_sign(motion, 2, 0.0, 0.03), bent_sign(replace(motion, steady=True), 2, 0.1, 0.03)):
        assert_close(found, torch.tanh(motion.qd[:, 1] / 0.03))


def test_a_contact_that_is_stepped_through_time_is_that_of_the_run():
    motion, memory, found = run(1), None, []
    for k in range(len(motion)):
        carried = StepMemory(motion.t[k:k + 1] - motion.t[max(k - 1, 0)], memory)
        found.append(bent_sign(replace(motion.rows(slice(k, k + 1)), carried=carried), 1, 0.05))
        memory = carried.after
    assert_close(torch.cat(found), bent_sign(motion, 1, 0.05))


def test_what_makes_no_sense_is_refused_by_name():
    with pytest.raises(ModelError, match=r"term 'x': bending = \[0.4\]"):
        require_bending("x", (0.4,))
    with pytest.raises(ModelError, match="one value"):
        require_bending("x", (0.1, 0.1))
    require_bending("x", ())
    for value in (0.0, -1.0, float("inf"), True):
        with pytest.raises(ModelError, match="term 'x': width = "):
            require_positive("x", width=value)


def test_a_load_at_its_own_joint_turns_no_other():
    loads = tensor([[1.0, 2.0], [3.0, 4.0]])
    assert torch.equal(diagonal_columns(loads).sum(-1), loads)
    assert diagonal_columns(loads)[0, 0, 1] == diagonal_columns(loads)[0, 1, 0] == 0
