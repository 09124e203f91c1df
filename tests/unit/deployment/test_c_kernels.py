"""The functions and the products that the C header brings along are those of numpy to a few last digits."""

import ctypes
import subprocess

import numpy as np
import pytest

from nnhydro.deployment import c_kernels, c_program
from nnhydro.deployment.c_program import c_function
from nnhydro.deployment.native import compiler
from nnhydro.deployment.onnx.expressions import Program, Value, combine

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler here")
REAL = {"double": np.float64, "single": np.float32}
ALONE = {"wide": (), "plain": ("-DNO_DISPATCH",), "any compiler": ("-DANY_COMPILER",)}


def compiled(folder, program, outputs: list[Value], precision="double", flags=()):
    """A program as a function from an array to an array."""
    without_vectors = "#ifdef ANY_COMPILER\n#undef __GNUC__\n#endif\n"
    (folder / "p.c").write_text(f"#include <math.h>\n{without_vectors}{c_function('void run', program, outputs, precision)}")
    library = folder / f"{precision}{len(flags)}.so"
    command = [compiler(), "-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", *flags, "-fPIC", "-shared", "p.c", "-o", library, "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    loaded = ctypes.CDLL(str(library))

    def run(x):
        given, out = np.ascontiguousarray(x, REAL[precision]), np.zeros(len(outputs), REAL[precision])
        loaded.run(given.ctypes.data_as(ctypes.c_void_p), out.ctypes.data_as(ctypes.c_void_p))
        return out

    return run


@pytest.mark.parametrize("many", [0, 10**9], ids=["loops", "statements"])
@pytest.mark.parametrize("precision", REAL)
@pytest.mark.parametrize("kind", ["tanh", "exp", "sigmoid"])
def test_functions_of_plain_arithmetic_are_good_to_a_few_last_digits(kind, precision, many, tmp_path, monkeypatch):
    monkeypatch.setattr(c_program, "MANY", many)
    real = REAL[precision]
    least, widest = np.finfo(real).smallest_subnormal, 700.0 if precision == "double" else 80.0
    sizes = np.concatenate([[0.0, least, 3 * least, np.finfo(real).tiny], np.geomspace(1e-12, widest, 40), np.linspace(0.1, 20.0, 40)])
    x = np.concatenate([sizes, -sizes]).astype(real)
    program = Program(len(x) + 3)
    outputs = [program.unary(kind, program.input(k)) for k in range(program.n_inputs)]
    got = compiled(tmp_path, program, outputs, precision)(np.concatenate([x, [np.inf, -np.inf, np.nan]]))
    exact = x.astype(np.longdouble)
    want = {"tanh": np.tanh, "exp": np.exp, "sigmoid": lambda x: 1 / (1 + np.exp(-x))}[kind](exact)
    off = np.abs(got[:-3] - want) / np.spacing(np.abs(want).astype(real))
    assert off.max() < 5, f"{x[off.argmax()]}: {off.max():.1f} units of the last place"
    np.testing.assert_allclose(got[-2], {"tanh": -1.0, "exp": 0.0, "sigmoid": 0.0}[kind], atol=1e-34)
    assert got[-3] == 1.0 if kind != "exp" else got[-3] > 1e34
    assert np.isnan(got[-1])


@pytest.mark.parametrize("precision", REAL)
@pytest.mark.parametrize("kind", ["sin", "cos", "sqrt"])
def test_loops_over_other_functions_are_as_good_as_numpy_s(kind, precision, tmp_path, monkeypatch):
    monkeypatch.setattr(c_program, "MANY", 0)
    x = np.concatenate([[0.0, 1e-300, 1e-8], np.linspace(-4.0, 4.0, 60), np.geomspace(1.0, 1e7, 60)]).astype(REAL[precision])
    program, x = Program(len(x)), np.abs(x) if kind == "sqrt" else x
    got = compiled(tmp_path, program, [program.unary(kind, program.input(k)) for k in range(len(x))], precision)(x)
    want = getattr(np, kind)(x.astype(float))
    assert (np.abs(got - want) <= 2 * np.finfo(REAL[precision]).eps * np.maximum(np.abs(want), 0.5 * (kind != "sqrt"))).all()


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
    got = compiled(tmp_path, program, sums, flags=flags)(x)
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
    got = compiled(tmp_path, program, sums, flags=flags)(x.ravel())
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
    np.testing.assert_allclose(compiled(tmp_path, program, outputs)(x), want, rtol=1e-14)


def test_factors_change_places_where_that_saves_an_index_for_each_number(tmp_path, monkeypatch):
    monkeypatch.setattr(c_program, "MANY", 0)
    n = 40
    program, x = Program(2 * n), np.random.default_rng(0).standard_normal(2 * n)
    pairs = [(program.input(k), program.input(n + k)) for k in range(n)]
    outputs = [program.apply("mul", *(pair if k % 3 else reversed(pair))) for k, pair in enumerate(pairs)]
    assert "[i]]" not in c_function("void run", program, outputs, "double").partition("static inline void plain_roots")[2]
    np.testing.assert_allclose(compiled(tmp_path, program, outputs)(x), x[:n] * x[n:], rtol=1e-15)


@pytest.mark.parametrize("without", [(), ("x512",), ("x512", "x256")], ids=["any", "256 bits", "none"])
def test_each_processor_s_own_program_gives_the_same(without, tmp_path, monkeypatch):
    monkeypatch.setattr(c_program, "MANY", 0)
    for kind in without:
        monkeypatch.delitem(c_kernels.WIDER, kind)
    rng, program = np.random.default_rng(0), Program(30)
    W, x = rng.standard_normal((24, 30)), rng.standard_normal(30)
    outputs = [program.unary("tanh", combine([(c, program.input(k)) for k, c in enumerate(row)])) for row in W]
    text = c_function("void run", program, outputs, "double")
    assert text.count("__builtin_cpu_supports") == 4 - 2 * len(without)
    np.testing.assert_allclose(compiled(tmp_path, program, outputs)(x), np.tanh(W @ x), rtol=1e-13)
