"""Print the whole table: `python training/concealed/suites.py [WORD ...]`: all suites of suites.toml, or those with a word in their names.

Small campaigns (8 recordings of 6 s), made and diagnosed one after the other; what has been diagnosed is not diagnosed again, so that a run
that was ended goes on. results.json holds the shares, the claims by confidence, and how look-alikes were told.
"""

import sys
import tomllib
from itertools import pairwise

import numpy as np
from run import HERE, defaults, scored, suite_of

from nnhydro.evaluation.metrics import interval_of_share

STEPS = (0.5, 0.8, 0.9, 0.95, 0.98, 1.0)  # of confidence


def share(hits: int, tries: int) -> dict:
    """Return the share with its 95 % interval."""
    low, high = interval_of_share(hits, tries)
    return {"hits": hits, "tries": tries, "share": hits / tries if tries else 0.0, "low": low, "high": high}


def counted(score: dict) -> dict:
    """Return the shares of one suite."""
    every = score["campaigns"]
    listed = [v for v in every if v["kind"] == "effect"]
    joints = [v for v in listed if v["class_sizes"]]
    quiet = [v for v in every if v["kind"] == "none"]
    made = {"detected": sum(v["detected"] for v in every), "right": sum(v["right"] and not (v in quiet and v["alarm"]) for v in every),
            "wrong claim": sum(v["false_claims"] > 0 for v in every),
            "confident wrong claim": sum(any(c >= 0.9 and not ok for c, ok in v["claims"]) for v in every),
            "alarm or abstention": sum(v["alarm"] or not v["claims"] for v in every)}
    result = {name: share(hits, len(every)) for name, hits in made.items()}
    if listed:
        result |= {"family": share(sum(v["family"] for v in listed), len(listed)),
                   "joint": share(sum(v["joint"] for v in joints), len(joints))}
    return result | {"placed": score["placed"], "unseen": score["unseen"], "class_size": score["class_size"],
                     "parameters": score["parameters"], "median_seconds": score["median_seconds"]}


def reliability(scores: list[dict]) -> list[dict]:
    """Return how many of the claims were right, by confidence."""
    claims = np.array([claim for score in scores for v in score["campaigns"] for claim in v["claims"]]).reshape(-1, 2)
    return [{"from": low, "to": high, "said": float(claims[inside, 0].mean()) if inside.any() else None}
            | share(int(claims[inside, 1].sum()), int(inside.sum()))
            for low, high in pairwise(STEPS) for inside in [(claims[:, 0] >= low) & (claims[:, 0] < high)]]


def look_alikes(scores: list[dict]) -> dict:
    """Return what was said of effects that the campaign cannot tell from another: its lambda against them is below the limit."""
    cases = [v for score in scores for v in score["campaigns"] if v["kind"] == "effect" and len(v["rivals"]) == 1 and v["limit"]
             and any(size < v["limit"] for size in v["rivals"][0].values())]
    honest = sum(v["right"] for v in cases)
    return {"look_alikes": share(honest, len(cases)), "sizes": [v["class_sizes"] for v in cases],
            "wrong": share(sum(v["false_claims"] > 0 for v in cases), len(cases))}


def percent(share: dict | None) -> str:
    """Return a share in words."""
    if share is None or not share["tries"]:
        return ""
    return f"{100 * share['share']:.0f} % ({100 * share['low']:.0f} to {100 * share['high']:.0f})"


def main() -> None:
    """Run the suites, print the table and store it."""
    from nnhydro.fitting.identify import versions
    from nnhydro.runtime.files import write_json
    from nnhydro.runtime.workers import Workers

    words, rows, scores = sys.argv[1:], {}, []
    columns = ("right", "detected", "wrong claim", "family", "joint")
    for entry in tomllib.loads((HERE / "suites.toml").read_text())["suite"]:
        name = entry.pop("name")
        if words and not any(word in name for word in words):
            continue
        config = defaults() | {"size": "small"} | entry
        score = scored(suite_of(config), Workers(config["jobs"]), config["without"])
        rows[name] = counted(score) | {"config": config}
        scores += [score] if not config["without"] else []
        write_json(HERE / "results.json", {"suites": rows, "reliability": reliability(scores), "look_alikes": look_alikes(scores),
                                          "versions": versions()})
        print(f"| {name} | {len(score['campaigns'])} | {' | '.join(percent(rows[name].get(key)) for key in columns)} |", flush=True)
    print(f"\n| suite | campaigns | {' | '.join(columns)} |\n| --- | --- | {' | '.join('---' for _ in columns)} |")
    for name, row in rows.items():
        print(f"| {name} | {row['right']['tries']} | {' | '.join(percent(row.get(key)) for key in columns)} |")
    for share in reliability(scores):
        print(f"said with {share['from']} to {share['to']}: {share['hits']} of {share['tries']} right")
    alike = look_alikes(scores)
    print(f"look-alikes: {percent(alike['look_alikes'])} named right or in an honest class, of {alike['look_alikes']['tries']}")


if __name__ == "__main__":
    main()
