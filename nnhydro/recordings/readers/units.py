"""Foreign units of recorded channels and what they are in SI.

1 lbf = 4.4482216152605 N, 1 kgf = 9.80665 N, 1 in = 0.0254 m, 1 ft = 0.3048 m, 1 nmi = 1852 m. Source: SI brochure; NIST SP 811.
"""

import re
from difflib import get_close_matches
from math import pi

from nnhydro.conventions import CHANNELS, CLOCK, SLIDING, TIME
from nnhydro.errors import ConfigError

_LBF, _KGF, _IN, _FT = 4.4482216152605, 9.80665, 0.0254, 0.3048
_ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": pi / 180, "arcmin": pi / 10800, "rev": 2 * pi}
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": _IN, "ft": _FT}

UNITS: dict[str, dict[str, float]] = {
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "rad": _ANGLES,
    "rad_s": {**{f"{name}/s": value for name, value in _ANGLES.items()}, "rpm": 2 * pi / 60},
    "rad_s2": {f"{name}/s2": value for name, value in _ANGLES.items()},
    "Nm": {"N m": 1.0, "mN m": 1e-3, "kN m": 1e3, "N cm": 1e-2, "N mm": 1e-3, "kgf m": _KGF, "kgf cm": _KGF / 100, "gf cm": _KGF / 1e5,
           "lbf ft": _LBF * _FT, "lbf in": _LBF * _IN, "ozf in": _LBF * _IN / 16},
    "m": _LENGTHS,
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "kgf": _KGF, "gf": _KGF / 1000, "lbf": _LBF, "ozf": _LBF / 16},
    "m_s": {**{f"{name}/s": value for name, value in _LENGTHS.items()}, "km/h": 1 / 3.6, "kn": 1852 / 3600},
    "m_s2": {**{f"{name}/s2": value for name, value in _LENGTHS.items()}, "g": 9.80665},
}

_SPELLINGS = {"°": "deg", "µ": "u", "μ": "u", "²": "2", "^": "", "**": ""}
_WORDS = {"degrees": "deg", "degree": "deg", "degs": "deg", "revolutions": "rev", "turn": "rev", "turns": "rev", "sec": "s", "seconds": "s",
          "second": "s", "milliseconds": "ms", "microseconds": "us", "radians": "rad", "knots": "kn", "knot": "kn", "Nm": "N m",
          "mNm": "mN m", "kNm": "kN m", "Ncm": "N cm", "Nmm": "N mm", "lb in": "lbf in", "in lb": "lbf in", "in lbf": "lbf in",
          "lb ft": "lbf ft", "ft lb": "lbf ft", "ft lbf": "lbf ft", "oz in": "ozf in", "in oz": "ozf in", "in ozf": "ozf in",
          "kg m": "kgf m", "kg cm": "kgf cm", "g cm": "gf cm", "kgcm": "kgf cm", "ozin": "ozf in", "kph": "km/h"}


def _targets() -> dict[str, str]:
    """The SI unit of every channel by its column."""
    names = {TIME: "s", CLOCK: "s"}
    for channel in CHANNELS.values():
        for joint in range(1, 11) if channel.per_joint else [None]:
            names[channel.column(joint)] = channel.unit
            if channel.per_joint:
                names[channel.column(joint, sliding=True)] = SLIDING[channel.unit]
    return names


TARGETS = _targets()  # every column of the contract and the suffix of its SI unit


def _normal(unit: str) -> str:
    for foreign, ours in _SPELLINGS.items():
        unit = unit.replace(foreign, ours)
    unit = re.sub(r"\s*/\s*", "/", re.sub(r"[\s*.·_-]+", " ", unit).strip())
    return _WORDS.get(unit, "/".join(_WORDS.get(part, part) for part in unit.split("/")))


def factor(unit: str, target: str) -> float:
    """Return what one `unit` is in the SI unit of the column `target`; raises ConfigError that lists the units known for it."""
    known = UNITS[TARGETS[target]]
    name = _normal(unit)
    if name in known:
        return known[name]
    elsewhere = next((suffix for suffix, units in UNITS.items() if name in units), None)
    close = get_close_matches(name, known, n=1)
    reason = "is a unit of another quantity" if elsewhere else f"is unknown, did you mean {close[0]!r}?" if close else "is unknown"
    raise ConfigError(f"unit {unit[:40]!r} for {target} {reason}: known are {', '.join(known)}; for any other give 'scale: ...'")
