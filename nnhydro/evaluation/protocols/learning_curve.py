"""The error against the number of recordings fitted: the same fold is held out while ever more of the rest is shown.

Numbers double from two motions to all; each set holds the one before, steady bunches grow in proportion.
"""

import numpy as np

from nnhydro.errors import CampaignError, require
from nnhydro.evaluation.protocols.pool import pooled_units
from nnhydro.evaluation.protocols.protocol import Fold, Material, Split, protocol
from nnhydro.recordings.splitting import folds

FEWEST = 2  # motions


def sizes(most: int) -> tuple[int, ...]:
    """Return 2, 4, 8, ... and `most`; a size within a quarter of `most` gives way to it."""
    found = [FEWEST * 2**k for k in range(20) if FEWEST * 2**k * 1.25 < most]
    return (*found, most)


@protocol("learning-curve", "error against the number of recordings fitted, the same recordings held out")
def learning_curve(material: Material) -> Split:
    """Return one fold a size; raises CampaignError below three motions."""
    units = pooled_units(material)
    held_out = folds(units, material.fold_count, material.seed)[0]
    rng = np.random.default_rng(material.seed)
    rest = set(range(len(units))) - set(held_out)
    ranked = {steady: sorted({units[i].group for i in rest if units[i].steady == steady}) for steady in (False, True)}
    order = {steady: [groups[k] for k in rng.permutation(len(groups))] for steady, groups in ranked.items()}
    main = not order[False]  # a campaign of steady tables alone counts their bunches
    require(len(order[main]) >= FEWEST, f"learning-curve: {len(order[main])} motion(s) left to fit: record more", CampaignError)
    made = []
    for size in sizes(len(order[main])):
        others = round(size / len(order[main]) * len(order[not main]))
        chosen = {*order[main][:size], *order[not main][:others]}
        fitted = tuple(sorted(i for i in rest if units[i].group in chosen))
        count = sum(1 for i in fitted if units[i].steady == main)
        made.append(Fold(f"{count} fitted", fitted, held_out))
    return Split(units, tuple(made), curve=True)
