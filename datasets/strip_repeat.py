"""How far flows of one and the same motion part: python datasets/strip_repeat.py SET [RECORDING ...]   (minutes of one core each)

Every recording of SET (ns_tank or vortex_tank) is computed COPIES times more, the speed of each strip being off by OFF. What the torque
of one copy is away from the mean of the others, sum |tau_k - mean| / sum |tau|, no model of the motion can know. No nnhydro is imported.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import signal

Array = NDArray[np.float64]

HERE = Path(__file__).parent
COPIES, OFF, SEED = 3, 1e-4, 0


def main(name: str, only: list[str]) -> None:
    """Print a line a recording, and what all of them leave together."""
    sys.path.insert(0, str(HERE / name))
    import make
    from strip_arm import rigid_torque, strip_motions, water_torque
    from strip_tank import ANTI_ALIAS_HZ, RATE, Run, move, water

    tank = make.TANK
    links, low_pass = tank.links(), signal.butter(4, ANTI_ALIAS_HZ, fs=RATE, output="sos")
    rng = np.random.default_rng(SEED)

    def torques(run: Run, off: Array) -> list[Array]:
        """Torques (n, 2) N m of the recording and of its copies, as the recorder's filter passes them; off (copies, strips)."""
        m = move(tank, run)
        w, dw = (np.hstack([x * (1 + OFF * own) for own in off]) for x in strip_motions(m, links))
        copies = forces_of(name, m.t, w, dw, links[0].diameter)
        every = [water(tank, run, m, False), *np.split(copies, len(off), axis=1)]
        return [signal.sosfilt(low_pass, rigid_torque(m, links) + water_torque(m, links, f), axis=0) for f in every]

    parted = size = 0.0
    for run in tank.runs:
        off = rng.standard_normal((COPIES, 8))
        if only and run.name not in only:
            continue
        found = torques(run, off)
        away = np.mean([np.abs(x - (sum(found) - x) / COPIES).sum() for x in found])
        print(f"{run.name:24s} {100 * away / np.abs(found[0]).sum():.1f} %", flush=True)
        parted, size = parted + away, size + np.abs(found[0]).sum()
    print(f"{'all together':24s} {100 * parted / size:.1f} %")


def forces_of(name: str, t: Array, w: Array, dw: Array, D: float) -> Array:
    """Forces (n, strips) N/m at speeds and accelerations (n, strips) in diameters, 1/s and 1/s2."""
    import truth

    if name == "ns_tank":
        return truth.RHO * D**3 * truth.forces(t, w, dw, truth.NU / D**2, truth.GRID)
    return truth.RHO * D**3 * truth.forces(t, w, dw)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
