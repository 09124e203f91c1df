"""Which recordings a model has seen: in a fit, a scaling, an early stop, a choice, or through the baseline that it stands on.

Every model says it in its record (`fit["seen"]`, in model.json): the sha256 of the content of each recording and steady run
and its marks (recordings/content_hash.py). A model without that record may have seen anything.

    record["seen"] = seen_record(units(campaign, how), baseline)        whoever fits or chooses writes it
    marks_seen_by(model)                                                None: unknown
"""

from collections.abc import Iterable

from nnhydro.models.torque_model import TorqueModel
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.content_hash import steady_sha256, union
from nnhydro.recordings.splitting import Unit

SEEN = "seen"


def marks_seen_by(model: TorqueModel) -> frozenset[str] | None:
    """Return contents and marks of what `model` has seen: what is compared with a unit's; None where its record does not say."""
    found = model.fit.get(SEEN)
    return frozenset(found) if isinstance(found, list) and all(isinstance(mark, str) for mark in found) else None


def seen_record(used: Iterable[Unit], *models: TorqueModel | None) -> list[str] | None:
    """Return what a model's record says after the units `used`, and all that the `models` it stands on have seen; None where unknown."""
    return union(*(unit.content() for unit in used), *(marks_seen_by(model) for model in models if model is not None))


def seen_campaign(campaign: Campaign, *models: TorqueModel | None, names: Iterable[str] | None = None) -> list[str] | None:
    """Return what a model's record says after the recordings `names` (all by default) and every steady run of `campaign` were looked at."""
    every = [mark for name in (campaign.names if names is None else names) for mark in campaign.marks(name)]
    every += [mark for table in campaign.steady for mark in steady_sha256(table)]
    return union(every, *(marks_seen_by(model) for model in models if model is not None))


def seen_names(model: TorqueModel, campaign: Campaign) -> tuple[str, ...] | None:
    """Return the names of the recordings of `campaign` that `model` has seen; None where its record does not say."""
    seen = marks_seen_by(model)
    return None if seen is None else tuple(name for name in campaign.names if campaign.marks(name) & seen)
