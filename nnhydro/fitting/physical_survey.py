"""The survey of a campaign with its channels held against the physics: their signs, their order, and the unit of the torques.

    u tau = [rigid body + drag + added mass + Coulomb + viscous friction](q)      u: N m in one unit

Each unit in which a logger writes is fitted and judged as the signs of the channels are (channel_order.py); u enters the likelihood of the
recorded numbers as sum_j n_j / k_j log u. Only units far from 1 N m are asked, and only where the physics then explains most of the torque.
Source: ours.
"""

from dataclasses import replace

import numpy as np

from nnhydro.fitting.absolute_angles import absolute_angles
from nnhydro.fitting.channel_order import SURE, Assignment, WayFit, channel_order, columns_of, judge, judged_ways, material, physics_agrees
from nnhydro.fitting.mixed_units import mixed_units
from nnhydro.fitting.stated_units import stated_units
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import Oddity, merge_kinds
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.readers.map_line import map_line, place
from nnhydro.recordings.readers.units import TARGETS, UNITS
from nnhydro.recordings.survey import Survey, survey
from nnhydro.runtime.workers import HERE, Workers

FAR = 3.0  # times 1 N m: below it, coefficients of drag are as unsure
KNOWN_TO = 0.1  # of the masses here: as loose as for the signs they could vanish
FIRST = ("rates", "fast_motion", "stated_speed", "water_speed", "wild_sample", "noise_torque", "no_motion", "same_column")  # to mend before
DENIALS = ("stated_speed", "stated_speed_in_table", "stated_units", "mixed_units", "channel_order", "absolute_angles")
NOTHING = 0.95  # left of the torque: a tenth of its energy is explained; the real rigs of the repository leave 0.7 at the most
MOVED = 0.1  # rad: an arm that moves less may be loaded by waves alone
EXPLAINS, BETTER = 0.3, 0.5  # the likeliest unit leaves less than so much of the torque, and less than so much of what N m leaves


@one_thread()
def judged_units(campaign: Campaign, how: Preparation) -> dict[str, WayFit]:
    """Return every unit that the torques may have with its likelihood, SI under ""; empty where nothing moves or no torque was read."""
    seen = material(campaign, how, KNOWN_TO)
    if seen is None:
        return {}
    n = campaign.arm.n_links
    way = Assignment(tuple(range(n)), (1,) * n, tuple(range(n)), (1,) * n)
    columns, rows = columns_of(seen, way), sum(len(tau) for tau in seen.torques)
    known = UNITS[TARGETS[campaign.arm.column("tau", 1)]]
    found = {}
    for name, unit in {"": 1.0, **{name: unit for name, unit in known.items() if not 1 / FAR < unit < FAR}}.items():
        judged = judge(way, columns, [unit * tau for tau in seen.torques], seen.loads, seen.arm, seen.correlation)
        found[name] = WayFit(way, judged.likelihood + float((rows / seen.correlation).sum() * np.log(unit)), judged.error)
    return found


def torque_unit(campaign: Campaign, how: Preparation) -> Oddity | None:
    """Return which unit the torques seem to have, with the line that maps it; None where N m will do or the user has stated a unit."""
    name = campaign.arm.column("tau", 1)
    origin = campaign.load(campaign.names[0]).origin
    if name in origin.stated:
        return None
    found = judged_units(campaign, how)
    if not found:
        return None
    here, unit = found[""], max(found, key=lambda symbol: found[symbol].likelihood)
    best = found[unit]
    if not unit or best.likelihood - here.likelihood < SURE or best.error > EXPLAINS or best.error > BETTER * here.error:
        return None
    known = UNITS[TARGETS[name]]
    alike = [symbol for symbol in found if symbol and known[symbol] != known[unit] and best.likelihood - found[symbol].likelihood < SURE]
    what = (f"seem to be in {' or '.join([unit, *alike])}: so read, the physics of this arm leaves {best.error:.0%} of the torque, as "
            f"recorded {here.error:.0%}")
    names = [campaign.arm.column("tau", joint + 1) for joint in range(campaign.arm.n_links)]
    lines = ", ".join(f"'{map_line(origin, name, unit=unit)}'" for name in names)
    mapped = "it" if len(names) == 1 else "every joint on a line of its own"
    remedy = f"is the unit right, or is it a motor's before its gear? Map {mapped}, {lines} {place(origin, names)}"
    return Oddity(None, "warning", ", ".join(names), campaign.arm.text(what), remedy, "torque_unit")


def _weightless(arm: Arm) -> bool:
    """Whether neither mass nor inertia nor a fluid is stated: a drive alone, say, whose loads are yet to be found."""
    return not arm.fluid.density_kg_m3 and not any(link.mass_kg or link.inertia_kg_m2 for link in arm.links)


def unexplained_torque(campaign: Campaign, ways: list[WayFit]) -> Oddity | None:
    """Return that no way to read the columns lets physics explain the torques.

    None where it does, where hardly anything moves, or where arm.yaml states nothing that could load a joint.
    """
    if _weightless(campaign.arm) or not ways or min(way.error for way in ways) < NOTHING:
        return None
    readings = (Reading.of(r, campaign.arm) for r in campaign.recordings())
    if not any(reading.moved.max() > MOVED or reading.towed for reading in readings):
        return None
    what = "the physics of this arm explains next to nothing of the torques, whatever signs and order the columns have"
    return Oddity(None, "warning", campaign.arm.column("tau", 1), what, "are torques and angles of the same run, and in step? "
                  "Plot both against time; check masses and fluid in arm.yaml, too", "unexplained_torque")


def physical_oddity(campaign: Campaign, how: Preparation, ways: list[WayFit]) -> Oddity | None:
    """Return what physics finds wrong with the channels of which `ways` to read were judged, the first of its kinds; None for nothing."""
    if not ways:
        return None
    return (absolute_angles(campaign, how, ways) or channel_order(campaign, how, ways) or torque_unit(campaign, how)
            or unexplained_torque(campaign, ways))


def survey_with_physics(campaign: Campaign, cutoff_hz: float | None = None, workers: Workers = HERE) -> Survey:
    """Return the survey of a campaign with signs and order of the channels, and the unit of the torques, held against the physics.

    What that says of the torques' signs, wrong or right, replaces what work alone says. Of rates that are not those of the angles, of
    wild values and of channels that are dead, physics says nothing: these are to be mended first.
    """
    found = survey(campaign, cutoff_hz, workers)
    if found.how is None or not campaign.names or any(oddity.check in FIRST and oddity.severity == "warning" for oddity in found.oddities):
        return found
    unit = mixed_units(campaign, found.how) or stated_units(campaign, found.how)
    ways = [] if unit else judged_ways(campaign, found.how)
    oddity = unit or physical_oddity(campaign, found.how, ways)
    replaced = "torque_sign" if physics_agrees(ways) or (oddity is not None and oddity.check in ("channel_order", "stated_units")) else ""
    rest = tuple(oddity for oddity in found.oddities if oddity.check != replaced)
    at = sum(oddity.severity == "error" for oddity in rest)
    return replace(found, oddities=(*rest[:at], *([oddity] if oddity else []), *rest[at:]))


def denied_channels(campaign: Campaign, cutoff_hz: float | None = None, explained: bool = False) -> list[str]:
    """Return which units, signs or order of channels physics denies, a finding a kind, without remedy: no result on them means anything.

    Where a model has `explained` the torques, other signs, orders and units are not tried: only impossible speeds are looked for.
    """
    found = survey(campaign, cutoff_hz) if explained else survey_with_physics(campaign, cutoff_hz)
    return [f"{kind[0].where}: {kind[0].what}" for kind in merge_kinds(oddity for oddity in found.oddities if oddity.check in DENIALS)]
