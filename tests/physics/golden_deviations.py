"""How closely nnhydro meets the golden vectors: `python tests/physics/golden_deviations.py` prints one line per file.

`tolerance(file)` is what the golden file itself asks for, `deviations(file)` the worst that nnhydro does; tests and table share them.
"""

import re
from dataclasses import dataclass

import numpy as np
import torch
from golden_pins import FILES, golden


def tolerance(file: str) -> tuple[float, float]:
    """Return (relative, absolute) tolerance that the golden file states."""
    text = golden(file)["tolerance"]
    found = (re.search(kind + r" ([0-9.e-]+)", text) for kind in ("relative", "absolute"))
    relative, absolute = (float(m[1]) if m else 0.0 for m in found)
    return relative, absolute


@dataclass(frozen=True)
class Worst:
    """The worst deviation of one file: as a share of its tolerance, and in SI units."""

    share: float
    what: str
    absolute: float
    compared: int


def deviations(file: str) -> Worst:
    """Return the worst deviation of nnhydro from the golden file `file`."""
    relative, absolute = tolerance(file)
    share, what, largest, compared = 0.0, "", 0.0, 0
    for name, value, expected in FILES[file]():
        got, want = np.asarray(value, dtype=float), np.asarray(expected, dtype=float)
        assert got.shape == want.shape, f"{file}, {name}: shape {got.shape} against {want.shape}"
        assert np.isfinite(got).all(), f"{file}, {name}: not finite"
        off = np.abs(got - want)
        allowed = absolute + relative * np.abs(want)
        ratio = float(np.max(np.divide(off, allowed, out=np.where(off > 0, np.inf, 0.0), where=allowed > 0)))
        if ratio > share:
            share, what = ratio, name
        largest, compared = max(largest, float(off.max())), compared + want.size
    return Worst(share, what, largest, compared)


if __name__ == "__main__":
    torch.set_num_threads(1)
    print(f"{'file':22} {'numbers':>8} {'worst / tolerance':>18} {'worst absolute':>15}  where")
    for name in FILES:
        worst = deviations(name)
        print(f"{name:22} {worst.compared:8d} {worst.share:18.2e} {worst.absolute:15.2e}  {worst.what}")
