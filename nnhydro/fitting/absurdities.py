"""What a reader of a fit must not overlook: coefficients that no water has, and a model that leaves most of the torque."""

from collections.abc import Sequence

import numpy as np

from nnhydro.fitting.linear.least_squares import Solution
from nnhydro.fitting.linear.statistics import Statistics, total
from nnhydro.physics.load_sum import Loads
from nnhydro.recordings.arm import Arm

USUAL = {"C_D": (0.3, 2.5, "cylinders have 0.3 to 2.5"), "C_M": (0.2, 2.0, "cylinders have 0.2 to 2")}  # general knowledge
LEFT = 0.5  # of the rms torque: a model that leaves more explains little


def absurdities(loads: Loads, solution: Solution, blocks: Sequence[Statistics], arm: Arm) -> list[str]:
    """Return a sentence for each coefficient outside what cylinders have, and for each joint of which most of the torque is left."""
    found, start = [], 0
    for name, term in loads.linear().items():
        for label in term.linear_names():
            low, high, said = USUAL.get(label.partition("[")[0], (-np.inf, np.inf, ""))
            value = float(solution.theta[start])
            start += 1
            if not low <= value <= high and name in ("normal_drag", "added_mass"):
                found.append(f"{label} = {value:.3g}: {said}; diameters, lengths, units and signs right? Something else may hide in it: "
                             "see nnhydro check, then nnhydro diagnose")
    summed = total(blocks)
    size = np.sqrt(summed.s / np.maximum(summed.n, 1))
    for joint, (left, whole) in enumerate(zip(solution.rms, size, strict=True), 1):
        if whole > 0 and left > LEFT * whole:
            found.append(arm.text(f"joint {joint}: {left / whole:.0%} of the torque is left ({left:.3g} of {whole:.3g} N m, rms). The "
                                  "model does not explain these recordings: see nnhydro check, then nnhydro diagnose"))
    return found
