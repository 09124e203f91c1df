"""What torch's elementwise operations do to expressions, complex ones included."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from nnhydro.deployment.onnx.expressions import Program, Value, add, combine, scale, sub


@final
@dataclass(frozen=True)
class Complex:
    """re + i im."""

    re: Value
    im: Value


def _pair(x: Any) -> tuple[Value, Value]:
    if isinstance(x, Complex):
        return x.re, x.im
    return (x.real, x.imag) if isinstance(x, complex) else (x, 0.0)


def _complex(*values: Any) -> bool:
    return any(isinstance(x, (Complex, complex)) for x in values)


def _arithmetic(p: Program) -> dict[str, Callable[..., Any]]:
    """Sums, products and quotients, real or complex."""

    def plus(a: Any, b: Any, alpha: float = 1.0) -> Any:
        """Return a + alpha b."""
        if _complex(a, b):
            (ar, ai), (br, bi) = _pair(a), _pair(b)
            return Complex(plus(ar, br, alpha), plus(ai, bi, alpha))
        return combine([(1.0, p.share(a)), (alpha, p.share(b))])

    def times(a: Any, b: Any) -> Any:
        """Return a b."""
        if _complex(a, b):
            (ar, ai), (br, bi) = _pair(a), _pair(b)
            return Complex(sub(p.mul(ar, br), p.mul(ai, bi)), add(p.mul(ar, bi), p.mul(ai, br)))
        return p.mul(a, b)

    def over(a: Any, b: Any) -> Any:
        """Return a / b."""
        if isinstance(b, (Complex, complex)):
            br, bi = _pair(b)
            size = add(p.mul(br, br), p.mul(bi, bi))
            return over(times(a, Complex(br, scale(bi, -1.0))), size)
        return Complex(p.div(a.re, b), p.div(a.im, b)) if isinstance(a, Complex) else p.div(a, b)

    def size(x: Any) -> Any:
        """Return |x|."""
        if not _complex(x):
            return p.unary("abs", x)
        re, im = _pair(x)
        return p.unary("sqrt", add(p.mul(re, re), p.mul(im, im)))

    def exp(x: Any) -> Any:
        """Return exp x."""
        if not _complex(x):
            return p.unary("exp", x)
        re, im = _pair(x)
        grown = p.unary("exp", re)
        return Complex(p.mul(grown, p.unary("cos", im)), p.mul(grown, p.unary("sin", im)))

    return {"add": plus, "sub": lambda a, b, alpha=1.0: plus(a, b, -alpha), "rsub": lambda a, b, alpha=1.0: plus(b, a, -alpha),
            "mul": times, "div": over, "true_divide": over, "abs": size, "exp": exp, "neg": lambda x: times(x, -1.0),
            "reciprocal": lambda x: over(1.0, x), "square": lambda x: times(x, x), "conj": lambda x: Complex(x.re, scale(x.im, -1.0)),
            "complex": Complex, "hypot": lambda a, b: size(Complex(a, b))}


def _comparisons(p: Program) -> dict[str, Callable[..., Any]]:
    """Comparisons and logic: 1 for true, 0 for false."""

    def above(a: Any, b: Any) -> Any:
        """Return 1 where a > b, else 0."""
        if not any(map(_expression, (a, b))):
            return float(a > b)
        return p.apply("positive", sub(a, b)) if _finite(a, b) else _beyond(a, b)

    def same(a: Any, b: Any) -> Any:
        return p.apply("zero", sub(a, b)) if any(map(_expression, (a, b))) else float(a == b)

    def neither(x: Any) -> Any:
        return sub(1.0, x)

    def both(a: Any, b: Any) -> Any:
        return p.mul(a, b)

    def either(a: Any, b: Any) -> Any:
        return neither(both(neither(a), neither(b)))

    return {"gt": above, "lt": lambda a, b: above(b, a), "ge": lambda a, b: neither(above(b, a)), "le": lambda a, b: neither(above(a, b)),
            "eq": same, "ne": lambda a, b: neither(same(a, b)), "logical_not": neither, "bitwise_not": neither, "logical_and": both,
            "bitwise_and": both, "logical_or": either, "bitwise_or": either}


def _expression(x: Any) -> bool:
    return not isinstance(x, (int, float))


def _finite(*values: Any) -> bool:
    return all(_expression(x) or math.isfinite(x) for x in values)


def _beyond(a: Any, b: Any) -> float:
    """a > b where one of them is infinite and the other any finite expression."""
    return float(a > 0) if not _expression(a) else float(b < 0)


def _bounds(p: Program) -> dict[str, Callable[..., Any]]:
    """Greater, smaller, in between."""

    def larger(a: Any, b: Any) -> Any:
        return (a if a > b else b) if not any(map(_expression, (a, b))) else p.apply("max", a, b)

    def smaller(a: Any, b: Any) -> Any:
        return (a if a < b else b) if not any(map(_expression, (a, b))) else p.apply("min", a, b)

    def clamp(x: Any, min: Any = None, max: Any = None) -> Any:
        raised = x if min is None else larger(x, min)
        return raised if max is None else smaller(raised, max)

    return {"maximum": larger, "minimum": smaller, "clamp_min": larger, "clamp_max": smaller, "clamp": clamp, "where": p.where,
            "relu": lambda x: larger(x, 0.0)}


def elementwise(p: Program) -> dict[str, Callable[..., Any]]:
    """Return for each elementwise operation of torch the function on arrays of expressions that repeats it in the program `p`."""
    table = _arithmetic(p) | _comparisons(p) | _bounds(p)
    for kind in ("sqrt", "log", "tanh", "sin", "cos", "tan", "atan", "asin", "acos", "sign", "sigmoid", "floor", "ceil"):
        table[kind] = lambda x, kind=kind: p.unary(kind, x)
    table |= {"log10": lambda x: scale(p.unary("log", x), 1 / math.log(10)), "log2": lambda x: scale(p.unary("log", x), 1 / math.log(2)),
              "log1p": lambda x: p.unary("log", add(x, 1.0)), "expm1": lambda x: sub(p.unary("exp", x), 1.0),
              "rsqrt": lambda x: p.div(1.0, p.unary("sqrt", x)), "pow": p.power, "sgn": lambda x: p.unary("sign", x)}

    def over_arrays(function: Callable[..., Any]) -> Callable[..., Any]:
        """Return `function` of scalars as one of arrays, element by element."""
        def apply(*args: Any, **kwargs: Any) -> Any:
            """Return the function of every element of the arrays, broadcast."""
            arrays = [a if isinstance(a, np.ndarray) else np.asarray(a, dtype=object) for a in args]
            return np.frompyfunc(lambda *xs: function(*xs, **kwargs), len(arrays), 1)(*arrays)

        return apply

    return {name: over_arrays(function) for name, function in table.items()}
