"""The units of one or several campaigns: recordings, and steady rows in bunches, named after their arm where there are several."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nnhydro.evaluation.protocols.protocol import Material
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import steady_segment
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit, steady_unit, units

Array = NDArray[np.float64]
RowValue = Callable[[Segment, Arm], Array]  # one value per row, (n,)


def arm_name(campaign: Campaign, number: int) -> str:
    """Return what distinguishes the arm from the others: the campaign's folder, else the arm's name."""
    return campaign.root.name if campaign.root is not None else f"{campaign.arm.name}-{number + 1}"


def _units_named(unit: Unit, campaign: Campaign, prefix: str) -> Unit:
    return replace(unit, name=f"{prefix}/{unit.name}", group=f"{prefix}/{unit.group}", arm=campaign.arm)


def comparable(unit: Unit) -> bool:
    """Return True where some rows of `unit` can be compared."""
    return any(segment.tau is not None and bool(segment.keep.any()) for segment in unit.segments())


def _every_unit(material: Material, steady: Callable[[Campaign], list[Unit]] | None) -> list[Unit]:
    """All units of all campaigns, named after their arm where there are several."""
    found: list[Unit] = []
    several = len(material.campaigns) > 1
    for number, (campaign, how, groups) in enumerate(zip(material.campaigns, material.hows, material.groups, strict=True)):
        of_campaign = list(units(campaign, how, material.seed, groups))
        if steady is not None:
            of_campaign = [unit for unit in of_campaign if not unit.steady] + steady(campaign)
        found += [_units_named(unit, campaign, arm_name(campaign, number)) for unit in of_campaign] if several else of_campaign
    return found


def pooled_units(material: Material, steady: Callable[[Campaign], list[Unit]] | None = None) -> tuple[Unit, ...]:
    """Return the units of all campaigns in which rows can be compared; `steady` makes those of the steady tables (bunches by default)."""
    return tuple(unit for unit in _every_unit(material, steady) if comparable(unit))


def left_out(material: Material) -> tuple[str, ...]:
    """Return the names of recordings without a stretch of finite rows long enough to compare."""
    return tuple(unit.name for unit in _every_unit(material, lambda campaign: []) if not comparable(unit))


def steady_by(campaign: Campaign, value: RowValue, edges: Array) -> list[Unit]:
    """Return one unit for each table and bin of `value` between the inner `edges`: steady rows are dealt by their own state."""
    found = []
    for table in campaign.steady:
        place = np.digitize(value(steady_segment(table), campaign.arm), edges)
        for number in np.unique(place):
            found.append(steady_unit(table.rows(place == number), f"{table.name}#{number + 1}"))
    return found


def recording_values(all_units: tuple[Unit, ...], arm: Arm, value: RowValue, summary: Callable[[Array], float]) -> dict[str, float]:
    """Return {group: summary over the compared rows of its recordings}; steady units are passed over."""
    rows: dict[str, list[Array]] = {}
    for unit in all_units:
        for segment in () if unit.steady else unit.segments():
            rows.setdefault(unit.group, []).append(value(segment, unit.arm or arm)[segment.keep])
    return {group: summary(np.concatenate(parts)) for group, parts in rows.items()}


def edges_of(values: dict[str, float], campaigns: tuple[Campaign, ...], value: RowValue, count: int) -> Array:
    """Return the inner edges of `count` bins that hold equally many groups of recordings (steady rows where there is no recording)."""
    samples = np.array(list(values.values()))
    if not len(samples):
        samples = np.concatenate([value(segment, campaign.arm) for campaign in campaigns for segment in campaign.steady_segments()])
    edges: Array = np.quantile(samples, np.arange(1, count) / count)
    return edges


def unit_bins(all_units: tuple[Unit, ...], values: dict[str, float], edges: Array, arm: Arm, value: RowValue) -> NDArray[np.int64]:
    """Return the bin of every unit (units,): that of its group's value; a steady unit's rows lie in one bin already. -1: no rows."""
    bins = np.full(len(all_units), -1)
    for i, unit in enumerate(all_units):
        if unit.steady:
            bins[i] = np.digitize(value(unit.segments()[0], unit.arm or arm)[0], edges)
        elif unit.group in values:
            bins[i] = np.digitize(values[unit.group], edges)
    return bins
