"""The joint torques of a model: a sum of named load terms."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import torch
from numpy.typing import ArrayLike
from torch import Tensor

from nnhydro.errors import ModelError, require
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LinearTerm, LoadTerm, term_of
from nnhydro.physics.motion import tensor


@final
@dataclass(frozen=True)
class Loads:
    """Torque at the joints as a sum of named terms; the empty sum is the arm without mass in no water."""

    terms: Mapping[str, LoadTerm]

    def by_term(self, flow: Flow) -> dict[str, Tensor]:
        """Return the torque (n, joints) N m of each term."""
        return {name: term.torque(flow) for name, term in self.terms.items()}

    def torque(self, flow: Flow) -> Tensor:
        """Return the sum of all terms, (n, joints) N m."""
        return sum(self.by_term(flow).values(), start=torch.zeros_like(flow.motion.qd))

    def hub_force(self, flow: Flow) -> Tensor:
        """Return the force (n, 2) N along X and Y that the hub must supply; what acts at a joint alone needs none."""
        joints, at_hub = flow.arm.n_links, replace(flow, hub=True)
        supplied = [term.torque(at_hub)[:, joints:] for term in self.terms.values()]
        return sum((part for part in supplied if part.shape[1] == 2), start=torch.zeros(len(flow.motion), 2, dtype=torch.float64))

    def plus(self, name: str, term: LoadTerm) -> "Loads":
        """Return a new sum with one more term; this one is unchanged. Raises ModelError for a name that is taken."""
        require(name not in self.terms, f"the sum already has a term called {name!r}: give this one another name", ModelError)
        return replace(self, terms={**self.terms, name: term})

    def linear(self) -> dict[str, LinearTerm]:
        """Return the terms that are linear in their parameters."""
        return {name: term for name, term in self.terms.items() if isinstance(term, LinearTerm)}

    def with_linear(self, theta: ArrayLike) -> "Loads":
        """Return a new sum with the linear parameters `theta` (p,), in the order of the columns of `linear()`; this one is unchanged."""
        terms, values, start = dict(self.terms), tensor(theta), 0
        for name, term in self.linear().items():
            size = len(term.linear_values())
            terms[name] = term.with_linear(values[start:start + size])
            start += size
        return replace(self, terms=terms)

    def document(self) -> dict[str, Any]:
        """Return the sum as model files store it."""
        return {name: term.document() for name, term in self.terms.items()}

    @staticmethod
    def parse(document: Mapping[str, Any]) -> "Loads":
        """Return the sum that `document()` stored."""
        return Loads({name: term_of(term) for name, term in document.items()})
