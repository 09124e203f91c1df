"""One arm is held out, each in turn: how well a model carries over to an arm of another size (Rivera's L/D as an input of the network)."""

from nnhydro.errors import CampaignError, require
from nnhydro.evaluation.protocols.pool import arm_name, pooled_units
from nnhydro.evaluation.protocols.protocol import Material, Split, protocol, rounds


@protocol("leave-arm-out", "one arm held out, each in turn (a folder of campaigns)")
def leave_arm_out(material: Material) -> Split:
    """Return one fold an arm; raises CampaignError where there is only one, or where the arms differ in their number of joints."""
    campaigns = material.campaigns
    require(len(campaigns) > 1, "leave-arm-out: there is one arm only: give a folder of campaigns, each with its own arm.yaml",
            CampaignError)
    require(len({campaign.arm.n_links for campaign in campaigns}) == 1,
            "leave-arm-out: the arms have different numbers of joints: only arms with equally many joints can share a model", CampaignError)
    units = pooled_units(material)
    names = [arm_name(campaign, number) for number, campaign in enumerate(campaigns)]
    require(len(set(names)) == len(names), f"two campaigns are called alike ({', '.join(names)}): rename a folder", CampaignError)
    of_arm = {name: tuple(i for i, unit in enumerate(units) if unit.name.startswith(f"{name}/")) for name in names}
    return Split(units, rounds(units, list(of_arm.items())))
