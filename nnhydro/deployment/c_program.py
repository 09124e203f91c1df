"""A program of scalars as one C function, `head(const real *in, real *out)`, with all that it needs.

A small program is written as one statement a scalar, a large one as loops over tables (c_tables.py); both from what a model left when it
was traced, so that there is no second formula to keep equal.
"""

import math
import re
from collections.abc import Sequence
from functools import reduce
from typing import Any, Final

from nnhydro.deployment.c_kernels import END, OPTIONS, dispatch
from nnhydro.deployment.c_tables import table_program
from nnhydro.deployment.compiled.source import Writer
from nnhydro.deployment.onnx.expressions import Program, Value
from nnhydro.deployment.sine import PI, ROUND, P, Q
from nnhydro.errors import require

PRECISIONS: Final = {"double": "double", "single": "float"}
MANY: Final = 6_000  # terms: beyond, statements no longer fit the processor's cache of instructions
FORMS: Final = {"same": "{0}", "mul": "{0}*{1}", "div": "{0}/{1}", "max": "({0} > {1} ? {0} : {1})", "min": "({0} < {1} ? {0} : {1})",
                "where": "({0} > R(0.5) ? {1} : {2})", "positive": "(real)({0} > R(0.0))", "zero": "(real)({0} == R(0.0))",
                "sign": "(real)(({0} > R(0.0)) - ({0} < R(0.0)))"}
PLAIN: Final = {"abs": "fabs", "sqrt": "sqrt", "log": "log", "sin": "sin", "cos": "cos", "tan": "tan", "atan": "atan", "asin": "asin",
                "acos": "acos", "floor": "floor", "ceil": "ceil", "pow": "pow"}
TURNING: Final = ("sin", "cos")  # written out below for loops in double precision
WRITTEN_OUT: Final = ("exp", "tanh", "sigmoid")  # functions written out below
TINY: Final = 1.2e-38  # below it a number of single precision is 0
LITERAL: Final = re.compile(r"(?<![\w.])(\d+\.\d*(?:e[+-]?\d+)?|\d+e[+-]?\d+)(?![\w.])")


def horner(powers: Sequence[float]) -> str:
    """Return the polynomial of z, highest power first, as C."""
    return reduce(lambda text, c: f"({text})*z + {c!r}", powers[1:], repr(powers[0]))


# (exp(r) - 1)/r for |r| <= ln(2)/2, the polynomials through the Chebyshev nodes: 2e-17 and 1e-8 off at most
EXPONENTIAL: Final = {
    "double": (1.0, 0.5000000000000006, 0.1666666666666667, 0.041666666666573066, 0.008333333333326136, 0.001388888893251478,
               0.00019841269874820627, 2.480150431378554e-05, 2.7557255400206422e-06, 2.7626371065696354e-07, 2.5105217004720745e-08),
    "single": (1.0, 0.500000001346581, 0.1666650519575811, 0.041666464925285904, 0.008369155667697397, 0.0013933649996309251)}
SINE: Final = f"""
static inline real f_turn(real x, real *sign) {{ /* r and (-1)^k of x = k pi + r: deployment/sine.py */
    const real k = (x*0.3183098861837907 + {ROUND}) - {ROUND}, odd = k - 2.0*((k*0.5 + {ROUND}) - {ROUND});
    *sign = 1.0 - 2.0*odd*odd;
    return (((x - k*{PI[0]}) - k*{PI[1]}) - k*{PI[2]}) - k*{PI[3]};
}}
static inline real f_sin(real x) {{
    real sign;
    const real r = f_turn(x, &sign), z = r*r, p = {horner(P)};
    return (r + r*z*p)*sign;
}}
static inline real f_cos(real x) {{
    real sign;
    const real r = f_turn(x, &sign), z = r*r, p = {horner(Q)};
    return (1.0 - 0.5*z + z*z*p)*sign;
}}"""
# r coth(r/2) as a polynomial of r^2 for |r| <= ln(2)/2, likewise: 2e-18 and 2e-9 off at most
COTANGENT: Final = {
    "double": (2.0, 0.16666666666666574, -0.002777777777687633, 6.613756294038481e-05, -1.6533878767447105e-06, 4.137410195292643e-08),
    "single": (2.000000003586887, 0.16666613012471554, -0.0027658782274672237)}
FAST: Final = """
static inline real f_rest(real x, real *scale) {{ /* r and 2^n of exp(x) = 2^n exp(r): no branches, so that loops of it vectorise */
    union {{ real f; {integer} i; }} p;
    x = R(-{span}) > x ? R(-{span}) : x;
    x = R({span}) < x ? R({span}) : x;
    const real shifted = x*R(1.4426950408889634) + R({magic});
    const real n = shifted - R({magic});
    p.f = shifted;
    p.i = ({integer})((p.i - {magic_bits}) + {bias}) << {mantissa};
    *scale = p.f;
    return (x - n*R({ln2_high})) - n*R({ln2_low});
}}
static inline real f_exp(real x) {{
    real s;
    const real r = f_rest(x, &s);
    real e = R({last});
{horner}
    return (e*r)*s + s;
}}
static inline real f_ratio(real r) {{ /* Q of exp(r) = (Q + r)/(Q - r), even in r: one division instead of many powers */
    const real z = r*r;
    return {cotangent};
}}
static inline real f_tanh(real x) {{ /* (E - 1)/(E + 1), E = exp(2x) = s (Q + r)/(Q - r): good to a few last digits, however small x */
    real s;
    const real r = f_rest(R(2.0)*x, &s), q = f_ratio(r), a = s - R(1.0), b = s + R(1.0);
    return (a*q + b*r)/(b*q + a*r);
}}
static inline real f_sigmoid(real x) {{ /* E/(E + 1) */
    real s;
    const real r = f_rest(x, &s), q = f_ratio(r), e = s*(q + r);
    return e/(e + (q - r));
}}"""


def _literal(precision: str) -> Any:
    """How a number is written in C at this precision: with a point, and a suffix for floats."""
    suffix, digits = ("", 17) if precision == "double" else ("f", 9)

    def number(x: float) -> str:
        """Return `x` as a C literal; raises ConfigError for NaN."""
        require(not math.isnan(x), "the model holds a number that is none (NaN): it cannot be written as C")
        if math.isinf(x):
            return "INFINITY" if x > 0 else "(-INFINITY)"
        text = f"{0.0 if suffix and abs(x) < TINY else x:.{digits}g}"
        return text + ("" if any(c in text for c in ".en") else ".0") + suffix

    return number


def _functions(precision: str, with_sine: bool) -> str:
    """exp, tanh and the logistic function, sine and cosine where they are our own, and the others from math.h under one name."""
    double, end = precision == "double", "" if precision == "double" else "f"
    *others, last = EXPONENTIAL[precision]
    values = {"integer": "long long" if double else "int", "span": "700.0" if double else "80.0",
              "magic": "6755399441055744.0" if double else "12582912.0", "ln2_high": "0.693147180369123816490" if double else "0.693359375",
              "ln2_low": "1.90821492927058770002e-10" if double else "-2.12194440e-4",
              "magic_bits": "0x4338000000000000LL" if double else "0x4B400000", "bias": 1023 if double else 127,
              "mantissa": 52 if double else 23, "last": last,
              "horner": "\n".join(f"    e = e*r + R({c});" for c in reversed(others)),
              "cotangent": LITERAL.sub(r"R(\1)", horner(COTANGENT[precision][::-1]))}
    library = "\n".join(f"#define f_{name} {c}{end}" for name, c in PLAIN.items() if not (with_sine and name in TURNING))
    return FAST.format(**values) + (SINE if with_sine else "") + "\n" + library


def _statements(program: Program, outputs: Sequence[Value], precision: str) -> tuple[list[str], list[str]]:
    """One statement a scalar."""
    lines, results = Writer(program, FORMS, [f"in[{k}]" for k in range(program.n_inputs)]).statements(outputs)

    def c(text: str) -> str:
        """Return an expression of Python as one of C: the functions' and numbers' names of this precision."""
        text = text.replace("float('inf')", "R(INFINITY)").replace("float('-inf')", "R(-INFINITY)")
        for name in (*PLAIN, *WRITTEN_OUT):
            text = re.sub(rf"(?<![\w.]){name}\(", f"f_{name}(", text)
        return LITERAL.sub(lambda found: found[1] + ("" if precision == "double" else "f"), text)

    return [f"const real {c(line)};" for line in lines], [c(result) for result in results]


def _terms(program: Program, outputs: Sequence[Value]) -> int:
    return sum(len(getattr(x, "terms", {})) for k in program.dependencies(list(outputs)) for x in program.atoms[k].operands)


def c_function(head: str, program: Program, outputs: Sequence[Value], precision: str, prefix: str = "") -> str:
    """Return C text of the function `head`, such as `void run`; `prefix` begins what else is defined, where two stand in one file."""
    large = _terms(program, outputs) >= MANY
    single = ["#define SINGLE"] if precision == "single" else []
    with_sine = large and precision == "double"  # in a loop it is faster than the library's, alone it is not
    renamed = (*WRITTEN_OUT, "rest", "ratio", *(("turn", *TURNING) if with_sine else ())) if prefix else ()
    begin = [f"#define real {PRECISIONS[precision]}", "#define R(x) ((real)(x))", *(f"#define f_{f} {prefix}f_{f}" for f in renamed)]
    end = ["#undef real", "#undef R", *(f"#undef f_{f}" for f in (*PLAIN, *renamed))]
    functions = _functions(precision, with_sine)
    if not large:
        body, results = _statements(program, outputs, precision)
        known = [f"const real o{k} = {result};" for k, result in enumerate(results)]  # `out` may lie where `in` does
        lines = "\n    ".join([*body, *known, *(f"out[{k}] = o{k};" for k in range(len(results)))])
        return "\n".join([*begin, functions, f"{head}(const real *in, real *out) {{\n    {lines}\n}}", *end])
    name = head.split()[-1]
    tables, core = table_program(program, outputs, _literal(precision), prefix, name)
    # what is inlined must have the options of its caller
    return "\n".join([*begin, *single, OPTIONS, functions, *tables, dispatch(core, head, prefix), END, *end])
