"""A fluid that is neither gas nor liquid: a density in g/cm3, a viscosity in another unit, or the dynamic one.

    mu = rho nu      dynamic viscosity: 1.8e-5 Pa s of air, 1.0e-3 Pa s of water        [Pa s]
"""

from collections.abc import Iterator

from nnhydro.recordings.arm import Arm, Fluid
from nnhydro.recordings.checks.oddity import ArmCheck, Oddity, check

GAS = (0.1, 20.0)  # kg/m3: hydrogen to sulphur hexafluoride, at pressures and temperatures of wind tunnels
LIQUID = (500.0, 3500.0)  # kg/m3: liquefied gas to heavy brines
THIN, THICK = 1e-8, 1e-3  # m2/s: liquid helium has 2e-8, heavy oils 1e-3
WATER = (950.0, 1050.0)  # kg/m3: hot, fresh and salt water
WATER_THIN, WATER_THICK = 1e-7, 5e-4  # m2/s: hot water has 2e-7; 1e-3 is water's dynamic viscosity in Pa s
OF_WATER = 1e-6  # m2/s at 20 C
GAS_MU = (5e-6, 1e-4)  # Pa s: hydrogen to hot gases; water's nu of 1e-6 m2/s in air would give 1e-6


def _within(x: float, span: tuple[float, float]) -> bool:
    return span[0] <= x <= span[1]


@check
class Density(ArmCheck):
    """A fluid is a gas, a liquid, or none (density 0)."""

    id = "density"
    looks_for = "densities that no gas or liquid has, and gases as viscous as water"
    remedy = "give kg/m3: water has 1000, air 1.2, and 1 g/cm3 is 1000 kg/m3; 0 means a dry arm"

    def find(self, arm: Arm) -> Iterator[Oddity]:
        """Yield one finding."""
        rho, nu = arm.fluid.density_kg_m3, arm.fluid.kinematic_viscosity_m2_s
        place = "arm.yaml fluid.density_kg_m3"
        if not arm.dry and not _within(rho, GAS) and not _within(rho, LIQUID):
            yield Oddity(None, "warning", place, f"no gas or liquid has {rho:g} kg/m3", self.remedy)
        elif _within(rho, GAS) and _states_viscosity(arm.fluid) and not _within(rho * nu, GAS_MU):
            yield Oddity(None, "warning", place, f"{rho:g} kg/m3 is a gas, but no gas has a kinematic viscosity of {nu:g} m2/s",
                         f"{self.remedy}; air has 1.5e-5 m2/s, water 1e-6")


@check
class Viscosity(ArmCheck):
    """A liquid's kinematic viscosity lies between those of helium and heavy oil."""

    id = "viscosity"
    looks_for = "kinematic viscosities that no liquid has, or that water of this density does not have"
    remedy = "give the kinematic viscosity in m2/s: water has 1e-6 (dynamic viscosity 1e-3 Pa s / density), 1 cSt is 1e-6 m2/s"

    def find(self, arm: Arm) -> Iterator[Oddity]:
        """Yield one finding where a viscosity is stated."""
        rho, nu = arm.fluid.density_kg_m3, arm.fluid.kinematic_viscosity_m2_s
        if not _within(rho, LIQUID) or not _states_viscosity(arm.fluid):
            return
        odd = not _within(nu, (WATER_THIN, WATER_THICK)) if _within(rho, WATER) else not _within(nu, (THIN, THICK))
        if odd:
            what = f"{nu:g} m2/s is {nu / OF_WATER:.3g} times that of water, odd for a liquid of {rho:g} kg/m3"
            yield Oddity(None, "warning", "arm.yaml fluid.kinematic_viscosity_m2_s", what, self.remedy)


def _states_viscosity(fluid: Fluid) -> bool:
    """Whether arm.yaml states the viscosity: the default is water's, whatever the density."""
    return "kinematic_viscosity_m2_s" in fluid.model_fields_set
