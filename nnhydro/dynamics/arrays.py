"""Numbers in and out: numpy arrays, lists or torch tensors of any leading shape, rows inside."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.errors import ModelError, require

Number = float | Sequence[float] | NDArray[Any] | Tensor
Answer = Any  # numpy where numpy was given, torch where any torch tensor was


def _tensor(x: Any, name: str) -> Tensor:
    require(x is not None, f"{name} is not given (None): give numbers", ModelError)
    try:
        made = x.to(torch.float64) if isinstance(x, Tensor) else torch.from_numpy(np.array(x, dtype=np.float64))
    except (TypeError, ValueError) as cause:
        raise ModelError(f"{name} = {x!r:.80} is not an array of numbers: {cause}") from cause
    require(bool(torch.isfinite(made.detach()).all()), f"{name} holds NaN or infinite values: a state must be finite", ModelError)
    return made


@final
@dataclass(frozen=True)
class Form:
    """How the caller writes a state: the axes before the joints, and whether in numpy."""

    lead: tuple[int, ...]
    numpy: bool

    def out(self, x: Tensor) -> Answer:
        """Return rows (m, ...) in the caller's form; raises ModelError where they are not finite."""
        require(bool(torch.isfinite(x.detach()).all()), "the answer is infinite: an angle, a rate, an acceleration or a torque is too "
                "large: check their units (rad, rad/s, rad/s^2, N m), and shorten dt if this is a step", ModelError)
        shaped = x.reshape((*self.lead, *x.shape[1:]))
        return shaped.detach().numpy() if self.numpy else shaped


def rows(joints: int, vectors: dict[str, Any], scalars: dict[str, Any]) -> tuple[Form, list[Tensor]]:
    """Return the form and, as rows, `vectors` (m, joints) and `scalars` (m,); their leading axes are broadcast.

    Raises ModelError naming what is not finite or has another number of joints.
    """
    made = {name: _tensor(x, name) for name, x in (vectors | scalars).items()}
    for name in vectors:
        shape = tuple(made[name].shape)
        require(len(shape) >= 1 and shape[-1] == joints, f"{name} has the shape {shape}: this arm has {joints} joint(s), so its last axis "
                f"must have {joints}", ModelError)
    leads = {name: tuple(x.shape[:-1] if name in vectors else x.shape) for name, x in made.items()}
    try:
        lead = tuple(np.broadcast_shapes(*leads.values()))
    except ValueError as cause:
        said = ", ".join(f"{name} {shape}" for name, shape in leads.items() if shape)
        raise ModelError(f"leading axes do not fit together: {said}") from cause
    tensors = [x.expand(*lead, joints).reshape(-1, joints) if name in vectors else x.expand(lead).reshape(-1) for name, x in made.items()]
    return Form(lead, not any(isinstance(x, Tensor) for x in (vectors | scalars).values())), tensors
