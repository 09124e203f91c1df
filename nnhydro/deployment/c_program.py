"""A program of scalars as one C function, `head(const real *in, real *out)`, with all that it needs.

A small program is written as one statement a scalar, a large one as loops over tables (c_tables.py); both from what a model left when it
was traced, so that there is no second formula to keep equal.
"""

import math
import re
from collections.abc import Sequence
from typing import Any, Final

from nnhydro.deployment.c_kernels import END
from nnhydro.deployment.c_tables import table_program
from nnhydro.deployment.compiled.source import Writer
from nnhydro.deployment.onnx.expressions import Program, Value
from nnhydro.errors import require

PRECISIONS: Final = {"double": "double", "single": "float"}
MANY: Final = 6_000  # terms: beyond, statements no longer fit the processor's cache of instructions
FORMS: Final = {"same": "{0}", "mul": "{0}*{1}", "div": "{0}/{1}", "max": "({0} > {1} ? {0} : {1})", "min": "({0} < {1} ? {0} : {1})",
                "where": "({0} > R(0.5) ? {1} : {2})", "positive": "(real)({0} > R(0.0))", "zero": "(real)({0} == R(0.0))",
                "sign": "(real)(({0} > R(0.0)) - ({0} < R(0.0)))"}
PLAIN: Final = {"abs": "fabs", "sqrt": "sqrt", "log": "log", "sin": "sin", "cos": "cos", "tan": "tan", "atan": "atan", "asin": "asin",
                "acos": "acos", "floor": "floor", "ceil": "ceil", "pow": "pow"}
OWN: Final = ("exp", "tanh", "sigmoid")  # functions written out below
TINY: Final = 1.2e-38  # below it a number of single precision is 0
LITERAL: Final = re.compile(r"(?<![\w.])(\d+\.\d*(?:e[+-]?\d+)?|\d+e[+-]?\d+)(?![\w.])")
FAST: Final = """
static inline real f_exp(real x) {{ /* 2^n times a polynomial: no branches, so that loops of it vectorise; good to 2e-16 */
    union {{ real f; {integer} i; }} p;
    x = x < R(-{span}) ? R(-{span}) : (x > R({span}) ? R({span}) : x);
    const real shifted = x*R(1.4426950408889634) + R({magic});
    const real n = shifted - R({magic});
    const real r = (x - n*R({ln2_high})) - n*R({ln2_low});
    real e = R({last});
{horner}
    p.f = shifted;
    p.i = ({integer})((p.i - {magic_bits}) + {bias}) << {mantissa};
    return e*p.f;
}}
static inline real f_tanh(real x) {{
    const real e = f_exp(R(2.0)*x);
    return R(1.0) - R(2.0)/(e + R(1.0));
}}
static inline real f_sigmoid(real x) {{ return R(1.0)/(R(1.0) + f_exp(-x)); }}"""


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


def _functions(precision: str) -> str:
    """exp, tanh and the logistic function, and the others from math.h under one name."""
    double, end = precision == "double", "" if precision == "double" else "f"
    terms = 13 if double else 7
    values = {"integer": "long long" if double else "int", "span": "700.0" if double else "80.0",
              "magic": "6755399441055744.0" if double else "12582912.0", "ln2_high": "0.693147180369123816490" if double else "0.693359375",
              "ln2_low": "1.90821492927058770002e-10" if double else "-2.12194440e-4",
              "magic_bits": "0x4338000000000000LL" if double else "0x4B400000", "bias": 1023 if double else 127,
              "mantissa": 52 if double else 23, "last": repr(1 / math.factorial(terms)),
              "horner": "\n".join(f"    e = e*r + R({1 / math.factorial(k)!r});" for k in range(terms - 1, -1, -1))}
    others = "\n".join(f"#define f_{name} {c}{end}" for name, c in PLAIN.items())
    return FAST.format(**values) + "\n" + others


def _statements(program: Program, outputs: Sequence[Value], precision: str) -> tuple[list[str], list[str], list[str]]:
    """One statement a scalar."""
    lines, results = Writer(program, FORMS, [f"in[{k}]" for k in range(program.n_inputs)]).statements(outputs)

    def c(text: str) -> str:
        """Return an expression of Python as one of C: the functions' and numbers' names of this precision."""
        text = text.replace("float('inf')", "R(INFINITY)").replace("float('-inf')", "R(-INFINITY)")
        for name in (*PLAIN, *OWN):
            text = re.sub(rf"(?<![\w.]){name}\(", f"f_{name}(", text)
        return LITERAL.sub(lambda found: found[1] + ("" if precision == "double" else "f"), text)

    return [], [f"const real {c(line)};" for line in lines], [c(result) for result in results]


def _terms(program: Program, outputs: Sequence[Value]) -> int:
    return sum(len(getattr(x, "terms", {})) for k in program.dependencies(list(outputs)) for x in program.atoms[k].operands)


def c_function(head: str, program: Program, outputs: Sequence[Value], precision: str, prefix: str = "") -> str:
    """Return C text of the function `head`, such as `void run`; `prefix` begins what else is defined, where two stand in one file."""
    tables, body, results = (_statements(program, outputs, precision) if _terms(program, outputs) < MANY
                             else table_program(program, outputs, _literal(precision), prefix))
    lines = "\n    ".join([*body, *(f"out[{k}] = {result};" for k, result in enumerate(results))])
    renamed = OWN if prefix else ()
    begin = [f"#define real {PRECISIONS[precision]}", "#define R(x) ((real)(x))", *(f"#define f_{f} {prefix}f_{f}" for f in renamed)]
    end = [END, "#undef real", "#undef R", "#undef DOTTED", *(f"#undef f_{f}" for f in (*PLAIN, *renamed))]
    return "\n".join([*begin, _functions(precision), *tables, f"{head}(const real *in, real *out) {{\n    {lines}\n}}", *end])
