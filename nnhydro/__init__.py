"""Joint torques of robot arms under water: learned from tow-tank recordings, compared with the physics, diagnosed where they differ."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # what type checkers and editors see; at run time a name is imported when it is first used
    from nnhydro.api.benchmark import Benchmark as Benchmark
    from nnhydro.api.benchmark import benchmark as benchmark
    from nnhydro.api.campaign import load as load
    from nnhydro.api.campaign import read_arm as read_arm
    from nnhydro.api.campaign import read_frame as read_frame
    from nnhydro.api.check import Check as Check
    from nnhydro.api.check import check as check
    from nnhydro.api.diagnosis import Diagnosis as Diagnosis
    from nnhydro.api.diagnosis import diagnose as diagnose
    from nnhydro.api.effects import Catalogue as Catalogue
    from nnhydro.api.effects import catalogue as catalogue
    from nnhydro.api.model import Model as Model
    from nnhydro.api.model import identify as identify
    from nnhydro.api.model import load_model as load_model
    from nnhydro.api.model import train as train
    from nnhydro.api.prediction import Prediction as Prediction
    from nnhydro.diagnosis.findings.finding import Finding as Finding
    from nnhydro.dynamics.dynamics import Dynamics as Dynamics
    from nnhydro.errors import NnhydroError as NnhydroError
    from nnhydro.fitting.config import TrainingConfig as TrainingConfig
    from nnhydro.recordings.arm import Arm as Arm
    from nnhydro.recordings.campaign import Campaign as Campaign
    from nnhydro.recordings.recording import Recording as Recording

    __version__: str

_PUBLIC = {
    "load": "nnhydro.api.campaign",
    "read_frame": "nnhydro.api.campaign",
    "check": "nnhydro.api.check",
    "identify": "nnhydro.api.model",
    "train": "nnhydro.api.model",
    "benchmark": "nnhydro.api.benchmark",
    "diagnose": "nnhydro.api.diagnosis",
    "load_model": "nnhydro.api.model",
    "catalogue": "nnhydro.api.effects",
    "Campaign": "nnhydro.recordings.campaign",
    "Recording": "nnhydro.recordings.recording",
    "Arm": "nnhydro.recordings.arm",
    "read_arm": "nnhydro.api.campaign",
    "TrainingConfig": "nnhydro.fitting.config",
    "Check": "nnhydro.api.check",
    "Model": "nnhydro.api.model",
    "Prediction": "nnhydro.api.prediction",
    "Benchmark": "nnhydro.api.benchmark",
    "Diagnosis": "nnhydro.api.diagnosis",
    "Finding": "nnhydro.diagnosis.findings.finding",
    "Catalogue": "nnhydro.api.effects",
    "Dynamics": "nnhydro.dynamics.dynamics",
    "NnhydroError": "nnhydro.errors",
}

__all__ = ["__version__", *_PUBLIC]


def _version() -> str:
    """The version of the installed package, which comes from the git tag; of a source tree that was never installed nothing is known."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("nnhydro")
    except PackageNotFoundError:
        return "0+unknown"


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that `import nnhydro` costs nothing."""
    if name == "__version__":
        return _version()
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'nnhydro' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
