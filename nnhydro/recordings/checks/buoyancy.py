"""Upright arms under water: the baseline's weight is that in air.

    buoyancy of a link = rho (pi / 4) D^2 L g        [N]
"""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.arm import Arm
from nnhydro.recordings.checks.oddity import ArmCheck, Oddity, check

SEEN = 0.01  # of the weight: masses are known no better


@check
class Buoyancy(ArmCheck):
    """Where weight loads the joints, buoyancy does, too."""

    id = "buoyancy"
    looks_for = f"upright arms whose links displace more than {SEEN:.0%} of their mass"
    remedy = "no baseline subtracts it: a diagnosis names it buoyancy_tilt, and its corrected model holds it"

    def find(self, arm: Arm) -> Iterator[Oddity]:
        """Yield one note for the arm."""
        displaced = arm.fluid.density_kg_m3 * np.pi / 4 * arm.D**2 * arm.L
        masses = np.array([link.mass_kg for link in arm.links])
        if arm.gravity_m_s2 > 0 and not arm.sliding and displaced.sum() > SEEN * masses.sum() > 0:
            yield Oddity(None, "note", "arm.yaml gravity_m_s2", f"links of {masses.sum():.3g} kg displace {displaced.sum():.3g} kg of the "
                         "fluid, whose buoyancy the weight does not include", self.remedy)
