"""Where the error of a hybrid stands: `python training/independent_tanks/where.py ns_tank vortex_tank`, from root; minutes a tank.

The hybrid of every fold of run.py is trained again. Errors are sum |tau - model| / sum |tau| in % on held-out recordings: by kind of
motion, and by sixths of a recording's rows, the first to the last. Bands in Hz: rms error over rms torque, and the share of all squared
error, in %.
"""

import sys
import tomllib
from collections import defaultdict
from pathlib import Path

import numpy as np

from nnhydro.evaluation.protocols.protocol import Material, protocol_called
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.network.train import train_units
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import open_campaign
from nnhydro.recordings.repeats import group_names

SIXTHS, BANDS = 6, ((0.0, 1.0), (1.0, 2.0), (2.0, 4.0), (4.0, 9.0))


def main() -> None:
    """Print the parts of the error of the hybrids of each tank named on the command line."""
    config = tomllib.loads((Path(__file__).parent / "config.toml").read_text())
    for name in sys.argv[1:]:
        campaign, choices = open_campaign(Path(config["sets"][name]["campaign"])), TrainingConfig(seed=config["seed"])
        how = campaign.plan(choices.cutoff_hz)
        split = protocol_called("leave-recordings-out").split(
            Material((campaign,), (how,), (group_names(campaign),), config["folds"], config["seed"]))
        parts: dict[tuple[str, object], np.ndarray] = defaultdict(lambda: np.zeros(2))
        for fold in split.folds:
            model = train_units([split.units[i] for i in fold.fitted], campaign.arm, how, choices)
            for unit in (split.units[i] for i in fold.held_out):
                for segment in unit.segments():
                    tau = segment.tau[segment.keep]
                    left = tau - segment.filter(model.torque(Motion.of(segment)).numpy())[segment.keep]
                    parts["kind", unit.name.split("_")[0]] += np.abs(left).sum(), np.abs(tau).sum()
                    for number, rows in enumerate(np.array_split(np.arange(len(tau)), SIXTHS)):
                        parts["sixth", number + 1] += np.abs(left[rows]).sum(), np.abs(tau[rows]).sum()
                    hz = np.fft.rfftfreq(len(tau), segment.dt)
                    power = [(np.abs(np.fft.rfft(x, axis=0)) ** 2).sum(axis=1) / len(tau) for x in (left, tau)]
                    for low, high in BANDS:
                        parts["Hz", (low, high)] += [x[(hz >= low) & (hz < high)].sum() for x in power]
        squared = sum(part[0] for (sort, _), part in parts.items() if sort == "Hz")
        for (sort, which), (left, whole) in parts.items():
            told = f"{100 * left / whole:.1f} %" if sort != "Hz" else f"{100 * (left / whole) ** 0.5:.0f} %, {100 * left / squared:.0f} %"
            print(name, sort, which, told, flush=True)


if __name__ == "__main__":
    main()
