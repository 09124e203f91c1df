"""A column mapping: which foreign column is which channel, and in what unit.

```yaml
columns:
  t_s: {from: "Time (ms)", unit: ms}
  q1_rad: {from: shoulder, unit: deg, sign: -1, offset: 90}
  tau1_Nm: {from: T1, unit: lbf in}
  u0_m_s: carriage              # already in SI
steady: {tau1_Nm: {from: mean T1, unit: N mm}}   # for the tables in steady/
joints: [shoulder, elbow]       # for ROS bags
topic: /joint_states
```

A channel that stands at the left margin, as messages write the line that mends it, stands for one below `columns`.

    SI value = unit * scale * (sign * value + offset)        offset in the foreign unit

An angle that begins again after a turn states its `period`, in the foreign unit too (360, say): it then goes on.
"""

import re
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Literal, final

import numpy as np
from pydantic import Field, field_validator

from nnhydro.errors import CampaignError, ConfigError, RecordingError, require
from nnhydro.recordings.readers.table import Array, Columns, Table, sha256_of
from nnhydro.recordings.readers.units import TARGETS, factor
from nnhydro.recordings.readers.validation import Settings, validate
from nnhydro.recordings.readers.yaml_file import read_yaml

FILES = ("columns.yaml", "columns.yml")
FOLDERS = ("recordings", "steady", "unseen")
_OF_JOINT = re.compile(r"(?P<channel>d?d?q|tau)\d{1,2}(?P<kind>(?:_sim)?)_(?!std).*")


class Source(Settings):
    """Where a channel comes from: foreign column, its unit (SI by default), own scale, sign, offset and period."""

    from_: str = Field(alias="from", min_length=1, max_length=500)
    unit: str | None = Field(default=None, max_length=40)
    scale: float = Field(default=1.0, ge=-1e12, le=1e12)
    sign: Literal[1, -1] = 1
    offset: float = Field(default=0.0, ge=-1e12, le=1e12)
    period: float | None = Field(default=None, gt=0, le=1e12)

    @field_validator("scale")
    @classmethod
    def _not_zero(cls, value: float) -> float:
        if value == 0:
            raise ValueError("a scale of 0 would wipe the channel out")
        return value


class MapFile(Settings):
    """The whole mapping file."""

    columns: dict[str, Source] = Field(default_factory=dict)
    steady: dict[str, Source] = Field(default_factory=dict)
    joints: tuple[str, ...] = Field(default=(), max_length=10)
    topic: str | None = Field(default=None, max_length=500)

    @field_validator("columns", "steady", mode="before")
    @classmethod
    def _name_alone(cls, value: Any) -> Any:
        return {key: {"from": v} if isinstance(v, str) else v for key, v in value.items()} if isinstance(value, dict) else value


@final
@dataclass(frozen=True)
class ColumnMap:
    """A checked mapping: every target is a channel, every unit known."""

    path: str
    sha256: str
    settings: MapFile

    def sources(self, steady: bool) -> dict[str, Source]:
        """Return the sources by target for recordings, or for steady tables."""
        return self.settings.steady if steady else self.settings.columns


def _require_known(where: str, targets: dict[str, Source]) -> None:
    for target, source in targets.items():
        if target not in TARGETS:
            close = get_close_matches(target, TARGETS, n=1)
            hint = f"did you mean {close[0]!r}?" if close else "channels are called t_s, q1_rad, dq1_rad_s, tau1_Nm, u0_m_s, ..."
            raise ConfigError(f"{where}: {target!r} is not a channel: {hint} (left: our name, 'from': the name in the file)")
        if source.unit is not None:
            try:
                factor(source.unit, target)
            except ConfigError as cause:
                raise ConfigError(f"{where}: {cause}") from cause


def _require_a_column_each(where: str, targets: dict[str, Source]) -> None:
    """Raise ConfigError where two joints take one channel from one column: angles may with another sign or scale, as of coupled joints."""
    seen: dict[tuple[object, ...], str] = {}
    for target, source in targets.items():
        joint = _OF_JOINT.fullmatch(target)
        if joint is None:
            continue
        how = () if joint["channel"] == "tau" else (source.unit, source.scale, source.sign, source.offset)
        first = seen.setdefault((joint["channel"], joint["kind"], source.from_, *how), target)
        require(first == target, f"{where}: {first!r} and {target!r} are both taken from the column {source.from_!r}: two joints have two "
                "sensors; correct one name after 'from:'", ConfigError)


def _below_columns(document: dict[str, Any], where: str) -> dict[str, Any]:
    """Return `document` with the channels at its left margin below `columns`; raises ConfigError for one that stands at both places."""
    at_margin = {key: value for key, value in document.items() if key in TARGETS} if isinstance(document, dict) else {}
    below = document.get("columns", {}) if at_margin else {}
    if not at_margin or not isinstance(below, dict):
        return document
    twice = sorted(set(at_margin) & set(below))
    if twice:
        raise ConfigError(f"{where}: {twice[0]!r} is mapped twice, below 'columns' and beside it: keep one of the lines")
    return {key: value for key, value in document.items() if key not in TARGETS} | {"columns": {**below, **at_margin}}


def parse_column_map(document: dict[str, Any], where: str, sha256: str = "") -> ColumnMap:
    """Return the mapping that `document` describes; raises ConfigError naming `where` and the key."""
    settings = validate(MapFile, _below_columns(document, where), where, ConfigError)
    _require_known(where, settings.columns)
    _require_known(where, settings.steady)
    _require_a_column_each(where, settings.columns)
    _require_a_column_each(where, settings.steady)
    return ColumnMap(where, sha256, settings)


def read_column_map(path: Path) -> ColumnMap:
    """Return the mapping in the YAML file `path`; raises ConfigError with one line."""
    return parse_column_map(read_yaml(path, ConfigError), str(path), sha256_of(path))


def map_file(root: Path) -> Path | None:
    """Return the mapping of the campaign in `root`, columns.yaml or columns.yml; None for none. Raises CampaignError for both."""
    there = [root / name for name in FILES if (root / name).is_file()]
    require(len(there) < 2, f"{root}: has both {' and '.join(path.name for path in there)}: remove one", CampaignError)
    return there[0] if there else None


def campaign_map(path: Path) -> ColumnMap | None:
    """Return the mapping of the campaign that holds the file `path`, None where there is none."""
    found = map_file(path.absolute().parent.parent) if path.absolute().parent.name in FOLDERS else None
    return None if found is None else read_column_map(found)


def unwrap(values: Array, period: float) -> Array:
    """Return `values` (n,) of a reading that begins again after a `period` as they go on; cells that are not finite stay."""
    made, finite = values.copy(), np.isfinite(values)
    made[finite] = np.unwrap(values[finite], period=period)
    return made


def map_columns(table: Table, sources: dict[str, Source], where: str) -> Columns:
    """Return the columns of `table` under our names and in SI; raises RecordingError where a source is absent or a name is taken."""
    used = {source.from_ for source in sources.values()}
    columns: Columns = {name: values for name, values in table.columns.items() if name not in used}
    for target, source in sources.items():
        if source.from_ not in table.columns:
            close = get_close_matches(source.from_, table.header, n=1)
            hint = f"did you mean {close[0]!r}?" if close else f"it has {', '.join(map(repr, table.header[:6]))}"
            raise RecordingError(f"{where}: column {source.from_!r}, mapped to {target}, is not there: {hint}: correct the name "
                                 "after 'from:'")
        if target in columns:
            raise RecordingError(f"{where}: has a column {target!r} already, but the mapping takes it from {source.from_!r}: remove one")
        values = np.asarray(table.columns[source.from_], dtype=float)
        values = values if source.period is None else unwrap(values, source.period)
        written = source.unit if source.unit is not None else table.units.get(source.from_)
        unit = 1.0 if written is None else _factor(written, target, source.from_, where)
        converted: Array = unit * source.scale * (source.sign * values + source.offset)
        columns[target] = converted
    return columns


def _factor(unit: str, target: str, name: str, where: str) -> float:
    """What one `unit`, as the file or the mapping states it, is in SI; raises RecordingError naming file and column."""
    try:
        return factor(unit, target)
    except ConfigError as cause:
        raise RecordingError(f"{where}: column {name!r}: {cause}") from cause


def in_stated_units(columns: Columns, table: Table, sources: dict[str, Source], where: str) -> Columns:
    """Return `columns` with those under our own names, for which the file states a unit in the row below its header, in SI."""
    made = dict(columns)
    for name, unit in table.units.items():
        values = columns.get(name)
        if name in TARGETS and name not in sources and isinstance(values, np.ndarray):
            made[name] = _factor(unit, name, name, where) * values
    return made
