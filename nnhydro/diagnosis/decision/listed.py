"""How probable it is that a name which fits is the cause, and not one that is on no card and merely resembles it.

    P = LISTED / (1 + o (left / TRUSTED_RATIO)^4),   left as in search.stepwise

u: nats that the unknown gains at the joints that the law loads; o: 1 for a standard term of a joint, else the number of all causes.
A law that is the cause leaves the unknown next to nothing, one that resembles it leaves a share. How large a share speaks against a name
hangs on how probable the cause was before: against the friction of a joint less than against one special cause among all. Below
`FEW_NATS` nothing is left.
"""

from nnhydro.diagnosis.constants import LISTED, TRUSTED_RATIO
from nnhydro.diagnosis.search.stepwise import ScoredSet, Search


def listed_probability(search: Search, found: ScoredSet, k: int) -> float:
    """Return the probability that member `k` of `found` is the cause itself, given that some cause like it is there."""
    library = search.view.library
    left = search.share_left(search.score(tuple(x for x in found.chosen if x != k)), found)
    odds = 1.0 if library.hypotheses[k].effect.standard else float(len(library.key_counts))
    return LISTED / (1.0 + odds * (max(left, 0.0) / TRUSTED_RATIO) ** 4)
