"""Diagnose arms by truth.py and planted.py: `python training/independent_arms/run.py [MODE] [COUNT] [SEED] [OUT.json]`.

MODE healthy (the default): how often an arm that hides nothing is accused, by name (a finding) or by alarm (a mismatch without a name).
planted: how often the one law that is hidden is named at its joint, and how often another is. family-out: the same with the family of what
is hidden taken out of the catalogue: every name is wrong then. truth.py and planted.py import nothing of the package. One row per campaign
goes to OUT.json (by default results_MODE.json); rows that it holds are not made again.
"""

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import pandas as pd
import yaml
from planted import planted
from truth import campaign

HERE = Path(__file__).parent
ALIKE = {"stribeck_friction": {"coulomb_friction"}}
MOST = 3  # names of a class that still says something


def written(root: Path, arm: dict[str, Any], recordings: list[tuple[str, dict[str, Any]]]) -> Path:
    """Write a campaign below `root` as a user would have it."""
    (root / "recordings").mkdir()
    (root / "arm.yaml").write_text(yaml.safe_dump(arm))
    for name, columns in recordings:
        pd.DataFrame(columns).to_parquet(root / "recordings" / f"{name}.parquet")
    return root


def row_of(mode: str, seed: int) -> dict[str, Any]:
    """Make and diagnose the arm `seed`."""
    import nnhydro
    from nnhydro.diagnosis.diagnose import diagnose
    from nnhydro.effects.catalogue import catalogue

    kind, arm, recordings, *hidden = campaign(seed) if mode == "healthy" else planted(seed)
    without: tuple[str, ...] = ()
    if mode == "family-out" and hidden[0]["effect"] in catalogue():
        family = catalogue()[hidden[0]["effect"]].family
        without = tuple(name for name, effect in catalogue().items() if effect.family == family)
    with tempfile.TemporaryDirectory() as folder:
        found = diagnose(nnhydro.load(written(Path(folder), arm, recordings)), without=without)
    said = [{"effect": f.effect, "joint": f.joint, "class": list(f.equivalence_set), "confidence": f.confidence,
             "acts": f.activity is not None, "value": next(iter(f.parameters.values())).value,
             "ci95": next(iter(f.parameters.values())).ci95} for f in found.findings]
    return {"seed": seed, "kind": kind, "hidden": hidden[0] if hidden else None, "said": said, "detected": found.detected,
            "seconds": found.seconds}


def hit(said: dict[str, Any], hidden: dict[str, Any] | None) -> bool:
    """Return whether a finding names what is hidden, at its joint, alone or in a small class."""
    if hidden is None:
        return False
    names = {said["effect"], *(said["class"] if len(said["class"]) <= MOST else ())}
    return bool(names & ({hidden["effect"]} | ALIKE.get(hidden["effect"], set()))) and said["joint"] in (hidden["joint"], None)


def summary(mode: str, rows: list[dict[str, Any]]) -> dict[str, str]:
    """Return the shares with their 95 % intervals."""
    from nnhydro.evaluation.metrics import interval_of_share

    def share(hits: list[bool]) -> str:
        low, high = interval_of_share(sum(hits), len(hits))
        return f"{sum(hits)} of {len(hits)}, {100 * sum(hits) / max(len(hits), 1):.1f} % ({100 * low:.1f} to {100 * high:.1f})"

    if mode == "healthy":
        return {"named": share([bool(r["said"]) for r in rows]), "detected": share([r["detected"] for r in rows])}
    wrong = [[s for s in r["said"] if mode == "family-out" or not hit(s, r["hidden"])] for r in rows]
    told = {"a wrong name": share([bool(w) for w in wrong]),
            "a wrong name, confidence 0.9 or more": share([any(s["confidence"] >= 0.9 for s in w) for w in wrong]),
            "an alarm or a name": share([r["detected"] or bool(r["said"]) for r in rows])}
    if mode == "family-out":
        return told
    known = [r for r in rows if r["hidden"]["effect"] != "unknown"]
    held = [s["ci95"][0] <= r["hidden"]["value"] <= s["ci95"][1] for r in known if r["hidden"]["value"] is not None
            for s in r["said"] if s["effect"] == r["hidden"]["effect"]]
    right = [len(r["said"]) == 1 and hit(r["said"][0], r["hidden"]) for r in known]
    return {"exact": share(right)} | told | {"interval holds": share(held)}


def main() -> None:
    """Make, diagnose and count; print a row an arm."""
    from nnhydro.fitting.identify import versions
    from nnhydro.runtime.files import write_json

    given = dict(enumerate(sys.argv[1:]))
    mode, count, first = given.get(0, "healthy"), int(given.get(1, "44")), int(given.get(2, "0"))
    out = Path(given.get(3, str(HERE / f"results_{mode}.json")))
    rows = json.loads(out.read_text())["campaigns"] if out.exists() else []
    for seed in sorted(set(range(first, first + count)) - {r["seed"] for r in rows}):
        r = row_of(mode, seed)
        rows.append(r)
        hidden = "" if r["hidden"] is None else "{effect}@{joint} {share:.3f}".format(**r["hidden"])
        said = " ".join("{effect}@{joint} {confidence:.2f}".format(**s) for s in r["said"]) or ("alarm" if r["detected"] else "silent")
        print(f"{seed} {r['kind']:8s} {hidden:32s} {said} {r['seconds']:.0f} s", flush=True)
        write_json(out, {"mode": mode, "versions": versions(), "summary": summary(mode, rows), "campaigns": rows})
    print(json.dumps(summary(mode, rows), indent=1))


if __name__ == "__main__":
    main()
