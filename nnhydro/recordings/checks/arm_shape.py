"""Links that no strip theory fits, and masses that lie outside their link."""

from collections.abc import Iterator

from nnhydro.recordings.arm import Arm
from nnhydro.recordings.checks.oddity import ArmCheck, Oddity, check

BEYOND = 0.25  # of the length: heavy motors or payloads may put the mass centre a little outside


@check
class Stubby(ArmCheck):
    """Strip theory needs links longer than they are wide."""

    id = "stubby"
    looks_for = "links shorter than their diameter"
    remedy = "are the two exchanged, or in mm? Loads on so short a body are beyond strip theory"

    def find(self, arm: Arm) -> Iterator[Oddity]:
        """Yield one finding a link; none in air, where nothing hangs on the diameter."""
        for number, link in enumerate(() if arm.dry else arm.links, 1):
            if link.length_m < link.diameter_m:
                yield Oddity(None, "warning", f"arm.yaml links[{number - 1}]", f"link {number} is {link.length_m:g} m long and "
                             f"{link.diameter_m:g} m in diameter", self.remedy)


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
