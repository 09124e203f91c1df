"""The single swinging cylinder of McLain & Rock's golden files: arm and slews that the tests share."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import torch

from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.arm import Arm

ARM = Arm.model_validate({"fluid": {"density_kg_m3": 1000.0}, "links": [
    {"length_m": 0.65, "diameter_m": 0.071, "mass_kg": 0.0, "com_m": 0.0, "inertia_kg_m2": 0.0}]})


def golden(name: str) -> Any:
    """Return the document of tests/golden/mclain_`name`.json."""
    return json.loads((Path(__file__).parent / "golden" / f"mclain_{name}.json").read_text())


def swing(t, theta, omega, alpha) -> Flow:
    """Return the flow of one link that turns about a hub at rest; all (n,)."""
    column = [tensor(x)[:, None] for x in (theta, omega, alpha)]
    still = torch.zeros(len(t), dtype=torch.float64)
    return Flow(ARM, Motion(tensor(t), *column, still, still))


def golden_slew(document: Any) -> Flow:
    """Return the flow of a slew whose samples stand in the file."""
    return swing(document["t"], document["theta"], document["omega"], document["alpha_t"])


def slew(alpha: float, T: float, sign: float = 1.0, rate: float = 500.0) -> Flow:
    """Return the flow of a rest-to-rest slew: acceleration `alpha` to T/2, deceleration after; sampled from exact formulas."""
    t = np.arange(round(T * rate) + 1) / rate
    speeding = t < T / 2 - 1e-12
    theta = np.where(speeding, alpha * t**2 / 2, alpha * T**2 / 4 - alpha * (T - t) ** 2 / 2)
    omega, acc = np.where(speeding, alpha * t, alpha * (T - t)), np.where(speeding, alpha, -alpha)
    return swing(t, sign * theta, sign * omega, sign * acc)


def twelve_slews() -> list[Flow]:
    """Return the slews of the golden identification."""
    return [slew(s["alpha"], s["T_s"]) for s in golden("identification")["slews"]]
