"""Synthetic campaigns of robot arms with known answers: `python make.py FOLDER` writes 36 campaigns and answers.json.

FOLDER must not be there yet. Nothing of nnhydro is used.
"""

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from checks import check_physics, check_recorded
from healthy import healthy_cases, write_axis, write_tables
from hidden import several_cases, single_cases, unlisted_cases
from record import SEED, Case, write_campaign


def main(target: Path) -> None:
    """Write all campaigns in an order that tells nothing, and the answers."""
    check_physics(np.random.default_rng(1))
    (target / "truth_of_unseen").mkdir(parents=True)
    jobs: list[Case | Callable[[Path, np.random.Generator], dict[str, object]]] = [write_tables, write_axis]
    for k, group in enumerate([healthy_cases, single_cases, several_cases, unlisted_cases]):
        jobs += group(np.random.default_rng(SEED + k))
    order = np.random.default_rng(SEED + 9).permutation(len(jobs))
    answers = {}
    for place, k in enumerate(order):
        job, rng, name = jobs[k], np.random.default_rng([SEED, int(k)]), f"case_{place:03d}"
        answers[name] = write_campaign(job, target / name, rng) if isinstance(job, Case) else job(target / name, rng)
        healthy_case = isinstance(job, Case) and not job.effects
        seen = f" residual by finite differences, of noise: {np.round(check_recorded(job, target / name), 4)}" if healthy_case else ""
        hidden = [tuple(entry.values()) for entry in answers[name]["hidden"]]
        print(name, answers[name]["style"], answers[name]["rows"], hidden, seen, flush=True)
    (target / "answers.json").write_text(json.dumps(answers, indent=1))


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    main(folder) if not folder.exists() else sys.exit(f"{folder}: is there already: name a folder that is not")
