"""The survey of a campaign with its channels held against the physics: their signs, their order and the unit of the torques."""

from dataclasses import replace

from nnhydro.fitting.channel_order import channel_order
from nnhydro.fitting.torque_unit import torque_unit
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.survey import Survey, survey
from nnhydro.runtime.workers import HERE, Workers


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
