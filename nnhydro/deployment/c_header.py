"""`FILE.h`: one step in time of a model as one self-contained C99 header without allocation, and `FILE.h.test.csv` to try it by.

    NAME_state s;  NAME_reset(&s);
    NAME_step(&s, q, qd, qdd, u0, du0, dt, tau);            tau, std where the model has a standard deviation

The first step after a reset begins the run, its dt is not read; so does a step with dt < 0.

In single precision the memory is kept and carried on in double, and the torques are taken from it: the travel of a slow tow grows by less
than a float's last digit a step, and whether a strip has turned back must not hang on one.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import torch

from nnhydro import __version__
from nnhydro.deployment.c_program import PRECISIONS, c_function
from nnhydro.deployment.step import BEGIN, NO_INPUTS, MemoryStep, RecordedStep, record_step, record_torques, whole_sums
from nnhydro.errors import require
from nnhydro.models.torque_model import TorqueModel
from nnhydro.runtime.files import comment_text, write_output
from nnhydro.runtime.stamp import refuse_foreign

NOT_FINITE: Final = """
   A step with an input that is NaN or infinite gives NaN and leaves the memory as it was; the next dt counts from the step before."""


def _inputs(step: MemoryStep) -> list[str]:
    """The statements that lay what a step is given before what it remembers."""
    n = step.model.arm.n_links
    fill = [f"s->values[{k * n + i}] = {name}[{i}];" for k, name in enumerate(("q", "qd", "qdd")) for i in range(n)]
    return [*fill, f"s->values[{3 * n}] = u0; s->values[{3 * n + 1}] = du0; s->values[{3 * n + 2}] = s->begun ? dt : {BEGIN!r};"]


def _without_answer(step: MemoryStep) -> list[str]:
    """The statements that end a step where an input is not finite: its torques are NaN, and what was remembered before stays."""
    if not step.size:
        return []
    n = step.model.arm.n_links
    nan = " ".join(f"{target}[i] = NAN;" for target in ("tau", "std")[:1 + step.with_std])
    total = " + ".join(f"s->values[{k}]" for k in range(3 * (n + 1)))
    return [f"const double sum = {total}; /* not finite where one of them is not */",
            f"if (sum - sum != 0) {{ for (int i = 0; i < {n}; ++i) {{ {nan} }} return; }}"]


def _functions(made: RecordedStep, name: str, precision: str) -> tuple[str, list[str]]:
    """The functions of a step in C, and the statements that call them: torques into `out`, the next memory in the place of the old."""
    step = made.step
    parts = [[x for key, values in made.outputs.items() if (key == "memory_next") == memory for x in values.ravel()] for memory in (0, 1)]
    torques, following, motion = *parts, made.program.n_inputs - step.size
    if precision == "double" or not following:
        text = c_function(f"static inline void {name}_outputs", made.program, torques + following, precision)
        out = f"{PRECISIONS[precision]} *const out = s->values + {motion - len(torques)}; /* torques end where the memory begins */"
        return text, [*_inputs(step), *_without_answer(step), out, f"{name}_outputs(s->values, out);"]
    program, torques = record_torques(step)
    text = "\n".join([c_function(f"static inline void {name}_memory", made.program, following, "double", "m_"),
                      c_function(f"static inline void {name}_outputs", program, torques, precision)])
    return text, [*_inputs(step), *_without_answer(step), f"float given[{program.n_inputs}], out[{len(torques)}];",
                  f"{name}_memory(s->values, s->values + {motion});",
                  f"for (int i = 0; i < {motion - 1}; ++i) given[i] = (float)s->values[i]; /* all but dt */",
                  f"for (int i = 0; i < {step.size}; ++i) given[{motion - 1} + i] = (float)s->values[{motion} + i];",
                  f"{name}_outputs(given, out);"]


def header(made: RecordedStep, name: str, precision: str, digest: str, remarks: Sequence[str] = ()) -> str:
    """Return the text of the header; `name` begins every name in it."""
    step = made.step
    joints, with_std, real = step.model.arm.n_links, "std" in made.outputs, PRECISIONS[precision]
    functions, lines = _functions(made, name, precision)
    lines += [f"{target}[{i}] = out[{k * joints + i}];" for k, target in enumerate(("tau", "std")[:1 + with_std]) for i in range(joints)]
    body = "\n    ".join([*lines, "s->begun = 1;"])
    guard, upper, stored = f"{name.upper()}_H", name.upper(), "double" if step.size else real
    remark = comment_text("".join(f"\n   {line}" for line in remarks))
    arguments = (f"{name}_state *s, const {real} q[{joints}], const {real} qd[{joints}], const {real} qdd[{joints}], {real} u0, "
                 f"{real} du0, {real} dt, {real} tau[{joints}]" + (f", {real} std[{joints}]" if with_std else ""))
    model = comment_text(getattr(step.model, "name", step.model.kind))
    return f"""/* {model}: joint torques of an arm in water, one step in time. C99, no allocation, {precision} precision.
   Made by nnhydro {__version__} from the model {digest or "(not stored)"}.
       {name}_state s;  {name}_reset(&s);  {name}_step(&s, q, qd, qdd, u0, du0, dt, tau{", std" * with_std});
   q1 from +X, the others relative to the link inboard, counter-clockwise, rad; u0, du0 carriage along +Y, m/s, m/s^2; dt s since the step
   before; tau N m, what the torque sensors read{"; std N m, its standard deviation" * with_std}. Each is {real}, the arrays of {joints}.
   A run begins with the first step after a reset, whose dt is not read, or with a step of dt < 0: what stands still in it starts in water
   at rest, what moves has long moved at that speed.{NOT_FINITE if step.size else ""}
   No inputs: {NO_INPUTS}.{remark} */
#ifndef {guard}
#define {guard}
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "compile without -ffast-math and -ffinite-math-only: sums in f_exp would round otherwise, and NaN would pass for a number"
#endif
#include <math.h>
#define {upper}_JOINTS {joints}
#define {upper}_MEMORY {step.size}
/* what the last step was given, and what it remembers; double: what is added up for hours keeps its small parts */
typedef struct {{ int begun; {stored} values[{made.program.n_inputs}]; }} {name}_state;
static inline void {name}_reset({name}_state *s) {{ s->begun = 0; for (int i = 0; i < {made.program.n_inputs}; ++i) s->values[i] = 0; }}
{functions}
static inline void {name}_step({arguments}) {{
    {body}
}}
#endif
"""


def test_vector(step: MemoryStep) -> str:
    """Return a table of steps: what goes in and what must come out, `dt_s` < 0 where a run begins; 17 digits."""
    n = step.model.arm.n_links
    joints = range(1, n + 1)
    head = [*(f"{x}{j}_{unit}" for x, unit in (("q", "rad"), ("dq", "rad_s"), ("ddq", "rad_s2")) for j in joints), "u0_m_s", "du0_m_s2",
            "dt_s", *(f"tau{j}_Nm" for j in joints)]
    rows = [torch.cat([*given[:6], answer[0]]) for run in step.tried for given, answer in run]
    return "\n".join([",".join(head), *(",".join(f"{x:.17g}" for x in row.tolist()) for row in rows)]) + "\n"


def export_c(model: TorqueModel, out: Path, precision: str = "double", digest: str = "", remarks: Sequence[str] = ()) -> dict[str, Any]:
    """Write `out`, a C99 header, and `out`.test.csv, steps to try it by; returns what it is told of.

    Raises ConfigError for another precision, a place that cannot be written to or somebody else's file, ModelError where the model cannot
    be stepped.
    """
    require(precision in PRECISIONS, f"--precision {precision!r}: one of {', '.join(PRECISIONS)}")
    require(not out.is_dir(), f"--out {out}: is a folder: name a file, such as {out / 'arm.h'}")
    name = re.sub(r"\W", "_", out.stem, flags=re.ASCII) or "arm"
    name = f"arm_{name}" if name[0].isdigit() else name
    tests = out.with_name(f"{out.name}.test.csv")
    for path in (out, tests):
        refuse_foreign(path)
    made = record_step(model, whole_sums(model))
    step = made.step
    texts = {out: header(made, name, precision, digest, remarks), tests: test_vector(step)}
    for path, text in texts.items():
        write_output(path, text)
    return {"model": getattr(model, "name", model.kind), "name": name, "precision": precision, "memory": step.size, "std": step.with_std,
            "test_vector": str(tests), "checked": made.deviation}
