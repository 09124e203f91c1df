"""The card of an effect for programs, and its words for people."""

from typing import Any

from nnhydro.effects.effect import Effect, InstrumentEffect

ACTS = {"joint": "one joint", "link": "one link", "arm": "the whole arm"}


def card(effect: type[Effect]) -> dict[str, Any]:
    """Return the card as JSON holds it."""
    seen = effect.signature
    return {
        "id": effect.id, "family": effect.family, "name": effect.name, "acts": effect.acts,
        "kind": "instrument" if issubclass(effect, InstrumentEffect) else "load", "mechanism": effect.mechanism,
        "equation": effect.equation, "source": effect.source,
        "signature": {"depends_on": list(seen.depends_on), "parity": seen.parity, "region": seen.region, "excited_by": seen.excited_by,
                      "mistaken_for": list(seen.mistaken_for), "zero_at_rest": seen.zero_at_rest},
        "parameters": [{"name": f.name} | {key: f.metadata[key] for key in ("unit", "start", "meaning", "per", "linear")}
                       | {"bounds": list(f.metadata["bounds"]), "grid": list(f.metadata["grid"])} for f in effect.parameters()],
        "own_in_every_recording": effect.per_recording,
    }
