"""Scalars: equal atoms once, constants folded."""

import numpy as np

from nnhydro.deployment.onnx.expressions import Program, add, combine, infinite_atoms, row_of, scale, sub


def test_equal_products_are_made_once_and_constants_folded():
    program = Program(2)
    a, b = program.input(0), program.input(1)
    assert program.mul(a, b).key == program.mul(b, a).key
    assert program.apply("tanh", 0.0) == 0.0
    assert len(program.atoms) == 3


def test_sums_and_factors_are_no_atoms():
    program = Program(2)
    x, y = program.input(0), program.input(1)
    total = combine([(2.0, x), (1.0, add(y, 3.0)), (-2.0, x)])
    assert total.terms == {1: 1.0}
    assert total.bias == 3.0
    assert len(program.atoms) == 2
    assert sub(x, x) == 0.0
    assert scale(y, 0.0) == 0.0


def test_a_sum_that_is_kept_whole_is_one_atom():
    program = Program(3)
    wide = combine([(1.0, program.input(k)) for k in range(3)])
    assert program.share(wide) is wide
    kept = Program(3, whole=3)
    (atom,) = kept.share(combine([(1.0, kept.input(k)) for k in range(3)])).terms
    assert kept.atoms[atom].kind == "same"


def test_only_what_is_needed_is_a_dependency_and_levels_count_the_way():
    program = Program(2)
    x, y = program.input(0), program.input(1)
    first = program.unary("tanh", x)
    second = program.mul(first, y)
    program.unary("exp", y)
    assert program.dependencies([second]) == {0, 1, *first.terms, *second.terms}
    assert [program.level(value) for value in (x, first, second, 4.0)] == [0, 1, 2, 0]


def test_the_interpreter_computes_row_by_row():
    program = Program(2)
    x, y = program.input(0), program.input(1)
    outputs = [program.power(x, 3), program.div(y, 2.0), program.where(program.apply("positive", x), y, 7.0)]
    given = np.array([[2.0, 4.0], [-1.0, 6.0]])
    np.testing.assert_allclose(program.evaluate(outputs, given), [[8.0, 2.0, 4.0], [-1.0, 3.0, 7.0]])


def test_the_terms_of_a_row_begin_with_its_constant():
    program = Program(2)
    assert row_of(combine([(2.0, program.input(1)), (3.0, program.input(0)), (1.0, 5.0)])) == ((None, 5.0), (0, 3.0), (1, 2.0))
    assert row_of(4) == ((None, 4.0),)


def test_atoms_that_may_be_infinite_are_known():
    p = Program(2)
    x, y = p.input(0), p.input(1)
    ever = p.where(p.apply("positive", x), np.inf, y)
    wild = [ever, p.apply("mul", ever, x), p.apply("max", ever, x), p.apply("exp", ever)]
    tame = [p.apply("min", ever, 5.0), p.apply("div", 1.0, ever), p.apply("exp", p.mul(-1.0, ever)), p.apply("positive", ever)]
    assert infinite_atoms(p) == {k for value in wild for k in value.terms}
    assert not infinite_atoms(p) & {k for value in tame for k in value.terms}
