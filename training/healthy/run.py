"""How often a healthy arm is accused: `python training/healthy/run.py [COUNT] [SEED]`; results.json holds a row a campaign.

The arms are made by truth.py, which imports nothing of the package, with other noise in every kind of campaign. An arm is accused by name
(a finding) or by alarm (a mismatch without a name).
"""

import json
import sys
import tempfile
from pathlib import Path

import pandas as pd
import yaml
from truth import campaign

HERE = Path(__file__).parent


def main() -> None:
    """Make, diagnose and count; print a row a kind."""
    from scipy.stats import binomtest

    import nnhydro
    from nnhydro.diagnosis.diagnose import diagnose
    from nnhydro.files import write_json
    from nnhydro.identification.identify import versions

    count, first = (int(x) for x in (*sys.argv[1:], *("44", "0")[len(sys.argv) - 1:]))
    rows = []
    for seed in range(first, first + count):
        kind, arm, recordings = campaign(seed)
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            (root / "recordings").mkdir()
            (root / "arm.yaml").write_text(yaml.safe_dump(arm))
            for name, columns in recordings:
                pd.DataFrame(columns).to_parquet(root / "recordings" / f"{name}.parquet")
            found = diagnose(nnhydro.load(root))
        rows.append({"seed": seed, "kind": kind, "named": [f.effect.id for f in found.findings], "detected": found.detected,
                     "seconds": found.seconds})
        print(f"{seed} {kind:8s} {rows[-1]['named'] or ('alarm' if found.detected else 'silent')} {found.seconds:.0f} s", flush=True)

    def share(hits: int) -> str:
        low, high = binomtest(hits, len(rows)).proportion_ci(method="exact")
        return f"{hits} of {len(rows)}, {100 * hits / len(rows):.1f} % ({100 * low:.1f} to {100 * high:.1f})"

    told = {"named": share(sum(bool(r["named"]) for r in rows)), "detected": share(sum(r["detected"] for r in rows))}
    print(json.dumps(told, indent=1))
    write_json(HERE / "results.json", {"versions": versions(), "summary": told, "campaigns": rows})


if __name__ == "__main__":
    main()
