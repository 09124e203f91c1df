"""How long a diagnosis takes, against the plain way: `python training/benchmarks/diagnosis_speed.py`.

One diagnosis of 20 recordings of 1,000 samples; the plain way computes the columns and refits for every hypothesis and every left-out
recording (one pass of it; the diagnosis makes several), and a sample of these refits is timed. Seconds are those of the
processor, one thread. About two minutes.
"""

from pathlib import Path
from typing import Any

from machine import machine, versions  # isort: skip  one thread, set before numpy and torch are imported
import numpy as np
import torch
from diagnosis_peers import suite, timed

from nnhydro.blind_tests.reveal import read_suite
from nnhydro.blind_tests.truth.campaign import SIZES, Wish
from nnhydro.diagnosis.diagnose import diagnose
from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.columns import columns_on
from nnhydro.diagnosis.problem.hypothesis import enumerate_hypotheses
from nnhydro.diagnosis.problem.problem import Stretch, problem_of
from nnhydro.fitting.linear.statistics import columns_and_offset
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.runtime.files import write_json

SEED = 4021
SAMPLE = 40  # refits of the plain way that are timed


def plain_way(campaign: Campaign, baseline: str) -> tuple[int, float]:
    """Return how many refits the plain way needs and what one takes: columns of all other recordings, least squares, left-out error."""
    problem = problem_of(campaign)  # preparing the recordings is not charged
    base = baseline_of(baseline, campaign.arm, problem.units(), Preparation(LowPass(problem.edge)))
    model = base.physics
    peaks = tuple(np.max([np.abs(s.segment.tau).max(axis=0) for s in problem.stretches], axis=0).tolist())
    known = enumerate_hypotheses(campaign.arm, peaks)
    rng = np.random.default_rng(SEED)

    def rows(stretch: Stretch, hypothesis: Any) -> np.ndarray:
        Y, offset = columns_and_offset(model.loads, stretch.segment, model.arm)
        X = columns_on([hypothesis], model, stretch)
        every = np.concatenate([Y, X, (stretch.segment.tau - offset)[..., None]], axis=2)
        return every[stretch.segment.keep].reshape(-1, every.shape[2])

    def refit(hypothesis: Any, out: int) -> float:
        fitted = np.concatenate([rows(stretch, hypothesis) for stretch in problem.stretches if stretch.group != out])
        theta = np.linalg.lstsq(fitted[:, :-1], fitted[:, -1], rcond=None)[0]
        left = np.concatenate([rows(stretch, hypothesis) for stretch in problem.stretches if stretch.group == out])
        return float(((left[:, -1] - left[:, :-1] @ theta) ** 2).sum())

    some = [known[k] for k in rng.choice(len(known), SAMPLE, replace=False)]
    _, seconds = timed(lambda: [refit(hypothesis, int(rng.integers(problem.groups))) for hypothesis in some])
    return len(known) * problem.groups, seconds / SAMPLE


def speed() -> dict[str, Any]:
    """Return seconds of a diagnosis of 20 recordings of 1,000 samples, and of the plain way."""
    SIZES["speed"] = ((20, 20), (10.0, 10.0), (100.0,))
    folder = suite(f"diagnosis_speed_{SEED}", [Wish("umbilical_stiffness", "strong", 2, 1, "speed")])
    ((name, public),) = read_suite(folder).items()
    campaign = open_campaign(folder / name)
    count, each = plain_way(campaign, public["baseline"])
    found, seconds = timed(lambda: diagnose(campaign, public["baseline"]))
    return {"recordings": len(campaign.names), "samples": int(np.median([len(campaign.load(n)) for n in campaign.names])),
            "seconds": seconds, "wall": found.seconds, "plain_refits": count, "plain_refit_seconds": each, "plain_seconds": count * each,
            "times_as_fast": count * each / seconds}


def main() -> None:
    """Print and store the seconds."""
    torch.set_num_threads(1)
    fast = speed()
    print(f"{fast['recordings']} recordings of {fast['samples']} samples: diagnosis {fast['seconds']:.1f} s of processor time; "
          f"the plain way {fast['plain_seconds']:.0f} s "
          f"({fast['plain_refits']} refits of {fast['plain_refit_seconds']:.2f} s, {SAMPLE} timed): "
          f"{fast['times_as_fast']:.0f} times as fast")
    write_json(Path(__file__).with_suffix(".json"), fast | {
        "seed": SEED, "machine": machine(), "versions": versions("nnhydro", "torch", "numpy")})


if __name__ == "__main__":
    main()
