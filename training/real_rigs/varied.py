"""Real rigs with less to go by: `python training/real_rigs/varied.py FOLDER [OUT.json] [RIG ...]`; FOLDER as in run.py.

    even, odd       every other recording, every other row of a steady table
    shorter         the first 60 % of every recording
    thinner         every other sample
    noisier         white noise of 5 % of each torque's standard deviation on top

A verdict on a machine should not hang on any of these. Judged is each by the card of the whole rig, its error aside: right, half, silent,
wrong, refused or crashed.
"""

import json
import sys
import traceback
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from run import judged, main_value

from nnhydro.diagnosis.diagnose import diagnose
from nnhydro.errors import NnhydroError
from nnhydro.fitting.identify import versions
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.recording import Recording, SteadyTable
from nnhydro.runtime.files import write_json

FEWEST = 4  # recordings of which half are left
KEPT, NOISE, SEED = 0.6, 0.05, 5


def every_other(campaign: Campaign, first: int) -> Campaign | None:
    """Return every other recording and every other row of the tables; None where too few are left."""
    recordings = list(campaign.recordings())
    if recordings and len(recordings) < FEWEST:
        return None
    tables = tuple(table.rows(np.arange(first, len(table), 2)) for table in campaign.steady)
    return Campaign.of(campaign.arm, recordings[first::2], tables)


def with_rows(campaign: Campaign, keep: Callable[[Recording], slice]) -> Campaign | None:
    """Return the rows `keep` of every recording; None where there are tables alone."""
    recordings = [r.rows(keep(r), "fewer rows") for r in campaign.recordings()]
    return Campaign.of(campaign.arm, recordings, campaign.steady) if recordings else None


def noisier(campaign: Campaign) -> Campaign:
    """Return the campaign with more noise on every torque."""
    rng = np.random.default_rng(SEED)

    def shaken(part: Recording | SteadyTable) -> Any:
        return replace(part, tau=part.tau + NOISE * np.std(part.tau, axis=0) * rng.standard_normal(part.tau.shape))

    return Campaign.of(campaign.arm, [shaken(r) for r in campaign.recordings()], tuple(shaken(table) for table in campaign.steady))


VARIATIONS: dict[str, Callable[[Campaign], Campaign | None]] = {
    "even": lambda whole: every_other(whole, 0),
    "odd": lambda whole: every_other(whole, 1),
    "shorter": lambda whole: with_rows(whole, lambda r: slice(0, int(KEPT * len(r)))),
    "thinner": lambda whole: with_rows(whole, lambda r: slice(0, None, 2)),
    "noisier": noisier,
}


def verdict_on(campaign: Campaign, card: dict[str, Any]) -> tuple[str, str, str]:
    """Return the verdict, why, and what was said."""
    try:
        document = diagnose(campaign, card["baseline"]).document()
    except NnhydroError as cause:
        return "refused", str(cause), ""
    except Exception:
        return "crash", traceback.format_exc().strip().splitlines()[-1], ""
    said = [f"{f['effect']}@{f['joint'] or 'arm'} {main_value(f) or 0:.3g} ({f['confidence']:.2f})" for f in document["findings"]]
    return *judged({**card, "error": None}, document), " ".join(said) or "nothing"


def main() -> None:
    """Print a line a rig and variation, and the count."""
    root, given = Path(sys.argv[1]), sys.argv[2:]
    out = Path(given.pop(0)) if given and given[0].endswith(".json") else Path(__file__).with_name("varied.json")
    cards = {k: v for k, v in json.loads((root / "answers.json").read_text()).items() if not k.startswith("_")}
    rows: list[dict[str, Any]] = []
    for name, card in cards.items():
        place = root / card.get("path", name)
        if not place.exists() or (given and name not in given):
            continue
        whole = open_campaign(place)
        for kind, vary in VARIATIONS.items():
            campaign = vary(whole)
            if campaign is None:
                continue
            verdict, why, said = verdict_on(campaign, card)
            rows.append({"rig": name, "variation": kind, "verdict": verdict, "why": why, "said": said})
            print(f"{name:24s} {kind:8s} {verdict:7s} {said}  {why}", flush=True)
    count = {v: sum(r["verdict"] == v for r in rows) for v in dict.fromkeys(r["verdict"] for r in rows)}
    print(f"of {len(rows)}: " + ", ".join(f"{n} {v}" for v, n in count.items()))
    write_json(out, {"versions": versions(), "count": count, "rigs": rows})


if __name__ == "__main__":
    main()
