"""Does a zero that may have another value in every recording move at all? One that stays where it is is an offset, no drift.

    z_u = a_u + mean over recording u of x beta        its value in recording u: its own offset and the common curve
    s^2 (n - 1) / chi^2_5%(n - 1)  <  (r m)^2          it stays: the upper bound of its spread is below a share r of its mean m

The spread s over the n recordings holds the scatter that noise adds, so that too few or too noisy recordings say nothing.
Source: one-sided confidence bound of a variance, Cochran (1934), Math. Proc. Camb. Phil. Soc. 30; the share is ours.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.locks import FEWEST
from nnhydro.diagnosis.race import Race, columns_of, own_of

Array = NDArray[np.float64]
STEADY = 0.25  # r
CHANCE = 0.05


def zeros(race: Race, rest: Sequence[Candidate], candidate: Candidate) -> Array:
    """Return the zero (units,) N m that a candidate with an offset of each recording's own has in each, fitted beside `rest`."""
    kept, bench = [*rest, candidate], race.bench
    take, own = bench.index(columns_of(kept)), bench.p + own_of(kept)
    theta, G = bench.left_out(take, own)[0], bench.unit_sums
    place = bench.p + candidate.own[-1]
    others = ~np.isin(take, bench.p + np.array(candidate.columns, dtype=np.int64))
    here = G[:, place, place] > 0
    left = G[here, place, -1] - G[here][:, place, take[others]] @ theta[others]  # own offset and curve together
    return np.asarray(left / G[here, place, place], np.float64)


def stays(race: Race, rest: Sequence[Candidate], candidate: Candidate) -> bool:
    """Return whether the zero of `candidate`, fitted beside `rest`, is the same in every recording as far as these can tell."""
    from scipy.stats import chi2

    if not (candidate.own and candidate.columns):
        return False
    z = zeros(race, rest, candidate)
    if len(z) < FEWEST:
        return False
    most = float(z.var(ddof=1)) * (len(z) - 1) / float(chi2.ppf(CHANCE, len(z) - 1))
    return most < (STEADY * float(z.mean())) ** 2
