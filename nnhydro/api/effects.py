"""The catalogue of what a simulation may omit."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

from nnhydro.effects.catalogue import ACTS, card
from nnhydro.effects.catalogue import catalogue as known
from nnhydro.effects.effect import Effect
from nnhydro.effects.plugin import load_plugin
from nnhydro.sheet import Column, ResultView, Sheet


@final
@dataclass(frozen=True, eq=False, repr=False)
class Catalogue(ResultView):
    """All effects by their id; the data frame has one row per effect."""

    effects: dict[str, type[Effect]]

    def __getitem__(self, effect: str) -> dict[str, Any]:
        """Return the card of one effect: mechanism, equation, signature, look-alikes, parameters with units and bounds, source."""
        return card(self.effects[effect])

    def __iter__(self) -> Iterator[str]:
        return iter(self.effects)

    def __len__(self) -> int:
        return len(self.effects)

    def verdict(self) -> str:
        """Return how many effects are known."""
        return f"{len(self)} effects that a simulation may omit."

    def sheets(self) -> tuple[Sheet, ...]:
        """Return one row per effect."""
        every = list(self.effects.values())
        return (Sheet("", (
            Column("id", list(self.effects), words=True), Column("family", [effect.family for effect in every], words=True),
            Column("acts on", [ACTS[effect.acts] for effect in every], key="acts", words=True),
            Column("name", [effect.name for effect in every], words=True),
            Column("what it looks like", [effect.signature.region for effect in every], key="region", words=True))),)


def catalogue(plugin: str | Path | None = None) -> Catalogue:
    """Return all effects that a diagnosis can find, with those that the Python file `plugin` declares; that file is run.

    Raises ConfigError where the file declares none or fails.
    """
    if plugin is not None:
        load_plugin(Path(plugin))
    return Catalogue(dict(known()))
