"""A number to report: value, unit, and a 95 % interval where there is one."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import atan2, floor, hypot, inf, isfinite, log10
from typing import final

import torch
from torch import Tensor

from nnhydro.conventions import Z95

Interval = tuple[float, float]
STEP = 1e-3  # of a parameter's standard deviation: step of the numerical derivative


@final
@dataclass(frozen=True)
class Quantity:
    """`value` in `unit` ("1" for a pure number); a `length`, of a vector for example, is never negative."""

    value: float
    unit: str
    length: bool = False


def _round_to(value: float, step: float) -> str:
    """`value` to the first figure of `step`, to the second where the first is 1 or 2, without an exponent where that is readable."""
    if step <= 0 or not isfinite(step):
        return f"{value:.3g}"
    place = floor(log10(step))
    digits = (1 if step < 2.95 * 10.0**place else 0) - place
    return f"{value:.{max(digits, 0)}f}" if digits <= 6 and abs(value) < 1e6 else f"{value:.3g}"


def format_quantity(quantity: Quantity, interval: Interval | None = None) -> str:
    """Return e.g. "0.50 +- 0.03 N m/rad"; an interval that lies far off centre, or ends at 0, is written out."""
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    if interval is None or not all(map(isfinite, interval)):
        return f"{quantity.value:.3g}{unit}"
    low, high = interval
    half = (high - low) / 2
    if abs(quantity.value - (low + high) / 2) > half / 4 or low == 0 < half:
        return f"{_round_to(quantity.value, half)}{unit} (95 %: {_round_to(low, half)} to {_round_to(high, half)})"
    return f"{_round_to(quantity.value, half)} +- {_round_to(half, half)}{unit}"


def intervals(quantities: Callable[[Tensor], Mapping[str, Quantity]], values: Tensor, covariance: Tensor,
              limits: Mapping[int, tuple[float, float]] | None = None) -> dict[str, Interval]:
    """Return the 95 % interval of each quantity by the delta method.

    `quantities(values)` with the values (p,), `covariance` (p, p) theirs. Good where a quantity is nearly linear over the interval.
    Values with `limits` by their index are not moved beyond them: at a limit the derivative is that of the one side. A quantity that is
    absent there, as the bending of a contact that does not bend, is 0. The interval of a length ends at 0.
    """
    centre, deviations = quantities(values), covariance.diagonal().clamp(min=0).sqrt()
    gradient = {name: torch.zeros(len(values), dtype=torch.float64) for name in centre}
    for p, deviation in enumerate(deviations.tolist()):
        if deviation > 0:
            low, high = (limits or {}).get(p, (-inf, inf))
            ends = [values.clone(), values.clone()]
            ends[0][p], ends[1][p] = max(float(values[p]) - STEP * deviation, low), min(float(values[p]) + STEP * deviation, high)
            if ends[0][p] == ends[1][p]:  # known to all its digits
                continue
            down, up = ({name: quantity.value for name, quantity in quantities(end).items()} for end in ends)
            for name in centre:
                gradient[name][p] = (up.get(name, 0.0) - down.get(name, 0.0)) / float(ends[1][p] - ends[0][p])
    halves = {name: Z95 * float((g @ covariance @ g).clamp(min=0).sqrt()) for name, g in gradient.items()}
    least = {name: 0.0 if quantity.length else -inf for name, quantity in centre.items()}
    return {name: (max(centre[name].value - half, least[name]), centre[name].value + half) for name, half in halves.items()}


def polar(x: float, y: float, unit: str, size: str) -> dict[str, Quantity]:
    """Return a vector as its length, called `size`, and its direction from +X."""
    return {size: Quantity(hypot(x, y), unit, length=True), "direction": Quantity(atan2(y, x), "rad")}
