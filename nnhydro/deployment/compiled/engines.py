"""What runs a program of scalars: Python for one state, numba (extra `fast`) or numpy for many.

numba compiles one loop over the rows, which the machine's widest vectors work off; numpy goes through them in pieces that stay in the
cache. Both run the same statements (source.py), written from the program that the load terms themselves left when they were traced.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, Final, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.deployment.compiled.source import ARRAYS, FUNCTIONS, INLINE, Writer
from nnhydro.deployment.onnx.expressions import Program, Value
from nnhydro.errors import missing_extra, require

Array = NDArray[np.float64]
Function = Callable[..., Any]
ENGINES: Final = ("numba", "numpy")
PIECE: Final = 4096  # rows of numpy's pieces: a hundred names of 32 KiB stay in the second cache
FUSED: Final = {"contract"}  # products and sums may fuse; nothing else of the arithmetic may change


def engine_called(name: str | None) -> str:
    """Return the engine `name`, by default numba where it is installed; raises ConfigError, MissingExtraError."""
    if name is None:
        return "numba" if find_spec("numba") is not None else "numpy"
    require(name in ENGINES, f"engine {name!r}: one of {', '.join(ENGINES)}")
    if name == "numba" and find_spec("numba") is None:
        missing_extra("numba", "fast", "the engine 'numba'")
    return name


@final
@dataclass(frozen=True)
class EngineColumns:
    """`count` numbers a row in the one-dimensional array `name`: row by row, or column by column, each column `stride` long."""

    name: str
    count: int
    stride: int = 0

    def at(self) -> list[str]:
        """How a loop over the rows i reads or writes each."""
        return [f"{self.name}[i + {j * self.stride}]" if self.stride else f"{self.name}[{self.count}*i + {j}]" for j in range(self.count)]


def _make(name: str, arguments: Sequence[str], lines: Sequence[str], namespace: Mapping[str, Any]) -> Function:
    """The function of that source."""
    source = f"def {name}({', '.join(arguments)}):\n" + "".join(f"    {line}\n" for line in lines)
    scope = dict(namespace)
    exec(compile(source, f"<nnhydro {name}>", "exec"), scope)
    function: Function = scope[name]
    return function


def _scalar_functions() -> dict[str, Any]:
    return {name: getattr(math, name) for name in FUNCTIONS if name not in ("abs", "pow")} | {"abs": abs, "pow": math.pow}


def step(program: Program, outputs: Sequence[Value]) -> Function:
    """Return a function of the inputs, one number each, that gives the outputs of one state as a tuple."""
    names = [f"x{k}" for k in range(program.n_inputs)]
    lines, results = Writer(program, INLINE, names).statements(outputs)
    lines = [line for line in lines if line not in {f"{name} = {name}" for name in names}]
    return _make("step", names, [*lines, f"return ({', '.join(results)},)"], _scalar_functions())


def numba_step(program: Program, outputs: Sequence[Value]) -> Function:
    """Return `step` compiled; it is compiled at once, so that no call waits."""
    import numba

    compiled: Function = numba.njit([(numba.float64,) * program.n_inputs], fastmath=FUSED, error_model="numpy")(step(program, outputs))
    return compiled


def numba_rows(program: Program, outputs: Sequence[Value], inputs: Sequence[EngineColumns], out: EngineColumns) -> Function:
    """Return kernel(n, *inputs, out) that computes n rows; all arrays are one-dimensional and contiguous."""
    import numba

    from nnhydro.deployment.compiled import sine

    lines, results = Writer(program, INLINE, [text for columns in inputs for text in columns.at()]).statements(outputs)
    body = [*lines, *(f"{at} = {result}" for at, result in zip(out.at(), results, strict=True))]
    loop = ["for i in range(n):", *(f"    {line}" for line in body)]
    namespace = _scalar_functions() | {"sin": sine.sin, "cos": sine.cos}
    written = _make("rows", ["n", *(columns.name for columns in inputs), out.name], loop, namespace)
    compiled: Function = numba.njit(fastmath=FUSED, error_model="numpy")(written)
    return compiled


def numpy_rows(program: Program, outputs: Sequence[Value], inputs: Sequence[EngineColumns], out: EngineColumns) -> Function:
    """Return what `numba_rows` returns, computed with numpy; only for arrays that hold their rows one after the other."""
    names = [f"x{k}" for k in range(program.n_inputs)]
    lines, results = Writer(program, ARRAYS, names).statements(outputs)
    lines = [line for line in lines if line not in {f"{name} = {name}" for name in names}]
    renamed = {"atan": np.arctan, "asin": np.arcsin, "acos": np.arccos, "pow": np.power}
    namespace = {name: renamed.get(name) or getattr(np, name) for name in FUNCTIONS}
    namespace |= {"larger": np.maximum, "smaller": np.minimum, "chosen": np.where, "sign": np.sign}
    piece = _make("piece", names, [*lines, f"return ({', '.join(results)},)"], namespace)

    def rows(n: int, *arrays: Array) -> None:
        """Fill the last of `arrays` from the others, `n` rows, in pieces that stay in the cache."""
        *given, made = (a.reshape(n, columns.count) for a, columns in zip(arrays, (*inputs, out), strict=True))
        with np.errstate(all="ignore"):
            for start in range(0, n, PIECE):
                some = slice(start, start + PIECE)
                for column, result in enumerate(piece(*(np.ascontiguousarray(x) for a in given for x in a[some].T))):
                    made[some, column] = result

    return rows
