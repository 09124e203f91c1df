"""Every choice of a training, parsed once from TOML into one frozen object."""

import tomllib
from collections.abc import Collection
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, field_validator

from nnhydro.errors import ConfigError
from nnhydro.features.feature_set import feature_sets
from nnhydro.features.strip_law.state import state_sets
from nnhydro.models.baselines import BASELINES
from nnhydro.recordings.readers.validation import Settings, validate
from nnhydro.runtime.registry import choices

MAX_BYTES = 100_000


def _is_folder(name: str) -> bool:
    try:
        return Path(name).is_dir()
    except (OSError, ValueError):  # too long for a path, or with a zero byte in it
        return False


class TrainingConfig(Settings):
    """Architecture, features and optimisation of a network or hybrid; the defaults are what the benchmark uses."""

    model: Literal["network", "hybrid"] = "hybrid"
    baseline: str = "auto"  # of the hybrid: a name, or the folder of any model; auto: as base_choice.py finds in water, rigid in air
    features: tuple[str, ...] = ("morison", "groups", "angles", "rates", "wake", "arm", "friction", "interference")
    law: tuple[str, ...] = ("reynolds", "span", "bend", "shadow")  # what the strips' drag and added mass depend on; () for no law
    free: bool = True  # whether a part that the mirror need not repeat may be learned, where held-out recordings ask for it
    strip_net: bool = True  # whether a trained memory of the strips may be held, where held-out recordings ask for it
    layers: Literal["common", "parallel"] = "common"  # hidden layers for all torques, or a stack for each
    hidden: tuple[int, ...] = Field(default=(32, 32), min_length=1, max_length=64)  # neurons of each layer
    members: int = Field(default=6, ge=1, le=64)
    bound: float = Field(default=4.0, gt=0, le=100)  # of the residual in units of the Morison scale
    floor: float = Field(default=0.1, gt=0, le=10)  # of the Morison scale in units of the torque's rms
    epochs: int = Field(default=40, ge=1, le=100_000)
    batch: int = Field(default=1024, ge=8, le=1_000_000)
    learning_rate: float = Field(default=2e-3, gt=0, le=1)
    weight_decay: float = Field(default=1.0, ge=0, le=10)
    patience: int = Field(default=20, ge=1, le=100_000)  # epochs of a member without a better validation error
    validation_share: float | None = Field(default=None, gt=0, lt=1)  # of the recordings, for each member its own; none: `watched_share`
    memory_mb: float = Field(default=1000.0, gt=0, le=1e6)  # of training rows; what exceeds it lies in files
    cutoff_hz: float | None = Field(default=None, gt=0, le=1000)
    seed: int = Field(default=0, ge=0, le=2**31)

    @property
    def watched_share(self) -> float:
        """The share of the recordings that a member watches: of a hybrid so many that six members leave out every kind of motion."""
        return self.validation_share or (0.34 if self.model == "hybrid" else 0.15)

    @field_validator("hidden")
    @classmethod
    def _sizes(cls, value: tuple[int, ...]) -> tuple[int, ...]:
        if not all(1 <= size <= 4096 for size in value):
            raise ValueError("each hidden layer has 1 to 4096 neurons")
        return value

    @field_validator("features")
    @classmethod
    def _known_features(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        if not value:
            raise ValueError(f"no feature set: name some of {', '.join(feature_sets())}")
        return _of(value, feature_sets(), "feature set")

    @field_validator("law")
    @classmethod
    def _known_states(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        return _of(value, state_sets(), "set of strip variables")

    @field_validator("baseline")
    @classmethod
    def _known_baseline(cls, value: str) -> str:
        if value != "auto" and value not in BASELINES and not _is_folder(value):
            raise ValueError(f"unknown baseline: {choices(value, ('auto', *BASELINES))} (the folder of a model may stand here, too)")
        return value


def _of(names: tuple[str, ...], known: Collection[str], what: str) -> tuple[str, ...]:
    """The names, if all are known and none stands twice."""
    for number, name in enumerate(names):
        if name not in known or name in names[:number]:
            raise ValueError(f"{what} {name!r} stands twice: remove one" if name in known else
                             f"unknown {what} {name!r}: {choices(name, known)}")
    return names


def read_config(path: Path) -> TrainingConfig:
    """Return the configuration in the TOML file `path`; raises ConfigError with one line naming file and key."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ConfigError(f"{path}: larger than {MAX_BYTES} bytes: is this the right file?")
        document: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as cause:
        raise ConfigError(f"{path}: cannot be read ({cause.strerror or cause}): check the path") from cause
    except (ValueError, RecursionError) as cause:  # no UTF-8, no TOML, numbers of thousands of digits
        raise ConfigError(f"{path}: is not valid TOML: {cause}") from cause
    return validate(TrainingConfig, document, str(path), ConfigError)
