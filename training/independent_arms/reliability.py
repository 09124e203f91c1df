"""How much a confidence is worth: `python training/independent_arms/reliability.py [RESULTS.json ...]`, by default those of this folder.

Claims of all results together, by confidence: how many, how sure they were said, how many are right. With the family of what is hidden out
of the catalogue every claim is wrong. Intervals of shares after Clopper and Pearson (1934).
"""

import json
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from run import hit
from scipy.stats import binomtest

HERE = Path(__file__).parent
EDGES = np.linspace(0, 1, 11)
FEWEST = 20  # claims of a bin of which a share is told


def claims_of(path: Path) -> list[tuple[float, bool]]:
    """Return confidence and truth of every claim in a file of results."""
    document: dict[str, Any] = json.loads(path.read_text())
    known = document["mode"] != "family-out"
    return [(s["confidence"], known and hit(s, r["hidden"])) for r in document["campaigns"] for s in r["said"]]


def main() -> None:
    """Print a row a bin of ten."""
    paths = [Path(x) for x in sys.argv[1:]] or sorted(HERE.glob("results_*.json"))
    claims = [claim for path in paths for claim in claims_of(path)]
    print(f"{len(claims)} claims of {', '.join(p.name for p in paths)}")
    for low, high in pairwise(EDGES.tolist()):
        inside = [(c, right) for c, right in claims if low <= c < high or c == high == 1.0]
        if not inside:
            continue
        said, right = float(np.mean([c for c, _ in inside])), sum(r for _, r in inside)
        span = binomtest(right, len(inside)).proportion_ci(method="exact")
        gap = f"gap {abs(said - right / len(inside)):.3f}" if len(inside) >= FEWEST else "too few to judge"
        print(f"{low:.1f} to {high:.1f}: {len(inside):4d} claims, said {said:.3f}, right {right / len(inside):.3f} "
              f"({span.low:.2f} to {span.high:.2f}), {gap}")


if __name__ == "__main__":
    main()
