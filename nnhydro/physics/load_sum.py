"""The joint torques of a model: a sum of named load terms."""

from collections.abc import Iterator, Mapping, Sequence
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

    def torques(self, flows: Sequence[Flow]) -> list[Tensor]:
        """Return the sum of all terms (n, joints) N m at each of `flows`: one run of the arm, changed in some ways.

        Terms that load each row by itself are computed at all flows in one pass, others as far as they can be.
        """
        if len(flows) < 2:
            return [self.torque(flow) for flow in flows]
        at_once = Loads({name: term for name, term in self.terms.items() if term.row_by_row})
        others = Loads({name: term for name, term in self.terms.items() if not term.row_by_row})
        kinds: list[type[LoadTerm]] = list(dict.fromkeys(map(type, others.terms.values())))
        for kind in kinds:
            kind.prepare(flows, [term for term in others.terms.values() if isinstance(term, kind)])
        parts = torch.split(at_once.torque(Flow.join(flows)), [len(flow.motion) for flow in flows])
        return [part + others.torque(flow) for part, flow in zip(parts, flows, strict=True)] if others.terms else list(parts)

    def with_hub(self, flow: Flow) -> dict[str, Tensor]:
        """Return, of each term that the hub must carry, what joints and hub supply, (n, joints + 2) N m and N along X and Y."""
        made = {name: term.torque(replace(flow, hub=True)) for name, term in self.terms.items()}
        return {name: supplied for name, supplied in made.items() if supplied.shape[1] == flow.arm.n_links + 2}

    def hub_force(self, flow: Flow) -> Tensor:
        """Return the force (n, 2) N along X and Y that the hub must supply; what acts at a joint alone needs none."""
        none = torch.zeros(len(flow.motion), 2, dtype=torch.float64)
        return sum((supplied[:, -2:] for supplied in self.with_hub(flow).values()), start=none)

    def plus(self, name: str, term: LoadTerm) -> "Loads":
        """Return a new sum with one more term; this one is unchanged. Raises ModelError for a name that is taken."""
        require(name not in self.terms, f"the sum already has a term called {name!r}: give this one another name", ModelError)
        return replace(self, terms={**self.terms, name: term})

    def linear(self) -> dict[str, LinearTerm]:
        """Return the terms that are linear in their parameters."""
        return {name: term for name, term in self.terms.items() if isinstance(term, LinearTerm)}

    def linear_parameters(self) -> Iterator[tuple[str, LinearTerm, str, str, tuple[float, float]]]:
        """Yield name of the term, term, label, unit and bounds of every linear parameter, in the order of the columns of `linear()`."""
        for name, term in self.linear().items():
            for label, unit, bounds in zip(term.linear_names(), term.linear_units(), term.linear_bounds(), strict=True):
                yield name, term, label, unit, bounds

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
