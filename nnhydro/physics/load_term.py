"""What a load term is: a named cause that adds torque at the joints (LOAD: what the drive must supply).

A term declares its parameters once, as dataclass fields made by `parameter`; fits, tables, reports and model files read unit, bounds and
meaning there. A file in physics/loads is the whole registration of its terms; classes declared elsewhere (a confirmed hypothesis) are found
in model files once their module was imported.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self, final

from torch import Tensor

from nnhydro.errors import ModelError
from nnhydro.physics.flow import Flow
from nnhydro.physics.parametrised import ANY_SIZE, ANY_VALUE, PER, ParametricTerm, Values, parameter
from nnhydro.runtime.registry import choices, import_files

__all__ = ["ANY_SIZE", "ANY_VALUE", "PER", "LinearTerm", "LoadTerm", "Values", "parameter", "term_kinds", "term_of"]

HERE = "nnhydro.physics."
FORMER = {"drive_inertia": "rotor_inertia"}  # kinds by the names that files of earlier versions give them


@dataclass(frozen=True)
class LoadTerm(ParametricTerm, ABC):
    """A cause of joint torque. Subclasses are final frozen dataclasses; their fields made by `parameter` are tuples of floats."""

    former: ClassVar[Mapping[str, str]] = {}  # parameters by the names that files of earlier versions give them
    row_by_row: ClassVar[bool] = False  # whether the torque of a row depends on that row alone, in whatever order rows stand

    @abstractmethod
    def torque(self, flow: Flow) -> Tensor:
        """Return the joint torques (n, joints) N m for one run in time order."""

    @classmethod
    def prepare(cls, flows: Sequence[Flow], terms: Sequence[Self]) -> None:
        """Put into the memos of `flows`, the arm in one run with small changes, what `terms` of this class can compute together there.

        By default nothing.
        """

    @classmethod
    def present(cls, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return `given` by the present names of parameters."""
        return {cls.former.get(name, name): value for name, value in given.items()}


@dataclass(frozen=True)
class LinearTerm(LoadTerm):
    """A term whose torque is proportional to its linear parameters: torque = sum_p columns_p(flow) value_p."""

    @abstractmethod
    def columns(self, flow: Flow) -> Tensor:
        """Return d torque / d linear parameter, (n, joints, p), p in the order of `linear_names`."""

    @final
    def torque(self, flow: Flow) -> Tensor:
        """Return columns(flow) times the linear parameters, (n, joints) N m."""
        return self.columns(flow) @ self.linear_values()


def _every_kind() -> dict[str, type[LoadTerm]]:
    """Every final term class in memory by its kind, those of physics/loads imported first."""
    import_files("nnhydro.physics.loads")

    def leaves(base: type[LoadTerm]) -> list[type[LoadTerm]]:
        return [leaf for sub in base.__subclasses__() for leaf in ([sub] if sub.kind else []) + leaves(sub)]

    base: Any = LoadTerm  # mypy takes an abstract class for an instance to be made here
    return {cls.kind: cls for cls in sorted(leaves(base), key=lambda cls: cls.kind)}


def term_kinds() -> Mapping[str, type[LoadTerm]]:
    """Return every term declared in physics/loads by its kind."""
    return {kind: cls for kind, cls in _every_kind().items() if cls.__module__.startswith(HERE)}


def term_of(document: Mapping[str, Any]) -> LoadTerm:
    """Return the term that `document` (from `LoadTerm.document`) describes; raise ModelError naming what does not fit."""
    kinds = _every_kind()
    kind = FORMER.get(str(document.get("kind")), str(document.get("kind")))
    if kind not in kinds:
        raise ModelError(f"unknown load term {kind!r}: {choices(kind, term_kinds())}; was the model written by a newer version?")
    try:
        return kinds[kind](**kinds[kind].present(document.get("parameters", {})), **document.get("options", {}))
    except TypeError as cause:
        raise ModelError(f"term {kind!r}: {cause}") from cause
