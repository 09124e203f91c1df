"""How far a correction is used: as far as it exceeds what is not known of it.

    c = m (m^2 + e^2) / (m^2 + w^2 v + e^2),     v = q (1 - d)/d  1/E sum_k (m_k - m)^2,     e = FAINT S                  [N m]

m is the mean of the E members' corrections m_k, v its variance by the jackknife. Each member has left out the share d of the recordings,
motions of one kind (fitting/network/kinds.py): members agree where what they learned holds for any kind, and part where a motion leaves
what was trained. How far that predicts an error differs from rig to rig. So the caution q is chosen on recordings of kinds that members
have not seen (fitting/network/stacking.py). Inputs are held within the range of training, where members cannot part any more: w = 1 + 3 e'
widens v outside of it, e' being the excess of learned.py. Among known motions c is m; far from them w^2 v outgrows m^2, and the baseline
remains. e keeps the way through zero smooth. Source: Wiener's filter, sample by sample; jackknife that leaves out d: Shao & Wu (1989),
Ann. Statist. 17, 1176.
"""

from torch import Tensor

FAINT = 1e-3  # of the scale: corrections below it are used whole


def shrink(mean: Tensor, variance: Tensor, scale: Tensor) -> Tensor:
    """Return c of m N m, w^2 v (N m)^2 and S N m, all (n, joints)."""
    power = mean**2 + (FAINT * scale) ** 2
    return mean * power / (power + variance)


def jackknife(members: Tensor, left_out: float, caution: float = 1.0) -> Tensor:
    """Return v (n, joints) of corrections (E, n, joints) N m; 0 for a single member or where nothing was left out."""
    return caution * (1 - left_out) / left_out * (members - members.mean(dim=0)).square().mean(dim=0) if left_out else 0 * members[0]
