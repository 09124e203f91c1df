"""What a motion of a recipe is: a kind declared in one file of this folder, checked key by key, that gives the reference analytically."""

import re
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from nnhydro.errors import ConfigError
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.readers.validation import Settings, validate
from nnhydro.runtime.registry import choices, import_files
from nnhydro.simulation.motions.carriage import Carriage

Array = NDArray[np.float64]
JointPath = Callable[[Array], tuple[Array, Array, Array]]  # times (n,) s -> q, qd, qdd (n, joints) rad, rad/s, rad/s^2
CarriagePath = Callable[[Array], tuple[Array, Array]]  # times (n,) s -> u0 m/s, du0 m/s^2, both (n,)
NAME = r"[A-Za-z0-9][A-Za-z0-9_.-]*"  # becomes the name of a file


class State(NamedTuple):
    """The motion at n times; joint-relative angles."""

    q: Array  # (n, joints) rad
    qd: Array  # (n, joints) rad/s
    qdd: Array  # (n, joints) rad/s^2
    u0: Array  # (n,) m/s
    du0: Array  # (n,) m/s^2


@dataclass(frozen=True)
class Setting:
    """What a motion may need beside its own keys: the arm, its own random stream, and the folder that paths refer to."""

    arm: Arm
    rng: np.random.Generator
    folder: Path


class Way(NamedTuple):
    """How the joints move, and the carriage too where the motion brings its own."""

    duration: float  # s
    joints: JointPath  # on 0 <= t <= duration
    carriage: CarriagePath | None = None  # on 0 <= t <= duration


@final
@dataclass(frozen=True, eq=False)
class Reference:
    """The commanded motion as a function of time: joints at rest for `rest` s, under way, at rest again; the carriage on top."""

    way: Way
    rest: float  # s
    carriage: Carriage

    @property
    def duration(self) -> float:
        """Length of the recording, s."""
        return self.way.duration + 2 * self.rest

    def at(self, t: Array) -> State:
        """Return the motion at the times `t` (n,) s; before and after the way the joints stand still."""
        local = np.clip(t - self.rest, 0.0, self.way.duration)
        still = ((t < self.rest) | (t > self.rest + self.way.duration)) & (self.rest > 0)
        q, qd, qdd = self.way.joints(local)
        u0, du0 = self.carriage.at(t, self.duration) if self.way.carriage is None else self.way.carriage(local)
        return State(q, np.where(still[:, None], 0.0, qd), np.where(still[:, None], 0.0, qdd), u0,
                     np.where(still, 0.0, du0) if self.way.carriage else du0)


class MotionKind(Settings):
    """An entry of a recipe's list of motions; the leaves declare `kind` with a Literal of one name."""

    name: str = Field(max_length=100)

    @field_validator("name")
    @classmethod
    def _file_name(cls, value: str) -> str:
        if not re.fullmatch(NAME, value):
            raise ValueError("becomes the name of a file: use letters, digits, _ . and -, a letter or digit first")
        return value


class TimedMotion(MotionKind):
    """A motion against time, which becomes one recording."""

    carriage: Carriage = Carriage()
    rest_s: float = Field(default=0.5, ge=0, le=600)

    @abstractmethod
    def path(self, setting: Setting) -> Way:
        """Return the way of the joints; raise ConfigError naming the motion and the key."""

    @final
    def reference(self, setting: Setting) -> Reference:
        """Return the motion as a function of time; raise ConfigError naming the motion and the key."""
        made = Reference(self.path(setting), self.rest_s, self.carriage)
        self.carriage.require_room(made.duration, self.name)
        return made

    def files(self, folder: Path) -> Mapping[str, Path]:
        """Return the files that the motion reads, by the key that names them; none for most kinds."""
        return {}

    @final
    def key(self, name: str) -> str:
        """Return how messages call the key `name` of this motion."""
        return f"motion {self.name!r}: {name}"


def motion_kinds() -> Mapping[str, type[MotionKind]]:
    """Return every kind of motion declared in this folder by its name."""
    import_files("nnhydro.simulation.motions")

    def leaves(base: type[MotionKind]) -> list[type[MotionKind]]:
        return [leaf for sub in base.__subclasses__() for leaf in ([sub] if "kind" in sub.model_fields else []) + leaves(sub)]

    return {str(cls.model_fields["kind"].default): cls for cls in sorted(leaves(MotionKind), key=lambda cls: cls.__name__)}


def motion_of(document: Any, where: str) -> MotionKind:
    """Return the motion that `document` describes; raise ConfigError with one line that starts with `where`."""
    kinds = motion_kinds()
    if not isinstance(document, dict):
        raise ConfigError(f"{where}: a motion is a mapping with kind and name, got {document!r:.80}")
    kind = document.get("kind")
    if not isinstance(kind, str) or kind not in kinds:
        raise ConfigError(f"{where}.kind: {kind!r:.80} is not a kind of motion: {choices(str(kind), sorted(kinds))}")
    return validate(kinds[kind], document, f"{where} ({kind})", ConfigError)
