"""`nnhydro diagnose` against sparse regression and residual learners: `python training/benchmarks/diagnosis_peers.py`.

All diagnose the same concealed campaigns (made here with a fixed seed, kept out of git in runs/): ten with one strong effect, four healthy
arms, two whose baseline is slightly wrong in form. Counted are right names, false claims, effects that were given any weight at all, and
the error on unseen motions against the noise-free truth (medians); discovery_peers.py says what the peers get. Seconds are those of the
processor, one thread. About six minutes. diagnosis_speed.py tells how long a diagnosis takes.

pysindy is used where it is installed: `pip install 'nnhydro[bench]'`.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, final

from machine import machine, versions  # isort: skip  one thread, set before numpy and torch are imported
import numpy as np
import torch
from discovery_peers import PEERS, Claims, prepared

from nnhydro.blind_tests.conceal import MARKER, conceal
from nnhydro.blind_tests.reveal import read_suite, unseen_error
from nnhydro.blind_tests.scoring import Verdict, score
from nnhydro.blind_tests.seal import KEY_FILE, open_sealed, read_key
from nnhydro.blind_tests.summary import WORSE
from nnhydro.blind_tests.truth.campaign import Wish
from nnhydro.diagnosis.diagnose import diagnose
from nnhydro.models.prediction import predict
from nnhydro.models.torque_model import TorqueModel
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.readers.files import read_recording
from nnhydro.runtime.files import write_json

RUNS = Path(__file__).parent / "runs"
HIDDEN = ("wake_development", "reynolds_drag", "ambient_current", "flow_memory", "payload_mass", "rotor_inertia", "coulomb_friction",
          "viscous_friction", "umbilical_stiffness", "sensor_timing", *("none",) * 4, *("base_form",) * 2)
SEED = 4021
OURS, BEFORE = "nnhydro diagnose", "baseline, recalibrated"


@final
@dataclass(frozen=True)
class Outcome:
    """What one method was worth on one campaign: the verdict, how many effects it gave any weight, processor's seconds."""

    verdict: Verdict
    weighted: int
    seconds: float


def suite(name: str, wishes: list[Wish]) -> Path:
    """Return the suite `name`, made where it is not there yet."""
    if not (RUNS / name / MARKER).is_file():
        conceal(RUNS / name, wishes, SEED, progress=print)
    return RUNS / name


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """Return what `work` returns and the processor's seconds it took."""
    began = time.process_time()
    return work(), time.process_time() - began


def claimed(claims: Claims) -> dict[str, Any]:
    """Return claims as the part of diagnosis.json that is scored, and how many effects had any weight."""
    findings = [{"effect": effect, "class": [effect], "joint": joint or None, "confidence": 1.0} for effect, joint in claims.material]
    return {"mismatch": {"detected": bool(findings)}, "findings": findings, "weighted": claims.weighted}


def answers(campaign: Campaign, baseline: str) -> dict[str, tuple[dict[str, Any], TorqueModel, float]]:
    """Return of every method: its diagnosis, its model, its seconds. The answer is still sealed."""
    found, seconds = timed(lambda: diagnose(campaign, baseline))
    made = {BEFORE: (claimed(Claims()), found.baseline, 0.0), OURS: (found.document(), found.corrected, seconds)}
    data, shared = timed(lambda: prepared(campaign, baseline))
    for name, method in PEERS.items():
        if name.startswith("pysindy") and find_spec("pysindy") is None:
            continue
        (model, claims), seconds = timed(lambda method=method: method(data))
        made[name] = (claimed(claims), model, shared + seconds)
    return made


def compare(folder: Path) -> dict[str, list[Outcome]]:
    """Return of every method the verdicts on all campaigns of the suite, with its seconds."""
    key, table = read_key(folder / KEY_FILE), dict[str, list[Outcome]]()
    for name, public in read_suite(folder).items():
        campaign = open_campaign(folder / name)
        made = answers(campaign, public["baseline"])
        answer = open_sealed(folder / "answers" / f"{name}.sealed", key, public["commitment"])

        def torques(model: TorqueModel, at: Path = folder / name, of: Campaign = campaign) -> Callable[[str], np.ndarray]:
            return lambda motion: predict(model, read_recording(at / "unseen" / f"{motion}.csv", of.arm, torque=False)).tau

        for method, (document, model, seconds) in made.items():
            verdict = score(name, answer, document, f"{method}, {name}")
            verdict = replace(verdict, error_after=unseen_error(answer["unseen"], torques(model)))
            table.setdefault(method, []).append(Outcome(verdict, document.get("weighted", len(document["findings"])), seconds))
        hidden = ", ".join(e["effect"] for e in answer["effects"]) or "nothing"
        print(f"{name}, {hidden}: " + "; ".join(f"{m}: {', '.join(rows[-1].verdict.named) or '-'}" for m, rows in table.items()
                                                if m in (OURS, "pysindy, ensemble", "lasso")), flush=True)
    return table


def row(outcomes: list[Outcome], before: list[Outcome]) -> dict[str, Any]:
    """Return one method's row of the table."""
    def those(kind: str) -> list[Verdict]:
        return [o.verdict for o in outcomes if o.verdict.kind == kind]

    def share(hits: list[bool]) -> str:
        return f"{sum(hits)}/{len(hits)}"

    effects = those("effect")
    pairs = [(o.verdict.error_after, b.verdict.error_after) for o, b in zip(outcomes, before, strict=True)]
    return {"found": share([bool(v.class_sizes) for v in effects]), "found, nothing else": share([v.right for v in effects]),
            "false claims": sum(o.verdict.false_claims for o in outcomes),
            "healthy left alone": share([v.false_claims == 0 for v in those("none")]),
            "form left alone": share([v.false_claims == 0 for v in those("base_form")]),
            "given weight": float(np.median([o.weighted for o in outcomes])),
            "unseen error": float(np.median([v.error_after for v in effects])),
            "healthy, unseen": float(np.median([v.error_after for v in those("none")])),
            "made worse": sum(a > WORSE * b for a, b in pairs), "seconds": float(np.median([o.seconds for o in outcomes]))}


def main() -> None:
    """Print and store the comparison."""
    torch.set_num_threads(1)
    if find_spec("pysindy") is None:
        print("pysindy is not installed, its row is left out: pip install 'nnhydro[bench]'")
    table = compare(suite(f"diagnosis_peers_{SEED}", [Wish(name, "strong", None, 1, "small") for name in HIDDEN]))
    rows = {method: row(outcomes, table[BEFORE]) for method, outcomes in table.items()}
    nameless = (BEFORE, "gp residual", "boosted trees")
    keys = list(rows[OURS])
    print("\n" + " | ".join([f"{'':24}", *keys]))
    for method, values in rows.items():
        shown = ["-" if method in nameless and k in keys[:6] else f"{v:.4f}" if k.startswith(("unseen", "healthy,"))
                 else f"{v:.1f}" if isinstance(v, float) else str(v) for k, v in values.items()]
        print(" | ".join([f"{method:24}", *(f"{x:>{len(k)}}" for k, x in zip(keys, shown, strict=True))]))
    found = {method: {o.verdict.campaign: {"hidden": o.verdict.truth, "named": o.verdict.named, "given_weight": o.weighted,
                                           "unseen_error": o.verdict.error_after, "seconds": o.seconds} for o in outcomes}
             for method, outcomes in table.items()}
    write_json(Path(__file__).with_suffix(".json"), {
        "seed": SEED, "methods": rows, "campaigns": found, "machine": machine(),
        "versions": versions("nnhydro", "torch", "numpy", "scikit-learn", "pysindy")})


if __name__ == "__main__":
    main()
