"""What the laws of friction at a joint share: the smooth sign of a joint's rate, and loads that act at their own joint only.

    sgn(qd) ~ tanh(qd / v_0)                                [-], 0 at rest

Friction depends on the relative rate qd_j of the two bodies that meet at joint j, not on absolute rates, and in the LOAD convention it has
the sign of that rate. A joint at rest can hold any friction torque between minus and plus its level: the value 0 given there is the middle
of that dead band, not a measurement. Behind a belt (`drive: remote`) elbow friction reaches motor 1 with the opposite sign
(physics/transmission.py). Source: Rivera (1995), section 3.2, eq. 3-2-4; the smoothing is ours.
"""

from math import isfinite

import torch
from torch import Tensor

from nnhydro.errors import ModelError, require

SIGN_WIDTH = 0.02  # rad/s: far below the rates of a tow-tank test (0.1 to 3), above what is left of encoder noise after filtering
DRY_WIDTH = 0.005  # rad/s: of the step of dry friction where its level is sought; a wider one is made up for by a larger breakaway


def smooth_sign(rate: Tensor, width: float) -> Tensor:
    """Return tanh(rate / width); both in rad/s."""
    return torch.tanh(rate / width)


def own_joint(loads: Tensor) -> Tensor:
    """Return the columns (n, joints, joints) of `loads` (n, joints), each of which acts at its own joint only."""
    return torch.diag_embed(loads)


def require_positive(kind: str, **options: float) -> None:
    """Raise ModelError naming the term `kind` and the option unless every option is a positive finite number."""
    for name, value in options.items():
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        require(number and isfinite(value) and value > 0, f"term {kind!r}: {name} = {value!r} must be a number above 0", ModelError)
