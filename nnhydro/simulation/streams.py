"""Random streams: one for each recording and purpose, so that no draw depends on which other recordings there are, or on their order."""

import hashlib

import numpy as np


def stream(seed: int, name: str, purpose: str) -> np.random.Generator:
    """Return the generator for `purpose` ("motion", "sensors") of the recording `name`; equal arguments give equal draws."""
    digest = hashlib.sha256(f"{purpose}:{name}".encode()).digest()
    return np.random.default_rng([seed, *np.frombuffer(digest[:16], dtype="<u4").tolist()])
