"""What looks wrong in recordings: one oddity a file; a file in this folder is found by itself, nothing else lists it."""

import importlib
import pkgutil

from nnhydro.recordings.checks.oddity import CHECKS

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")

__all__ = ["CHECKS"]
