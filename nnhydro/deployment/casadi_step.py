"""`FILE.casadi`: one step in time of a model as a CasADi function, for optimal control with exact derivatives.

    tau, memory_next = step(q, qd, qdd, u0, du0, dt, memory)                        dt < 0: the run begins with this step

Read it with `casadi.Function.deserialize(text of the file)`. It is made from the program that the model itself left when it was traced.
Where an input is not finite, memory_next is of no use: keep the memory before.
Source: Andersson et al. (2019), Math. Prog. Comp. 11, 1 (CasADi).
"""

from collections.abc import Callable
from functools import reduce
from pathlib import Path
from typing import Any, Final

from nnhydro.deployment.onnx.expressions import Program, Scalar, Value
from nnhydro.deployment.step import record_step, whole_sums
from nnhydro.errors import missing_extra, require
from nnhydro.models.torque_model import TorqueModel
from nnhydro.runtime.files import write_output
from nnhydro.runtime.stamp import refuse_foreign

NAMED: Final = {"abs": "fabs", "max": "fmax", "min": "fmin", "sign": "sign", "sqrt": "sqrt", "exp": "exp", "log": "log", "tanh": "tanh",
                "sin": "sin", "cos": "cos", "tan": "tan", "atan": "atan", "asin": "asin", "acos": "acos", "floor": "floor", "ceil": "ceil",
                "maxof": "fmax", "minof": "fmin"}
EXTREMES: Final = ("maxof", "minof")  # of any number of values, one included


def _atom(casadi: Any, kind: str, given: list[Any]) -> Any:
    """kind(given) as a CasADi expression."""
    plain: dict[str, Callable[..., Any]] = {
        "same": lambda x: x, "mul": lambda a, b: a * b, "div": lambda a, b: a / b, "pow": lambda a, b: a**b,
        "where": lambda c, a, b: casadi.if_else(c > 0.5, a, b), "positive": lambda x: x > 0, "zero": lambda x: x == 0,
        "sigmoid": lambda x: 1 / (1 + casadi.exp(-x))}
    if kind in plain:
        return plain[kind](*given)
    function = getattr(casadi, NAMED[kind])
    return reduce(function, given) if kind in EXTREMES else function(*given)


def expressions(casadi: Any, program: Program, outputs: list[Value], inputs: list[Any]) -> list[Any]:
    """Return the CasADi expressions of `outputs`, those of the inputs being `inputs`."""
    known: dict[int, Any] = dict(enumerate(inputs))

    def of(x: Value) -> Any:
        """Return the CasADi expression of a value: an input, or a weighted sum of atoms."""
        if not isinstance(x, Scalar):
            return casadi.SX(x)
        if not x.terms:
            return casadi.SX(x.bias)
        # one product of vectors: term by term, the way into CasADi takes longer than the sum
        return casadi.dot(casadi.DM(list(x.terms.values())), casadi.vertcat(*(known[k] for k in x.terms))) + x.bias

    for k in sorted(program.dependencies(outputs) - known.keys()):
        known[k] = _atom(casadi, program.atoms[k].kind, [of(x) for x in program.atoms[k].operands])
    return [of(x) for x in outputs]


def casadi_function(model: TorqueModel) -> Any:
    """Return one step of `model` as a casadi.Function: tau (joints,) N m, its std where there is one, the next memory (size,).

    Raises MissingExtraError without CasADi, ModelError where the model cannot be stepped.
    """
    try:
        import casadi
    except ImportError:
        missing_extra("casadi", "casadi", "nnhydro export --format casadi")
    made = record_step(model, whole_sums(model))
    symbols = {name: casadi.SX.sym(name, shape[0]) for name, shape in made.step.shapes().items()}
    scalars = [x for vector in symbols.values() for x in casadi.vertsplit(vector)] if symbols else []
    flat = expressions(casadi, made.program, [x for values in made.outputs.values() for x in values.ravel()], scalars)
    results, at = {}, 0
    for name, values in made.outputs.items():
        results[name], at = casadi.vertcat(*flat[at:at + values.size]), at + values.size
    return casadi.Function("step", list(symbols.values()), list(results.values()), list(symbols), list(results))


def export_casadi(model: TorqueModel, out: Path) -> dict[str, Any]:
    """Write `out`, the text of a CasADi function; returns its inputs and outputs.

    Raises ConfigError for a place that cannot be written to or somebody else's file, and what `casadi_function` raises.
    """
    require(not out.is_dir(), f"--out {out}: is a folder: name a file, such as {out / 'arm.casadi'}")
    refuse_foreign(out)
    made = casadi_function(model)
    write_output(out, made.serialize())
    return {"model": getattr(model, "name", model.kind),
            "inputs": {made.name_in(k): made.size1_in(k) for k in range(made.n_in())},
            "outputs": {made.name_out(k): made.size1_out(k) for k in range(made.n_out())}}
