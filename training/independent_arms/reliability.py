"""How much a confidence is worth: `python training/independent_arms/reliability.py [RESULTS.json ...]`.

The results are those of this folder and of ../foreign by default. Claims of all results together, by confidence: how many, how sure they
were said, how many are right; then those of each file. With the family of what is hidden out of the catalogue every claim is wrong.
Intervals of shares after Clopper and Pearson (1934).
"""

import json
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from run import hit

from nnhydro.evaluation.metrics import interval_of_share

HERE = Path(__file__).parent
FOREIGN = HERE.parent / "foreign"
Claim = tuple[float, bool]  # how sure it was said, and whether it is right
EDGES = np.linspace(0, 1, 11)
FEWEST = 20  # claims of a bin of which a share is told


def claims_of(path: Path) -> list[Claim]:
    """Return confidence and truth of every claim in a file of results."""
    document: dict[str, Any] = json.loads(path.read_text())
    rows = document["campaigns"]
    if "mode" in document:
        known = document["mode"] != "family-out"
        return [(s["confidence"], known and hit(s, r["hidden"])) for r in rows for s in r["said"]]
    if "named" in rows[0]:  # of foreign campaigns, without the hidden family
        return [(confidence, False) for r in rows for _, confidence in r["named"]]
    return [(confidence, name not in r["wrong"]) for r in rows for name, confidence in zip(r["said"], r["confidence"], strict=True)]


def told(claims: list[Claim]) -> str:
    """Return how many claims there are, how sure they were said and how many are right."""
    said, right = float(np.mean([c for c, _ in claims])), sum(r for _, r in claims)
    least, most = interval_of_share(right, len(claims))
    gap = f"gap {abs(said - right / len(claims)):.3f}" if len(claims) >= FEWEST else "too few to judge"
    return f"{len(claims):4d} claims, said {said:.3f}, right {right / len(claims):.3f} ({least:.2f} to {most:.2f}), {gap}"


def main() -> None:
    """Print one row per bin of ten, then one row per file."""
    paths = [Path(x) for x in sys.argv[1:]] or [*sorted(HERE.glob("results_*.json")), *sorted(FOREIGN.glob("*_77.json"))]
    by_file = {path: claims_of(path) for path in paths}
    claims = [claim for found in by_file.values() for claim in found]
    for low, high in pairwise(EDGES.tolist()):
        inside = [(c, right) for c, right in claims if low <= c < high or c == high == 1.0]
        if inside:
            print(f"{low:.1f} to {high:.1f}: {told(inside)}")
    for path, found in by_file.items():
        print(f"{path.parent.name}/{path.name}: {told(found) if found else 'no claims'}")


if __name__ == "__main__":
    main()
