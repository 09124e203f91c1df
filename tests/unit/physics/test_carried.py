"""What a model remembers from one instant to the next."""

import torch
from torch import tensor

from nnhydro.physics.carried import StepMemory

DT = tensor([0.1, 0.2])


def doubled(memory):
    """A law that starts at 1 and doubles at every instant."""
    return memory.value("law", lambda: torch.ones(2), lambda old: 2 * old)


def test_at_the_first_instant_a_law_starts_and_later_it_follows():
    first = StepMemory(DT)
    assert doubled(first).tolist() == [1.0, 1.0]
    second = StepMemory(DT, first.after)
    assert doubled(second).tolist() == [2.0, 2.0]
    assert second.after["law"].tolist() == [2.0, 2.0]
    assert first.after["law"].tolist() == [1.0, 1.0], "what was remembered stays as it was"


def test_a_frozen_memory_is_that_of_this_instant():
    assert doubled(StepMemory(DT, {"law": tensor([4.0, 8.0])}, frozen=True)).tolist() == [4.0, 8.0]


def test_a_row_that_is_fresh_begins_anew_whatever_was_remembered():
    assert doubled(StepMemory(DT, {"law": tensor([4.0, 8.0])}, fresh=tensor([False, True]))).tolist() == [8.0, 1.0]


def test_steps_have_as_many_axes_as_what_they_multiply():
    assert StepMemory(DT).steps(3).shape == (2, 1, 1)
