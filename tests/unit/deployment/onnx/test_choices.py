"""What only one side of a choice needs is known."""

from nnhydro.deployment.onnx.choices import WORTH, best_choice
from nnhydro.deployment.onnx.expressions import Program, add, row_of


def chosen(n):
    """A program of `n` choices by one condition; what both sides need, what only the first does, and the outputs."""
    program = Program(n + 1)
    x, condition = [program.input(k) for k in range(n)], program.apply("positive", program.input(n))
    both = [program.unary("exp", value) for value in x]
    only = [program.unary("sin", add(value, both[0])) for value in x]
    return program, condition, both, only, [program.where(condition, first, other) for first, other in zip(only, both, strict=True)]


def test_what_only_one_side_needs_is_found_and_what_the_condition_or_the_other_side_needs_is_not():
    program, condition, both, only, outputs = chosen(WORTH)
    found = best_choice(program, outputs)
    assert found.condition == row_of(condition)
    assert found.atoms == {k for value in only for k in value.terms}
    assert found.rows == {row_of(add(program.input(k), both[0])) for k in range(WORTH)}
    assert best_choice(program, [*outputs, only[0]]) is None, "one more is needed always: too few are left for a branch"


def test_a_choice_that_saves_little_is_none():
    program, *_, outputs = chosen(WORTH - 1)
    assert best_choice(program, outputs) is None
    assert best_choice(program, [program.input(0)]) is None
