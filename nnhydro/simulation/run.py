"""One simulated run on a fine, even grid, before any sensor saw it; and the run of an arm that follows its reference exactly."""

import hashlib
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import ConfigError, require
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.arm import Arm
from nnhydro.simulation.motions.motion_kind import Reference, State

Array = NDArray[np.float64]
MAX_ROWS = 5_000_000  # of the fine grid of one run: about 2 GB while its torques are computed


@final
@dataclass(frozen=True, eq=False)
class Run:
    """The motion of the arm and the torques at its joints, every 1/`rate_hz` s from t = 0."""

    name: str
    rate_hz: float
    state: State  # (n, joints), (n,)
    tau: Array  # (n, joints) N m, at the joints
    start: float | None = None  # time of day in s, where the recorder writes it

    @property
    def t(self) -> Array:
        """Times (n,) s."""
        return np.arange(len(self.tau)) / self.rate_hz


def require_length(reference: Reference, sample_rate_hz: float, rate_hz: float, name: str) -> None:
    """Raise ConfigError unless `reference` holds 4 samples and no more than MAX_ROWS steps of 1/`rate_hz` s."""
    seconds = reference.duration
    require(seconds * sample_rate_hz + 1e-6 >= 3, f"motion {name!r}: {seconds:.3g} s hold fewer than 4 samples: lengthen it")
    require(seconds * rate_hz < MAX_ROWS, f"motion {name!r}: {seconds:.6g} s at {rate_hz:.6g} Hz are too many steps: shorten it, or lower "
            "sample_rate_hz or substeps")


def grid(reference: Reference, rate_hz: float) -> Array:
    """Return the times (n,) s of a run of `reference` every 1/`rate_hz` s."""
    # the 1e-6 keeps the last instant where the product is a rounding error short of it
    return np.arange(int(reference.duration * rate_hz + 1e-6) + 1) / rate_hz


def run_prescribed(name: str, reference: Reference, arm: Arm, loads: Loads, rate_hz: float) -> Run:
    """Return the run of `arm` when it follows `reference` exactly: inverse dynamics, with terms of any kind."""
    t = grid(reference, rate_hz)
    state = reference.at(t)
    q, qd, qdd, u0, du0 = (tensor(x) for x in state)
    flow = Flow(arm, Motion(tensor(t), q, qd, qdd, u0, du0))
    total = np.zeros_like(state.q)
    for term, torque in loads.by_term(flow).items():
        bad = np.flatnonzero(~np.isfinite(torque.numpy()).all(axis=1))
        if len(bad):
            raise ConfigError(f"motion {name!r}: terms.{term} gives no finite torque at t = {t[bad[0]]:.4g} s: check its parameters")
        total += torque.numpy()
    return Run(name, rate_hz, state, total)


def stream(seed: int, name: str, purpose: str) -> np.random.Generator:
    """Return the generator for `purpose` ("motion", "sensors") of the recording `name`; equal arguments give equal draws."""
    digest = hashlib.sha256(f"{purpose}:{name}".encode()).digest()
    return np.random.default_rng([seed, *np.frombuffer(digest[:16], dtype="<u4").tolist()])
