"""What a trained memory is shown of a data set, as arrays: `python training/strip_memory/rows.py FOLDER`, from the root.

The stretches and whole recordings of nnhydro/fitting/network/strip_net, and the true force of every strip, to FOLDER/SET.npz. run.py needs
nothing else, so that the nets can be trained where nnhydro is not installed.
"""

import sys
import tomllib
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from scipy import signal

import nnhydro.fitting.network.strip_net.rows as strip_rows
from nnhydro.evaluation.protocols.protocol import Material, protocol_called
from nnhydro.models.learned.strip_inputs import StripInputs
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import open_campaign
from nnhydro.recordings.repeats import group_names

CONFIG = tomllib.loads((Path(__file__).parent / "config.toml").read_text())
PROTOCOLS = ("leave-recordings-out", "leave-kind-out")
FOLDS, SEED = 5, 0
RATE, CUTOFF_HZ = 250.0, 25.0  # of the stored forces; of the recorder's filter


def side_by_side(runs: Sequence[strip_rows.StripRun]) -> dict[str, Any]:
    """The arrays of runs (run, t, ...), zeros behind shorter ones."""
    longest = max(len(run.keep) for run in runs)

    def padded(z: Any, *more: tuple[int, int]) -> Any:
        return np.pad(np.asarray(z), [(0, longest - len(z)), *more, *[(0, 0)] * (z.ndim - 1 - len(more))])

    found = {f.name: np.stack([padded(getattr(run.given, f.name)) for run in runs]) for f in fields(StripInputs)}
    found |= {name: np.stack([padded(getattr(run, name)) for run in runs]) for name in ("levers", "columns", "left", "keep")}
    passed = [run.low_pass for run in runs]
    return found | {"way": np.stack([padded(run.way[:, 0, 0]) for run in runs]), "unit": np.array([run.unit for run in runs]),
                    "low_pass": np.stack([padded(z, (0, longest - len(z))) for z in passed if z is not None])}


def true_forces(folder: Path, names: Sequence[str], stride: int, longest: int) -> Any:
    """The water's load N/m on each strip (recording, t, strip), as the recorder's filter would have passed it."""
    low_pass, found = signal.butter(4, CUTOFF_HZ, fs=RATE, output="sos"), []
    for name in names:
        force = signal.sosfilt(low_pass, -np.load(folder / "strips" / f"{name}.npy").astype(float), axis=0)[::2 * stride][:longest]
        found.append(np.pad(force, [(0, longest - len(force)), (0, 0)]))
    return np.stack(found).astype(np.float32)


def write(name: str, target: Path) -> None:
    """Write the arrays of a data set."""
    campaign, usual = open_campaign(Path("datasets") / name), strip_rows.ROWS
    every, units = {}, ()
    for protocol in PROTOCOLS:
        split = protocol_called(protocol).split(Material((campaign,), (campaign.plan(),), (group_names(campaign),), FOLDS, SEED))
        units = split.units
        every |= {f"{protocol}/{k}/{part}": np.array(getattr(fold, part))
                  for k, fold in enumerate(split.folds) for part in ("fitted", "held_out")}
    for part, rows in (("stretch", usual), ("whole", sys.maxsize // 10**6)):
        strip_rows.ROWS = rows
        every |= {f"{part}/{key}": z for key, z in side_by_side(strip_rows.runs_of(units, campaign.arm)).items()}
    strip_rows.ROWS = usual
    segments = [unit.segments()[0] for unit in units]
    flow, stride, longest = Flow(campaign.arm, Motion.of(segments[0])), strip_rows._stride(segments[0]), every["whole/keep"].shape[1]
    every["tau"] = np.stack([np.pad(segment.tau[::stride], [(0, longest - len(segment.tau[::stride])), (0, 0)]) for segment in segments])
    every["force"] = true_forces(Path("datasets") / name, [unit.name for unit in units], stride, longest) / float(flow.rho * flow.D[0] ** 3)
    np.savez(target / f"{name}.npz", **every)


if __name__ == "__main__":
    for called in CONFIG["sets"]:
        write(called, Path(sys.argv[1]))
