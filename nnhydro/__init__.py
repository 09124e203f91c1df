"""Joint torques of robot arms under water: learned from tow-tank recordings, compared with the physics, diagnosed where they differ."""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_PUBLIC = {
    "Arm": "nnhydro.recordings.arm",
    "read_arm": "nnhydro.recordings.arm",
    "Recording": "nnhydro.recordings.recording",
    "Campaign": "nnhydro.recordings.campaign",
    "open_campaign": "nnhydro.recordings.campaign",
    "Loads": "nnhydro.physics.load_sum",
    "identify": "nnhydro.identification.identify",
    "train": "nnhydro.identification.train",
    "benchmark": "nnhydro.evaluation.benchmark",
    "save_model": "nnhydro.models.storage",
    "load_model": "nnhydro.models.storage",
    "predict": "nnhydro.models.prediction",
    "NnhydroError": "nnhydro.errors",
}

__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that `import nnhydro` costs nothing."""
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'nnhydro' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
