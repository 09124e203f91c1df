"""What `nnhydro power` prints: for each effect the smallest size that a campaign would reveal, and a verdict."""

from typing import Any

from nnhydro.diagnosis.decision.alternative_laws import EQUIVALENT_COSINE
from nnhydro.errors import count_text
from nnhydro.sheet import Column, Sheet, percent

ABSORBED = 1e-3  # visible share below which an effect is the baseline's own


def _shape(at: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:.3g}" for name, value in at.items())


def _nearest(row: dict[str, Any]) -> str | None:
    return None if row["nearest"] is None else f"{row['nearest']} ({row['likeness']:.2f})"


def power_sheet(document: dict[str, Any]) -> Sheet:
    """Return the table, a row for each parameter of each effect and joint; an empty size: nothing within physical bounds would show."""
    rows = document["effects"]
    return Sheet("The smallest sizes that are found four times in five", (
        Column("effect", [r["effect"] for r in rows], words=True),
        Column("parameter", [r["parameter"] for r in rows], words=True),
        Column("unit", [r["unit"] for r in rows], words=True),
        Column("joint", [r["joint"] for r in rows]),
        Column("smallest size", [r["smallest_size"] for r in rows], "{:.2g}", "smallest_size"),
        Column("visible", [r["visible_share"] for r in rows], percent, "visible_share"),
        Column("strength", [r["lambda"] for r in rows], "{:.1f}", "lambda"),
        Column("nearest (cosine)", [_nearest(r) for r in rows], key="nearest"),
        Column("at", [_shape(r["at"]) for r in rows], key="at")))


def power_verdict(document: dict[str, Any]) -> str:
    """Return what the campaign can and cannot reveal, in words."""
    rows = document["effects"]
    effects = list(dict.fromkeys(r["effect"] for r in rows))
    unseen = [e for e in effects if all(r["smallest_size"] is None for r in rows if r["effect"] == e)]
    absorbed = [e for e in unseen if all(r["visible_share"] < ABSORBED for r in rows if r["effect"] == e)]
    hidden = [e for e in unseen if e not in absorbed]
    alone = {e: [r for r in rows if r["effect"] == e and r["smallest_size"] is not None] for e in effects}
    alike = [e for e in effects if alone[e] and all(r["likeness"] > EQUIVALENT_COSINE for r in alone[e])]
    parts = [f"{count_text(document['recordings'], 'recording')} can reveal {len(effects) - len(unseen)} of {len(effects)} effects"]
    parts += [f"at no size {', '.join(hidden)}"] if hidden else []
    parts += [f"the fit of the baseline absorbs {', '.join(absorbed)}"] if absorbed else []
    parts += [f"they cannot distinguish {', '.join(alike)} from the most similar effect"] if alike else []
    return "; ".join(parts) + "."
