"""`FILE.h`: one step in time of a model as one self-contained C99 header without allocation, and `FILE.h.test.csv` to try it by.

    NAME_state s;  NAME_reset(&s);
    NAME_step(&s, q, qd, qdd, u0, du0, dt, tau);            the first step after a reset begins the run, its dt is not read

A small model is written as one statement a scalar, a large one as loops over tables (c_tables.py); both from the program that the model
itself left when it was traced, so that there is no second formula to keep equal.
"""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from torch import Tensor

from nnhydro import __version__
from nnhydro.deployment.c_tables import END, tabled
from nnhydro.deployment.step import BEGIN, MemoryStep, inputs_along, recorded, whole_sums
from nnhydro.errors import require
from nnhydro.models.compiled.source import Writer
from nnhydro.models.compiled.torque import trial_runs
from nnhydro.models.export.expressions import Program, Value
from nnhydro.models.export.onnx_file import RecordedGraph
from nnhydro.models.torque_model import TorqueModel
from nnhydro.runtime.files import write_own
from nnhydro.runtime.stamp import refuse_foreign

PRECISIONS: Final = {"double": "double", "single": "float"}
MANY: Final = 6_000  # terms: beyond, statements no longer fit the processor's cache of instructions
FORMS: Final = {"same": "{0}", "mul": "{0}*{1}", "div": "{0}/{1}", "max": "({0} > {1} ? {0} : {1})", "min": "({0} < {1} ? {0} : {1})",
                "where": "({0} > R(0.5) ? {1} : {2})", "positive": "(real)({0} > R(0.0))", "zero": "(real)({0} == R(0.0))",
                "sign": "(real)(({0} > R(0.0)) - ({0} < R(0.0)))"}
PLAIN: Final = {"abs": "fabs", "sqrt": "sqrt", "log": "log", "sin": "sin", "cos": "cos", "tan": "tan", "atan": "atan", "asin": "asin",
                "acos": "acos", "floor": "floor", "ceil": "ceil", "pow": "pow"}
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
        text = text.replace("float('inf')", "R(INFINITY)").replace("float('-inf')", "R(-INFINITY)")
        for name in (*PLAIN, "exp", "tanh", "sigmoid"):
            text = re.sub(rf"(?<![\w.]){name}\(", f"f_{name}(", text)
        return LITERAL.sub(lambda found: found[1] + ("" if precision == "double" else "f"), text)

    return [], [f"const real {c(line)};" for line in lines], [c(result) for result in results]


def _terms(program: Program, outputs: Sequence[Value]) -> int:
    return sum(len(getattr(x, "terms", {})) for k in program.needed(list(outputs)) for x in program.atoms[k].operands)


def header(made: RecordedGraph, name: str, precision: str, digest: str, remarks: Sequence[str] = ()) -> str:
    """Return the text of the header; `name` begins every name in it."""
    step: Any = made.step
    joints, outputs = step.model.arm.n_links, [x for values in made.outputs.values() for x in values.ravel()]
    write = _statements if _terms(made.program, outputs) < MANY else None
    tables, body, results = (write(made.program, outputs, precision) if write is not None
                             else tabled(made.program, outputs, _literal(precision)))
    given = (("q", joints), ("qd", joints), ("qdd", joints))
    fill = [f"in[{start + i}] = {array}[{i}];" for start, (array, count) in zip((0, joints, 2 * joints), given, strict=True)
            for i in range(count)]
    fill += [f"in[{3 * joints}] = u0; in[{3 * joints + 1}] = du0; in[{3 * joints + 2}] = s->begun ? dt : R({BEGIN!r});"]
    fill += [f"for (int i = 0; i < {step.size}; ++i) in[{3 * joints + 3} + i] = s->memory[i];"] if step.size else []
    targets = [f"{out}[{i}]" for out, values in made.outputs.items() for i in range(values.size)]
    targets = [target.replace("memory_next", "next") for target in targets]
    with_std, real = "std" in made.outputs, PRECISIONS[precision]
    guard, upper = f"{name.upper()}_H", name.upper()
    remark = "".join(f"\n   {line}" for line in remarks).replace("*/", "* /")
    lines = "\n    ".join([*fill, *body, *([f"real next[{step.size}];"] if step.size else []),
                           *(f"{target} = {result};" for target, result in zip(targets, results, strict=True)),
                           *([f"for (int i = 0; i < {step.size}; ++i) s->memory[i] = next[i];"] if step.size else []), "s->begun = 1;"])
    arguments = (f"{name}_state *s, const {real} q[{joints}], const {real} qd[{joints}], const {real} qdd[{joints}], {real} u0, "
                 f"{real} du0, {real} dt, {real} tau[{joints}]" + (f", {real} std[{joints}]" if with_std else ""))
    model = getattr(step.model, "name", step.model.kind)
    return f"""/* {model}: joint torques of an arm in water, one step in time. C99, no allocation, {precision} precision.
   Made by nnhydro {__version__} from the model {digest or "(not stored)"}.
   q1 from +X, the others relative to the link inboard, counter-clockwise, rad; u0, du0 carriage along +Y, m/s, m/s^2; dt s since the step
   before; tau N m, what the torque sensors read. NAME_reset begins a run: what stands still in its first step starts in water at rest, what
   moves has moved for ever.{remark} */
#ifndef {guard}
#define {guard}
#ifdef __FAST_MATH__
#error "compile without -ffast-math: it changes what the sums in f_exp round to"
#endif
#include <math.h>
#define {upper}_JOINTS {joints}
#define {upper}_MEMORY {step.size}
typedef struct {{ int begun; {real} memory[{max(step.size, 1)}]; }} {name}_state;
static inline void {name}_reset({name}_state *s) {{ s->begun = 0; for (int i = 0; i < {max(step.size, 1)}; ++i) s->memory[i] = 0; }}
#define real {real}
#define R(x) ((real)(x))
{_functions(precision)}
{chr(10).join(tables)}
static inline void {name}_step({arguments}) {{
    real in[{made.program.n_inputs}];
    {lines}
}}
#undef real
#undef R
#undef DOTTED
{END}
{chr(10).join(f"#undef f_{f}" for f in PLAIN)}
#endif
"""


def program_text(program: Program, outputs: Sequence[Value]) -> str:
    """Return C text of `void run(const double *in, double *out)`, double precision."""
    tables, body, results = (_statements(program, outputs, "double") if _terms(program, outputs) < MANY
                             else tabled(program, outputs, _literal("double")))
    lines = "\n    ".join([*body, *(f"out[{k}] = {result};" for k, result in enumerate(results))])
    return ("#include <math.h>\n#define real double\n#define R(x) ((real)(x))\n" + _functions("double") + "\n" + "\n".join(tables)
            + f"\nvoid run(const real *in, real *out) {{\n    {lines}\n}}\n")


def test_vector(step: MemoryStep) -> str:
    """Return a table of steps: what goes in and what must come out, `dt_s` < 0 where a run begins; 17 digits."""
    n = step.model.arm.n_links
    joints = range(1, n + 1)
    head = [*(f"{x}{j}_{unit}" for x, unit in (("q", "rad"), ("dq", "rad_s"), ("ddq", "rad_s2")) for j in joints), "u0_m_s", "du0_m_s2",
            "dt_s", *(f"tau{j}_Nm" for j in joints)]
    rows = [torch.cat([*given[:6], answer[0]]) for run in trial_runs(n) for given, answer in inputs_along(step, run)]
    return "\n".join([",".join(head), *(",".join(f"{x:.17g}" for x in row.tolist()) for row in rows)]) + "\n"


def export_c(model: TorqueModel, out: Path, precision: str = "double", digest: str = "", remarks: Sequence[str] = ()) -> dict[str, Any]:
    """Write `out`, a C99 header, and `out`.test.csv, steps to try it by; returns what it is told of.

    Raises ConfigError for another precision, a place that cannot be written to or somebody else's file, ModelError where the model cannot
    be stepped.
    """
    require(precision in PRECISIONS, f"--precision {precision!r}: one of {', '.join(PRECISIONS)}")
    require(not out.is_dir(), f"--out {out}: is a folder: name a file, such as {out / 'arm.h'}")
    name = re.sub(r"\W", "_", out.stem) or "arm"
    name = f"arm_{name}" if name[0].isdigit() else name
    tests = out.with_name(f"{out.name}.test.csv")
    for path in (out, tests):
        refuse_foreign(path)
    made = recorded(model, whole_sums(model))
    step: Any = made.step
    texts = {out: header(made, name, precision, digest, remarks), tests: test_vector(step)}
    for path, text in texts.items():
        write_own(path, text)
    return {"model": getattr(model, "name", model.kind), "name": name, "precision": precision, "memory": step.size, "std": step.with_std,
            "test_vector": str(tests), "checked": made.deviation}


def as_row(given: Sequence[Tensor]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the inputs of a step, memory aside, as one vector."""
    return torch.cat(list(given[:6])).numpy()
