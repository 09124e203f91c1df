"""The small campaign that ships with the package: part of datasets/rivera_tank, synthetic, see campaign/card.md."""

from pathlib import Path

CAMPAIGN = Path(__file__).parent / "campaign"
FOLDS = 3
EXPECTED = "15 recordings and 196 steady runs of a two-link arm with a belt drive, towed and turned in still water (synthetic)"
