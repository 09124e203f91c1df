"""The page on networks names every choice, every feature set and every set of the law's variables, with the defaults in force."""

from pathlib import Path

from nnhydro.features.feature_set import feature_sets
from nnhydro.features.strip_law.state import state_sets
from nnhydro.fitting.config import TrainingConfig

PAGE = (Path(__file__).parents[2] / "docs" / "networks.md").read_text(encoding="utf-8")
ROWS = [line.strip("| ").split(" | ") for line in PAGE.splitlines() if line.startswith("| `")]
NAMED = {name.strip("` "): cells for cells in ROWS for name in cells[0].split(",")}


def test_every_choice_and_every_set_stands_in_a_table():
    assert {*TrainingConfig.model_fields, *feature_sets(), *state_sets()} == set(NAMED)


def test_the_defaults_shown_are_those_in_force():
    for key, value in TrainingConfig().model_dump().items():
        cells = NAMED[key]
        names, shown = [name.strip("` ") for name in cells[0].split(",")], cells[1].strip("`")
        if key in ("features", "law", "cutoff_hz", "validation_share"):
            continue
        shown = shown if key == "hidden" else shown.split(",")[names.index(key)].strip()
        told = str(value).lower() if isinstance(value, bool) else str(value).replace("(", "[").replace(")", "]")
        assert told == shown.strip('"') or float(shown) == value, key
