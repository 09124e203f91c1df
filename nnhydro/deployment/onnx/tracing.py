"""Record a torch computation as scalars while it runs: every operation on a tensor that depends on the inputs is repeated on expressions.

Expressions live beside each storage, so that views need no rule of their own and writing into a part of a tensor is just that. Python
decisions taken on values (`if x.any()`) are recorded as they fall for the states traced: check the result at other states.
"""

from collections.abc import Callable, Sequence
from itertools import product
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.utils._python_dispatch import TorchDispatchMode

from nnhydro.deployment.onnx.elementwise import Complex, elementwise
from nnhydro.deployment.onnx.expressions import Program, Scalar, Value, as_cells, combine, scale, sub
from nnhydro.errors import ModelError

Objects = NDArray[np.object_]
FRESH = ("zeros_like", "ones_like", "full_like", "empty_like", "new_zeros", "new_ones", "new_full", "new_empty")  # take the shape only
DECISIONS = ("any", "all", "_local_scalar_dense", "is_nonzero", "equal")
UNIT = 8  # bytes of a storage cell: a complex number takes two


def _constants(x: Any) -> Objects:
    """Plain numbers as an array of objects."""
    values = x.detach().numpy() if isinstance(x, Tensor) else np.asarray(x)
    made = np.empty(values.shape, dtype=object)
    flat = [Complex(float(v.real), float(v.imag)) if np.iscomplexobj(values) else float(v) for v in values.ravel()]
    for place, value in zip(np.ndindex(values.shape), flat, strict=True):
        made[place] = value
    return made


@final
class Recorder(TorchDispatchMode):  # type: ignore[no-untyped-call]  # torch's own has no types
    """Repeats what torch does on the tensors given to `follow`."""

    def __init__(self, program: Program) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self.program = program
        self.cells: dict[int, Objects] = {}
        self.tensors: list[Any] = []  # an address stays taken as long as its tensor lives
        self.rules = rules(program)

    def follow(self, x: Tensor, values: Sequence[Value]) -> None:
        """Take the elements of the contiguous `x` for `values`."""
        self._write(x, np.array(list(values), dtype=object).reshape(x.shape))

    def _is_traced(self, x: Any) -> bool:
        return isinstance(x, Tensor) and x.numel() > 0 and x.untyped_storage().data_ptr() in self.cells

    def _view(self, x: Tensor) -> Objects:
        """The cells of `x`, as a view that can be written to; a complex number is its first cell's pair along a new last axis."""
        cells = self.cells[x.untyped_storage().data_ptr()]
        size = 2 if x.is_complex() else 1
        shape, strides = tuple(x.shape), [s * size * cells.itemsize for s in x.stride()]
        if size == 2:
            shape, strides = (*shape, 2), [*strides, cells.itemsize]
        return np.lib.stride_tricks.as_strided(cells[x.storage_offset() * size:], shape, strides)

    def read(self, x: Any) -> Any:
        """Return the expressions of `x`: an array of objects; lists of tensors item by item, anything else as it is."""
        if isinstance(x, (list, tuple)) and any(isinstance(item, Tensor) for item in x):
            return [self.read(item) for item in x]
        if not isinstance(x, Tensor):
            return x
        if not self._is_traced(x):
            return _constants(x)
        cells = self._view(x)
        if not x.is_complex():
            return cells.copy()
        return np.frompyfunc(Complex, 2, 1)(cells[..., 0], cells[..., 1])

    def _write(self, x: Tensor, values: Objects) -> None:
        """Note the symbolic values of a tensor by the addresses of its elements, so that views share them."""
        if x.numel() == 0:
            return
        address = x.untyped_storage().data_ptr()
        if address not in self.cells:
            unit = UNIT if x.is_complex() else x.element_size()
            whole = torch.empty(0, dtype=torch.float64 if x.is_complex() else x.dtype)
            whole.set_(x.untyped_storage(), 0, (x.untyped_storage().nbytes() // unit,), (1,))
            self.cells[address] = _constants(whole)
            self.tensors.append(x)
        view, values = self._view(x), np.broadcast_to(values, tuple(x.shape))
        if x.is_complex():
            pairs = np.frompyfunc(lambda v: (v.re, v.im) if isinstance(v, Complex) else (v, 0.0), 1, 2)(values)
            view[..., 0], view[..., 1] = pairs
        else:
            view[...] = values

    @classmethod
    def _should_skip_dynamo(cls) -> bool:
        """Nothing here is compiled by torch: without this, torch loads its compiler (3 s) to be told so at each operation."""
        return False

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        """Run `func` and, where it touches what is followed, repeat it on expressions."""
        kwargs = kwargs or {}
        out = func(*args, **kwargs)
        tensors = [x for a in (*args, *kwargs.values()) for x in (a if isinstance(a, (list, tuple)) else [a])]
        name = func._overloadpacket.__name__
        outs = list(out) if isinstance(out, (list, tuple)) else [out]
        empty = all(isinstance(x, Tensor) and x.numel() == 0 for x in outs)
        if not any(map(self._is_traced, tensors)) or name in (*FRESH, *DECISIONS) or empty or not isinstance(outs[0], Tensor):
            self.tensors.append(out)
            return out
        in_place = name.endswith("_") and not name.startswith("_")
        if not in_place and all(self._is_traced(x) for x in outs):
            return out  # a view
        rule = self.rules.get(name.rstrip("_") if in_place else name)
        if rule is None:
            raise ModelError(f"the model uses the operation {name!r}, which an exported model cannot hold yet: report it, naming the model")
        target = args[0] if in_place else out
        values = rule(*map(self.read, args), **{k: self.read(v) for k, v in kwargs.items() if k not in ("dtype", "layout", "device")})
        self._write(target, values)
        self.tensors.append(out)
        return out


def _reduce(x: Objects, dim: Any, keepdim: bool, fold: Callable[[list[Any]], Any]) -> Objects:
    """Fold `x` along the axes `dim` (all where none)."""
    axes = tuple(a % x.ndim for a in ([dim] if isinstance(dim, int) else dim or range(x.ndim)))
    others = [a for a in range(x.ndim) if a not in axes]
    moved = x.transpose(*others, *axes).reshape(*(x.shape[a] for a in others), -1)
    out = np.empty(moved.shape[:-1], dtype=object)
    for place in np.ndindex(out.shape):
        out[place] = fold(list(moved[place]))
    return np.expand_dims(out, axes) if keepdim else out


def _select_rows(x: Objects, index: Sequence[Any]) -> Objects:
    at = tuple(slice(None) if i is None else np.asarray(i, dtype=float).astype(int) for i in index)
    return x[at]


def _diagonal(x: Objects, offset: int = 0, dim1: int = -2, dim2: int = -1) -> Objects:
    """Return matrices with `x` on the main diagonal; raises ModelError for another diagonal."""
    if (offset, dim1, dim2) != (0, -2, -1):
        raise ModelError("the model builds a diagonal other than the main one of the last two axes: not exported yet")
    out = np.full((*x.shape, x.shape[-1]), 0.0, dtype=object)
    np.einsum("...ii->...i", out)[...] = x
    return out


PLACED: dict[str, Callable[..., Any]] = {  # operations that place elements and compute nothing
    "clone": lambda x, **_: x, "_to_copy": lambda x, **_: x, "copy": lambda x, y, *_: np.broadcast_to(y, x.shape),
    "cat": lambda parts, dim=0: np.concatenate([p for p in parts if p.shape != (0,)], axis=dim),
    "stack": lambda parts, dim=0: np.stack(parts, axis=dim), "flip": lambda x, dims: np.flip(x, dims),
    "repeat": lambda x, times: np.tile(x, times), "roll": lambda x, shifts, dims=(): np.roll(x, shifts, dims or None),
    "index": _select_rows, "index_select": lambda x, dim, at: np.take(x, at.astype(float).astype(int), axis=dim),
    "fill": lambda x, value: np.broadcast_to(np.asarray(value, dtype=object), x.shape),
    "zero": lambda x: np.full(x.shape, 0.0, dtype=object), "diag_embed": _diagonal,
}


def rules(program: Program) -> dict[str, Callable[..., Any]]:
    """Return what each operation of torch does to arrays of expressions."""
    table = elementwise(program)
    plus, times = table["add"], table["mul"]

    def total(values: list[Any]) -> Any:
        """Return the sum of the values."""
        if any(isinstance(v, Complex) for v in values):
            return Complex(total([getattr(v, "re", v) for v in values]), total([getattr(v, "im", 0.0) for v in values]))
        return combine([(1.0, program.share(v)) for v in values])

    def dot(a: Sequence[Value], b: Sequence[Value]) -> Value:
        """Return the sum of products, numbers drawn out as factors."""
        parts: list[tuple[float, Value]] = []
        for x, y in zip(a, b, strict=True):
            number, other = (x, y) if not isinstance(x, Scalar) else (y, x)
            parts.append((1.0, program.mul(x, y)) if isinstance(number, Scalar) else (number, program.share(other, 2)))
        return combine(parts)

    def mm(a: Objects, b: Objects) -> Objects:
        return as_cells([dot(row, column) for row, column in product(a, b.T)], (a.shape[0], b.shape[1]))

    def bmm(a: Objects, b: Objects) -> Objects:
        return np.stack([mm(x, y) for x, y in zip(a, b, strict=True)])

    def variance(x: Objects, dim: Any = None, correction: float | None = None, keepdim: bool = False) -> Objects:
        """Return the variance along `dim`, over n - correction (1)."""
        def fold(values: list[Any]) -> Any:
            """Return the variance of the values."""
            mean = scale(combine([(1.0, v) for v in values]), 1 / len(values))
            squares = [program.mul(d, d) for d in (sub(v, mean) for v in values)]
            return scale(combine([(1.0, s) for s in squares]), 1 / (len(values) - (1 if correction is None else correction)))

        return _reduce(x, dim, keepdim, fold)

    def cumulate(x: Objects, dim: int) -> Objects:
        """Return the running sum along `dim`."""
        out = np.moveaxis(x.copy(), dim, 0)
        for k in range(1, len(out)):
            out[k] = plus(out[k - 1], out[k])
        return np.moveaxis(out, 0, dim)

    def mean(x: Objects, dim: Any = None, keepdim: bool = False) -> Any:
        summed = _reduce(x, dim, keepdim, total)
        return times(summed, summed.size / x.size)

    def std(*a: Any, **k: Any) -> Any:
        return table["sqrt"](variance(*a, **k))

    return table | PLACED | {
        "sum": lambda x, dim=None, keepdim=False: _reduce(x, dim, keepdim, total), "mean": mean, "var": variance, "std": std,
        "cumsum": cumulate, "mm": mm, "bmm": bmm, "dot": lambda a, b: mm(a[None], b[:, None])[0, 0],
        "mv": lambda a, b: mm(a, b[:, None])[:, 0],
        "addmm": lambda c, a, b: plus(c, mm(a, b)), "baddbmm": lambda c, a, b: plus(c, bmm(a, b)),
        "amax": lambda x, dim=None, keepdim=False: _reduce(x, dim, keepdim, lambda v: program.apply("maxof", *v)),
        "amin": lambda x, dim=None, keepdim=False: _reduce(x, dim, keepdim, lambda v: program.apply("minof", *v)),
    }


def trace(function: Callable[..., tuple[Tensor, ...]], inputs: Sequence[Tensor], whole: int = 0) -> tuple[Program, list[Objects]]:
    """Return the program of `function` at the float64 `inputs`, its inputs numbered in order, and the expressions of each output.

    Sums of `whole` terms or more are kept as atoms (expressions.py).
    """
    program = Program(sum(x.numel() for x in inputs), whole)
    recorder, number = Recorder(program), 0
    inputs = [x.detach().clone() for x in inputs]
    for x in inputs:
        recorder.follow(x, [program.input(number + k) for k in range(x.numel())])
        number += x.numel()
    with torch.no_grad(), recorder:
        outputs = function(*inputs)
    return program, [recorder.read(x) for x in outputs]
