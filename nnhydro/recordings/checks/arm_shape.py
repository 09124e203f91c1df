"""Links that no strip theory fits, and masses that lie outside their link."""

from collections.abc import Iterator
from math import pi

from nnhydro.recordings.arm import Arm, Link
from nnhydro.recordings.checks.fluid import LIQUID
from nnhydro.recordings.checks.oddity import ArmCheck, Oddity, check

DENSEST = 100_000.0  # kg/m3: osmium has 22,600; a ship described by a dummy link 32,000; g taken for kg give 300,000 and more
BEYOND = 0.25  # of the length: heavy motors or payloads may put the mass centre a little outside


@check
class Stubby(ArmCheck):
    """Strip theory needs links longer than they are wide."""

    id = "stubby"
    looks_for = "links shorter than their diameter"
    remedy = "are the two exchanged, or in cm or mm? Loads on so short a body are beyond strip theory"

    def find(self, arm: Arm) -> Iterator[Oddity]:
        """Yield one finding a link; none in air, where nothing hangs on the diameter."""
        for number, link in enumerate(() if arm.dry else arm.links, 1):
            if link.length_m < link.diameter_m:
                yield Oddity(None, "warning", f"arm.yaml links[{number - 1}]", f"link {number} is {link.length_m:g} m long and "
                             f"{link.diameter_m:g} m in diameter", _likely_size(link, arm.fluid.density_kg_m3) or self.remedy)


def _likely_size(link: Link, fluid_kg_m3: float) -> str:
    """What the mass says of a diameter larger than the length, as a remedy; empty where it says nothing, or may be right."""
    length, wide = link.length_m, link.diameter_m
    sizes = {"are the two exchanged?": (wide, length)}
    sizes |= {f"is the diameter in {unit}? Write diameter_m: {ratio * wide:.6g}": (length, ratio * wide)
              for unit, ratio in (("cm", 1e-2), ("mm", 1e-3))}
    likely = [text for text, (L, D) in sizes.items() if D < L and link.fits_mass(L, D, fluid_kg_m3)]
    return likely[0] if len(likely) == 1 and not link.fits_mass(length, wide, fluid_kg_m3) else ""


@check
class MassCentre(ArmCheck):
    """The mass centre should lie within the link."""

    id = "mass_centre"
    looks_for = "mass centres outside their link"
    remedy = "com_m counts from the link's own joint, in m; right only with a counterweight or payload"

    def find(self, arm: Arm) -> Iterator[Oddity]:
        """Yield one finding a link: a note where it is little outside."""
        for number, link in enumerate(arm.links, 1):
            outside = max(-link.com_m, link.com_m - link.length_m) / link.length_m
            if outside > 0 and link.mass_kg > 0:
                yield Oddity(None, "warning" if outside > BEYOND else "note", f"arm.yaml links[{number - 1}].com_m",
                             f"the mass centre of link {number} at {link.com_m:g} m lies outside its {link.length_m:g} m", self.remedy)


@check
class LinkDensity(ArmCheck):
    """Nothing is denser than osmium, and links in a liquid have the volume that their length and diameter say."""

    id = "link_density"
    looks_for = f"links in a liquid that are denser than any matter ({DENSEST:g} kg/m3)"
    remedy = "is the mass in g, or the diameter that of the bone? Give kg, and the outer diameter in m"

    def find(self, arm: Arm) -> Iterator[Oddity]:
        """Yield one finding a link."""
        for number, link in enumerate(arm.links if arm.fluid.density_kg_m3 >= LIQUID[0] and not arm.sliding else (), 1):
            volume = pi / 4 * link.diameter_m**2 * link.length_m
            if link.mass_kg > DENSEST * volume:
                yield Oddity(None, "warning", f"arm.yaml links[{number - 1}].mass_kg", f"link {number} has {link.mass_kg:g} kg in "
                             f"{1e3 * volume:.3g} litres, {link.mass_kg / volume:.3g} kg/m3: no matter is a quarter as dense", self.remedy)


@check
class Inertia(ArmCheck):
    """An inertia about the mass centre cannot exceed m L^2 / 4: all mass at the two ends."""

    id = "inertia"
    looks_for = "inertias larger than the link's mass at its two ends would have"
    remedy = "inertia_kg_m2 is about the mass centre: subtract mass_kg com_m^2 if it was taken about the joint"

    def find(self, arm: Arm) -> Iterator[Oddity]:
        """Yield one finding a link."""
        for number, link in enumerate(arm.links, 1):
            most = link.mass_kg * (link.length_m + link.diameter_m) ** 2 / 4
            if link.mass_kg > 0 and link.inertia_kg_m2 > most:
                yield Oddity(None, "warning", f"arm.yaml links[{number - 1}].inertia_kg_m2",
                             f"{link.inertia_kg_m2:g} kg m2 exceeds m L^2 / 4 = {most:.3g}", self.remedy)
