"""The line of columns.yaml that mends a channel: it names the user's own column, and changes what is wrong alone.

    SI value = unit * scale * (sign * value + offset)        so a further factor is the unit where none is stated, else the scale
"""

import json
import re
from collections.abc import Iterable

import yaml

from nnhydro.recordings.readers.units import factor
from nnhydro.recordings.recording import Origin

PLAIN = re.compile(r"\w[\w ().-]*")


def yaml_text(name: str) -> str:
    """Return the text `name` as YAML takes it for a text: in quotation marks where it needs them."""
    return name if PLAIN.fullmatch(name) and yaml.safe_load(name) == name else json.dumps(name, ensure_ascii=False)


def map_line(origin: Origin, target: str, source: str = "", *, unit: str = "", scale: float = 1.0, sign: int = 1,
             period: float | None = None) -> str:
    """Return the line that maps the channel `target`: what `origin` maps now, changed by a unit, a factor, a sign or a period in SI.

    `source` is the channel whose column it takes, `target` itself by default. Raises ConfigError for an unknown unit.
    """
    now = origin.mapped.get(source or target, {})
    stated = str(now.get("unit", ""))
    if unit and stated and factor(stated, target) != 1:
        unit, scale = stated, scale * factor(unit, target)
    unit, scale, offset = unit or stated, scale * float(now.get("scale", 1)), sign * float(now.get("offset", 0))
    turn = float(now.get("period", 0)) if period is None else period / abs(scale * (factor(unit, target) if unit else 1))
    keys = {"unit": unit, "scale": f"{scale:.6g}" if scale != 1 else "", "sign": "-1" if sign * int(now.get("sign", 1)) < 0 else "",
            "offset": f"{offset:.10g}" if offset else "", "period": f"{turn:.6g}" if turn else ""}
    said = "".join(f", {key}: {value}" for key, value in keys.items() if value)
    column = yaml_text(str(now.get("from", source or target)))
    return f"{target}: {{from: {column}{said}}}" if said else f"{target}: {column}"


def place(origin: Origin, targets: Iterable[str]) -> str:
    """Return where the lines of `targets` belong, in words: some of them may be there already, and are replaced."""
    known, several = [target for target in targets if target in origin.mapped], len(list(targets)) > 1
    instead = f", in place of the {'lines of these names' if several else 'line of this name'}" if known else ""
    return f"in columns.yaml or --map FILE{instead}"


def mapping_text(origin: Origin, target: str, steady: bool = False, **changes: str | float) -> str:
    """Return the line of `map_line` with the place where it belongs; with `steady`, for the tables in steady/."""
    line = map_line(origin, target, **changes)  # type: ignore[arg-type]
    if not steady:
        return f"'{line}' {place(origin, [target])}"
    return f"'{line}' under 'steady:' {place(origin, [target])}" if origin.mapped else f"'steady: {{{line}}}' {place(origin, [target])}"
