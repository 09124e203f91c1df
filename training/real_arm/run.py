"""What a frictionless rigid arm leaves of a real arm's torque: `python training/real_arm/run.py CAMPAIGN`.

The recipe of the published reference figure: the base parameters of the frictionless rigid arm (all that a dry two-link arm can tell),
unweighted least squares, third-order 5 Hz low-pass forward and backward on the angles and again on every column and on the torque, 0.3 s
trimmed at both ends, one recording left out at a time; rms residual over rms torque a joint. Prints it and writes results.json.
"""

import sys
import tomllib
from pathlib import Path

import numpy as np

from nnhydro.fitting.identify import versions
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import derivatives, resample, stretches
from nnhydro.runtime.files import write_json

HERE = Path(__file__).parent


def filtered_columns(campaign: Campaign, name: str, cutoff_hz: float, order: int, trim_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the columns of the rigid arm (rows, joints, parameters) and the torques (rows, joints) of one recording."""
    low_pass, parts = LowPass(cutoff_hz, order), []
    recording = campaign.load(name)
    for start, stop in stretches(recording):
        part = resample(recording, start, stop)
        dt = float(part.t[1] - part.t[0])
        q = low_pass.apply(part.q, dt)
        still = np.zeros(len(q))
        motion = Motion(*(tensor(x) for x in (part.t, q, derivatives(q, dt, 1), derivatives(q, dt, 2), still, still)))
        X = low_pass.apply(RigidBody.of_arm(campaign.arm).columns(Flow(campaign.arm, motion)).numpy(), dt)
        trim = round(trim_s / dt)
        parts.append((X[trim:-trim], low_pass.apply(part.tau, dt)[trim:-trim]))
    X, tau = (np.concatenate(x) for x in zip(*parts, strict=True))
    return X, tau


def left_unexplained(campaign: Campaign, cutoff_hz: float, order: int, trim_s: float) -> np.ndarray:
    """Return rms residual / rms torque (joints,) over recordings left out one at a time."""
    data = {name: filtered_columns(campaign, name, cutoff_hz, order, trim_s) for name in campaign.names}
    residuals, torques = [], []
    for held_out, (X, tau) in data.items():
        others = [data[name] for name in data if name != held_out]
        A = np.concatenate([x.reshape(-1, x.shape[2]) for x, _ in others])
        theta = np.linalg.lstsq(A, np.concatenate([y.ravel() for _, y in others]), rcond=1e-9)[0]
        residuals.append(tau - X @ theta)
        torques.append(tau)
    rms = [np.sqrt((np.concatenate(x) ** 2).mean(axis=0)) for x in (residuals, torques)]
    return rms[0] / rms[1]


def main() -> None:
    """Print and store the figure for the campaign named on the command line."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    campaign = open_campaign(Path(sys.argv[1]))
    share = left_unexplained(campaign, **config)
    print(f"{campaign.arm.name}: left unexplained {' / '.join(f'{x:.3f}' for x in share)} of the rms torque (joint 1 / joint 2)")
    write_json(HERE / "runs" / f"{Path(sys.argv[1]).name}.json", {"unexplained": share.tolist(), "config": config,
               "campaign_sha256": campaign.sha256(), "versions": versions()})


if __name__ == "__main__":
    main()
