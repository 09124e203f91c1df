"""Settings of all tests: repeatable examples, one thread, and the folder of shared rigs on the path."""

import sys
from pathlib import Path

import torch
from hypothesis import settings

HERE = Path(__file__).resolve().parent
for folder in (HERE, HERE / "physics"):  # tests are imported by path; rigs.py and golden_deviations.py are imported by name
    sys.path.insert(0, str(folder))

settings.register_profile("nnhydro", derandomize=True, deadline=None, max_examples=40)
settings.load_profile("nnhydro")
torch.set_num_threads(1)
