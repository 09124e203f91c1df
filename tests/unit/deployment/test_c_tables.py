"""A large program as loops over tables: products are found, and read what lies side by side."""

import numpy as np
import pytest
from c_programs import in_c

from nnhydro.deployment import c_program
from nnhydro.deployment.c_program import c_function
from nnhydro.deployment.native import Native, compiler
from nnhydro.deployment.onnx.expressions import Program, combine

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler here")

ALONE = {"wide": (), "plain": ("-DNO_DISPATCH",), "any compiler": ("-DANY_COMPILER",)}


@pytest.mark.parametrize("flags", ALONE.values(), ids=ALONE)
@pytest.mark.parametrize("strips", [4, 5, 10, 20, 21, 43])
def test_equal_matrices_over_many_strips_are_one_product(strips, flags, tmp_path, monkeypatch):
    monkeypatch.setattr(c_program, "MANY", 0)
    rows, beside, apart = 7, 4, 5  # of x: some lie strip beside strip, the others strip after strip
    rng, program = np.random.default_rng(strips), Program(strips * (beside + apart))
    W = rng.standard_normal((rows, beside + apart))
    first, others = np.arange(beside * strips).reshape(beside, strips), np.arange(apart * strips).reshape(strips, apart).T
    at = np.concatenate([first, beside * strips + others])
    sums = [combine([(c, program.input(int(k))) for c, k in zip(row, at[:, s], strict=True)]) for s in range(strips) for row in W]
    text = c_function("void run", program, sums, "double")
    assert "    plain_beside" in text
    x = rng.standard_normal(program.n_inputs)
    got = in_c(tmp_path, program, sums, flags=flags)(x)
    np.testing.assert_allclose(got.reshape(strips, rows).T, W @ x[at], rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("flags", ALONE.values(), ids=ALONE)
@pytest.mark.parametrize("rows", [3, 16, 21])
def test_the_same_matrix_over_two_sets_of_values_is_read_once(rows, flags, tmp_path, monkeypatch):
    monkeypatch.setattr(c_program, "MANY", 0)
    rng, columns = np.random.default_rng(rows), 11
    program, W = Program(2 * columns), rng.standard_normal((rows, columns))
    x = rng.standard_normal(2 * columns).reshape(columns, 2)  # the two sets lie in turns
    sums = [combine([(c, program.input(2 * i + side)) for i, c in enumerate(row)]) for side in (0, 1) for row in W]
    text = c_function("void run", program, sums, "double")
    assert text.count("    plain_dense") == -(-rows // 16)
    got = in_c(tmp_path, program, sums, flags=flags)(x.ravel())
    np.testing.assert_allclose(got.reshape(2, rows).T, W @ x, rtol=1e-13, atol=1e-14)


def test_what_a_network_and_its_mirror_image_add_and_take_off_by_turns_is_read_without_an_index_for_each_number(tmp_path, monkeypatch):
    monkeypatch.setattr(c_program, "MANY", 0)
    n = 40
    program, x = Program(2 * n), np.random.default_rng(0).standard_normal(2 * n)
    even, odd = (range(start, start + n) for start in (0, n))
    turns = [combine([(1.0, program.input(e)), (sign, program.input(o))]) for e, o in zip(even, odd, strict=True) for sign in (1.0, -1.0)]
    outputs = [program.unary("tanh", y) for y in turns]
    text = c_function("void run", program, outputs, "double")
    loops = text.partition("static inline void plain_roots")[2]
    assert loops.count("    plain_loop") == 2, "both signs in one loop of two runs, then one loop over all tanh"
    assert "v[p0[r] + i]" in loops
    assert "[i]]" not in loops
    want = np.tanh(np.stack([x[:n] + x[n:], x[:n] - x[n:]], axis=1)).ravel()
    np.testing.assert_allclose(in_c(tmp_path, program, outputs)(x), want, rtol=1e-14)


def test_factors_change_places_where_that_saves_an_index_for_each_number(tmp_path, monkeypatch):
    monkeypatch.setattr(c_program, "MANY", 0)
    n = 40
    program, x = Program(2 * n), np.random.default_rng(0).standard_normal(2 * n)
    pairs = [(program.input(k), program.input(n + k)) for k in range(n)]
    outputs = [program.apply("mul", *(pair if k % 3 else reversed(pair))) for k, pair in enumerate(pairs)]
    assert "[i]]" not in c_function("void run", program, outputs, "double").partition("static inline void plain_roots")[2]
    np.testing.assert_allclose(in_c(tmp_path, program, outputs)(x), x[:n] * x[n:], rtol=1e-15)


def test_a_network_and_its_mirror_image_are_one_product_whose_halves_are_added_and_taken_off(monkeypatch):
    monkeypatch.setattr(c_program, "MANY", 0)  # tables, however small the program
    rng, p = np.random.default_rng(1), Program(20)
    W, s = rng.standard_normal((5, 20)), np.where(rng.random(20) < 0.4, -1.0, 1.0)
    rows = [combine([(c, p.input(k)) for k, c in enumerate(row)]) for row in np.concatenate([W, W * s])]
    outputs = [p.unary("tanh", row) for row in rows]
    assert "= e + o" in c_program.c_function("void run", p, outputs, "double")
    native, x = Native(p, outputs, 20), rng.uniform(-0.3, 0.3, 20)
    native.given[:] = x
    np.testing.assert_allclose(native(), np.tanh(np.concatenate([W, W * s]) @ x), atol=1e-13)


@pytest.mark.parametrize("far", [0, 70_000], ids=["", "a long vector"])
def test_long_sums_alone_and_alike_are_those_of_a_matrix_product(monkeypatch, far):
    monkeypatch.setattr(c_program, "MANY", 0)
    rng = np.random.default_rng(2)
    n = 90 + far
    p, c = Program(n), rng.standard_normal((3, 19))
    at = [range(far + 5, far + 24), range(30, 49), [3, 1, 7, *range(60, 76)], [8, 2, 5, *range(62, 78)]]  # side by side, and scattered
    at += [range(k, k + 19) for k in (30, 38, 49, 57, 66)]
    weights = [c[0], c[1], c[0], c[1], *[c[2]] * 5]
    outputs = [combine([(x, p.input(k)) for k, x in zip(places, w, strict=True)]) for places, w in zip(at, weights, strict=True)]
    text = c_program.c_function("void run", p, outputs, "double")
    assert all(f"plain_{name}" in text for name in ("dots19run", "dots19at", "beside"))
    native, x = Native(p, outputs, n), rng.uniform(-1, 1, n)
    native.given[:] = x
    want = [w @ x[list(places)] for places, w in zip(at, weights, strict=True)]
    np.testing.assert_allclose(native(), want, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_only_one_side_of_a_choice_needs_is_computed_where_it_is_chosen(sign, tmp_path, monkeypatch):
    monkeypatch.setattr(c_program, "MANY", 0)
    n, rng = 40, np.random.default_rng(0)
    W, x = rng.standard_normal((n, n)), rng.standard_normal(n)
    program = Program(n + 1)
    first = program.apply("positive", program.input(n))
    mixed = [program.unary("tanh", combine([(c, program.input(k)) for k, c in enumerate(row)])) for row in W]
    beside = [combine([(1.0, y), (2.0, program.input(k))]) for k, y in enumerate(mixed)]  # both sides need these sums
    outputs = [program.where(first, program.unary("exp", y), y) for y in beside]
    text = c_function("void run", program, outputs, "double")
    assert "if (v[" in text
    want = np.tanh(W @ x) + 2 * x
    got = in_c(tmp_path, program, outputs)(np.append(x, sign))
    np.testing.assert_allclose(got, np.exp(want) if sign > 0 else want, rtol=1e-12)
