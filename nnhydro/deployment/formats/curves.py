"""The coefficients of a physics model over the distance travelled, as a table: what a simulation of one's own can read.

    s_over_D [-], link, C_D [-], C_M [-]            a constant coefficient is a level line
"""

from collections.abc import Callable, Iterator
from typing import Any

import torch
from torch import Tensor

from nnhydro.models.baselines import physics_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.travel.state_model import added_mass_curve, drag_curve, has_travel_scale

HEAD = ("s_over_D", "link", "C_D", "C_M")
FARTHEST, STEPS = 20.0, 80  # diameters: both curves of McLain & Rock are level long before


def _over(model: StripTheory, s: Tensor, link: int, constant: type[Any], symbol: str, curve: Callable[..., Tensor]) -> Tensor:
    """A coefficient at the travels s (n,): level where the model has a constant, its curve where it has one, 0 where it has neither."""
    term = next((term for term in model.loads.terms.values() if isinstance(term, constant)), None)
    if term is not None:
        return torch.full_like(s, float(getattr(term, symbol)[link]))
    return curve(model.loads, s, link) if has_travel_scale(model.loads) else torch.zeros_like(s)


def coefficient_rows(model: TorqueModel) -> Iterator[tuple[float, int, float, float]]:
    """Yield s/D, link (from 1), C_D and C_M, link after link; raises ModelError where the model has no coefficients."""
    model = physics_model(model, "coefficient curves")
    s = torch.linspace(0.0, FARTHEST, STEPS + 1, dtype=torch.float64)
    for link in range(model.arm.n_links):
        C_D = _over(model, s, link, NormalDrag, "C_D", drag_curve)
        C_M = _over(model, s, link, AddedMass, "C_M", added_mass_curve)
        yield from ((float(x), link + 1, float(d), float(m)) for x, d, m in zip(s, C_D, C_M, strict=True))


def curves_csv(model: TorqueModel) -> str:
    """Return the table as CSV text."""
    rows = (f"{s:.9g},{link},{d:.9g},{m:.9g}" for s, link, d, m in coefficient_rows(model))
    return "\n".join([",".join(HEAD), *rows]) + "\n"
