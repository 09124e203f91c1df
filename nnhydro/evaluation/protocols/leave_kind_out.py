"""Each kind of motion is held out once: how far a model may be trusted on motions unlike those that it was shown.

The kind is the first word of a recording's name (letters up to the first other character): slew_fast_1 and slew2 are slews. Where all
names begin alike, recordings are ordered by how far their links get of the way that they go (fitting/network/kinds.py) and held out in
thirds: motions that turn back most, those between, those that never do. Steady rows are fitted, never held out, where there are recordings.
"""

import re

from nnhydro.errors import CampaignError, require
from nnhydro.evaluation.protocols.pool import pooled_units
from nnhydro.evaluation.protocols.protocol import Material, Split, protocol, rounds
from nnhydro.fitting.network.kinds import progress
from nnhydro.recordings.splitting import Unit

BLOCKS = ("motions that turn back most", "motions between", "motions that never turn back")


def kind_of(name: str) -> str:
    """Return the first word of a recording's name, lower case; an arm's folder before it does not count."""
    found = re.match(r"[A-Za-z]+", name.rpartition("/")[2])
    return found[0].lower() if found else ""


def _split_named(units: tuple[Unit, ...], moving: list[int]) -> dict[str, list[int]]:
    kinds: dict[str, list[int]] = {}
    for i in moving:
        kinds.setdefault(kind_of(units[i].group), []).append(i)
    return kinds


def _order(material: Material, units: tuple[Unit, ...], moving: list[int]) -> dict[str, list[int]]:
    """Blocks of motions ordered by how far their links get on the way they go."""
    arm = material.campaigns[0].arm
    groups: dict[str, list[int]] = {}
    for i in moving:
        groups.setdefault(units[i].group, []).append(i)
    order = sorted(groups, key=lambda group: sum(progress(units[i], arm) for i in groups[group]) / len(groups[group]))
    count = len(BLOCKS)
    parts = {name: order[len(order) * k // count:len(order) * (k + 1) // count] for k, name in enumerate(BLOCKS)}
    return {name: [i for group in part for i in groups[group]] for name, part in parts.items() if part}


@protocol("leave-kind-out", "each kind of motion held out once: the first word of the recordings' names")
def leave_kind_out(material: Material) -> Split:
    """Return a fold a kind; raises CampaignError where there is one recording."""
    units = pooled_units(material)
    moving = [i for i, unit in enumerate(units) if not unit.steady] or list(range(len(units)))
    kinds = _split_named(units, moving)
    if len(kinds) < 2:
        kinds = _order(material, units, moving)
    require(len(kinds) > 1, "all recordings are of one motion: a kind of motion cannot be held out; record another one", CampaignError)
    return Split(units, rounds(units, list(kinds.items())))
