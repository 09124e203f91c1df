"""The survey of a campaign with its channels held against the physics: their signs, their order, and the unit of the torques.

    u tau = [rigid body + drag + added mass + Coulomb + viscous friction](q)      u: N m in one unit

Each unit in which a logger writes is fitted and judged as the signs of the channels are (channel_order.py); u enters the likelihood of the
recorded numbers as sum_j n_j / k_j log u. Only units far from 1 N m are asked, and only where the physics then explains most of the torque.
Source: ours.
"""

from dataclasses import replace

import numpy as np

from nnhydro.fitting.channel_order import SURE, Assignment, WayFit, channel_order, columns_of, judge, material
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import Oddity
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.readers.units import TARGETS, UNITS
from nnhydro.recordings.survey import Survey, survey
from nnhydro.runtime.workers import HERE, Workers

FAR = 3.0  # times 1 N m: below it, coefficients of drag are as unsure
KNOWN_TO = 0.1  # of the masses here: as loose as for the signs they could vanish
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
    if name in campaign.load(campaign.names[0]).origin.stated:
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
    remedy = (f"is the unit right, or is it a motor's before its gear? Map every joint, '{name}: {{from: {name}, unit: {unit}}}' in "
              "columns.yaml or --map FILE")
    return Oddity(None, "warning", name, campaign.arm.text(what), remedy, "torque_unit")


def survey_with_physics(campaign: Campaign, cutoff_hz: float | None = None, workers: Workers = HERE) -> Survey:
    """Return the survey of a campaign with signs and order of the channels, and the unit of the torques, held against the physics.

    What that says of the torques' signs replaces what work alone says, joint by joint. Of rates that are not those of the angles, physics
    says nothing: these are to be mended first.
    """
    found = survey(campaign, cutoff_hz, workers)
    if found.how is None or not campaign.names or any(
            oddity.check == "rates" and oddity.severity == "warning" for oddity in found.oddities):
        return found
    oddity = channel_order(campaign, found.how)
    replaced = "torque_sign" if oddity is not None else ""
    if oddity is None:
        oddity = torque_unit(campaign, found.how)
    if oddity is None:
        return found
    rest = tuple(oddity for oddity in found.oddities if oddity.check != replaced)
    at = sum(oddity.severity == "error" for oddity in rest)
    return replace(found, oddities=(*rest[:at], oddity, *rest[at:]))
