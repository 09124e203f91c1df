"""Read small YAML files that come from outside: size limit, no aliases, no duplicate keys, no executable tags."""

import re
from collections.abc import Hashable
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml

from nnhydro.errors import NnhydroError

MAX_BYTES = 300_000  # an arm or a recipe is a page; what is larger is another file taken for it
STANDARD = "tag:yaml.org,2002:"  # what !! stands for
PLAIN_TAGS = ("!", "!!str", "!!int", "!!float", "!!bool", "!!null", "!!map", "!!seq")
WHOLE, DECIMALS = re.compile(r"[-+]?\d+"), re.compile(r"\d+(?:[eE][-+]?\d+)?")  # before and after a decimal comma
DEEPEST, LONGEST = 30, 10_000  # lists within lists; characters of one value
TOO_DEEP = f"lists and mappings are nested more than {DEEPEST} deep: is this the right file?"
_Fast: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # libyaml's, ten times as fast, where PyYAML was built with it


def _require_points(node: Any) -> None:
    """Raise YAMLError for {mass_kg: 4,2}: YAML takes the digits after a decimal comma for a key without a value."""
    for (_, whole), (key, nothing) in pairwise(node.value):
        if nothing.value == "" and isinstance(whole.value, str) and WHOLE.fullmatch(whole.value) and DECIMALS.fullmatch(str(key.value)):
            raise yaml.YAMLError(f"line {key.start_mark.line + 1}: {whole.value},{key.value} has a decimal comma: "
                                 f"write {whole.value}.{key.value}")


class _StrictLoader(_Fast):  # type: ignore[misc]
    """SafeLoader without silently overwritten keys and without numbers to the base of sixty."""

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Hashable, Any]:
        """Return a mapping; raises YAMLError for a key that is no word or stands twice."""
        seen: set[str] = set()
        _require_points(node)
        for key, _ in node.value:
            line = key.start_mark.line + 1
            if not isinstance(key.value, str):
                raise yaml.YAMLError(f"line {line}: a list or mapping stands where a key is expected: write 'key: value'")
            if key.value in seen:
                raise yaml.YAMLError(f"line {line}: the key {key.value!r} appears twice: remove one")
            seen.add(key.value)
        made: dict[Hashable, Any] = super().construct_mapping(node, deep)
        return made

    def plain_number(self, node: Any) -> Any:
        """Return the number; 1:30, which YAML 1.1 takes for 90, is refused: it is not a number in SI units."""
        if ":" in node.value:
            raise yaml.YAMLError(f"line {node.start_mark.line + 1}: {node.value[:40]!r} would be read to the base of sixty: write a plain "
                                 "number, or put a text in quotation marks")
        return self.construct_yaml_int(node) if node.tag.endswith("int") else self.construct_yaml_float(node)


for kind in ("int", "float"):
    _StrictLoader.add_constructor(f"tag:yaml.org,2002:{kind}", _StrictLoader.plain_number)


def _require_small(text: str) -> None:
    """Raise YAMLError at an alias (a few can fill the memory), a tag that asks for an object, deep nesting or a huge value.

    Nothing is made of the text before.
    """
    depth = 0
    for event in yaml.parse(text, _Fast):
        line = event.start_mark.line + 1 if event.start_mark else 0
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if isinstance(event, yaml.AliasEvent):
            raise yaml.YAMLError(f"line {line}: aliases (*name) are not accepted: write the value out")
        tag = (getattr(event, "tag", None) or "").replace(STANDARD, "!!")
        if tag and tag not in PLAIN_TAGS:
            raise yaml.YAMLError(f"line {line}: the tag {tag[:60]!r} is not accepted: leave it out and write the plain value")
        if depth > DEEPEST:
            raise yaml.YAMLError(f"line {line}: {TOO_DEEP}")
        if isinstance(event, yaml.ScalarEvent) and len(event.value) > LONGEST:
            raise yaml.YAMLError(f"line {line}: a value of {len(event.value)} characters: is this the right file?")


def _complaint(cause: Exception) -> str:
    """The parser's complaint on one line, its place first, without its own picture of it."""
    mark = cause.problem_mark or cause.context_mark if isinstance(cause, yaml.MarkedYAMLError) else None
    if mark is None or not isinstance(cause, yaml.MarkedYAMLError):
        return " ".join(str(cause).split())[:300]
    problem = " ".join(str(cause.problem or cause.context).split())[:200]
    if "nesting" in problem:  # PyYAML 6.0.4 and later counts, too
        return f"line {mark.line + 1}: {TOO_DEEP}"
    return f"line {mark.line + 1}: {problem}: indent with spaces, and put texts that hold brackets, colons or commas in quotes"


def read_yaml(path: Path, error: type[NnhydroError]) -> dict[str, Any]:
    """Return the mapping in `path`; raise `error` with one line if it is missing, too large, not YAML or not a mapping."""
    try:
        if path.exists() and not path.is_file():
            raise error(f"{path}: is not a regular file: give a YAML file")
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise error(f"{path}: {size} bytes are too many for a settings file (limit {MAX_BYTES}): is this the right file?")
        text = path.read_text(encoding="utf-8-sig")
        _require_small(text)
        document = yaml.load(text, _StrictLoader)
    except OSError as cause:
        raise error(f"{path}: cannot be read ({cause.strerror or cause}): check the path and its permissions") from cause
    except UnicodeDecodeError as cause:
        raise error(f"{path}: is not UTF-8 text (byte {cause.start}): save it as UTF-8") from cause
    except (yaml.YAMLError, RecursionError, ValueError, OverflowError, TypeError) as cause:
        raise error(f"{path}: is not valid YAML: {_complaint(cause)}") from cause
    if not isinstance(document, dict):
        found = "nothing" if document is None else f"a {type(document).__name__}"
        raise error(f"{path}: holds {found} instead of 'key: value' lines: is this the right file?")
    strange = next((key for key in document if not isinstance(key, str)), None)
    if strange is not None:
        raise error(f"{path}: the key {strange!r} is not a word: write 'key: value' lines")
    return document
