"""The two small campaigns that ship with the package, both synthetic: see campaign/card.md and concealed/card.md."""

from pathlib import Path

CAMPAIGN = Path(__file__).parent / "campaign"
FOLDS = 3
MEMBERS = 3  # networks of an ensemble, half the default: the demo is to take about a minute
EXPECTED = "15 recordings and 196 steady runs of a two-link arm with a belt drive, towed and turned in still water (synthetic)"
CONCEALED = Path(__file__).parent / "concealed"  # a suite of one campaign with its sealed answer
CONCEALED_NAME = "campaign_000"
CONCEALED_EXPECTED = "8 recordings of another two-link arm, in which one effect is hidden and its name sealed (synthetic)"
