"""A claim with which held-out recordings are predicted no better is withdrawn: nobody could act on it.

One by one the claim goes without which the error E on held-out recordings is lowest, as long as E does not rise without it. Then all go
where together they lower E by less than RELEVANT of it.
"""

from dataclasses import replace

from nnhydro.diagnosis.constants import RELEVANT
from nnhydro.diagnosis.decision.decide import Claims
from nnhydro.diagnosis.decision.proof import Proof, prove
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.models.strip_theory import StripTheory
from nnhydro.wording import percent


def withdraw_useless(search: Search, decided: Claims, model: StripTheory, seed: int) -> tuple[Claims, Proof]:
    """Return the claims that lower the error on held-out recordings, the worst withdrawn first, and the errors with them."""
    while True:
        proof = prove(search, decided.claimed, model, seed)
        without = {k: proof.without[search.key(k)] for k in decided.claimed.chosen}
        worst = min(without, key=lambda k: without[k], default=None)
        if worst is None:
            return decided, proof
        burden = without[worst] <= proof.after
        useless = proof.before - proof.after < RELEVANT * proof.before
        if not burden and not useless:
            return decided, proof
        reason = (f"errors on {proof.held_out} held out go from {percent(without[worst] if burden else proof.before)} to "
                  f"{percent(proof.after)} with it: nobody could act on it")
        gone = (worst,) if burden else decided.claimed.chosen
        keys = set(map(search.key, gone))
        decisions = tuple(replace(d, claimed=False, reason=reason) if d.claimed and (d.effect, d.joint) in keys else d
                          for d in decided.decisions)
        decided = Claims(search.score(tuple(k for k in decided.claimed.chosen if k not in gone)), decisions,
                         {k: share for k, share in decided.shares.items() if k not in gone})
