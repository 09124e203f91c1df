"""Read small YAML files that come from outside: size limit, no aliases, no duplicate keys, no executable tags."""

from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from nnhydro.errors import NnhydroError

MAX_BYTES = 1_000_000  # an arm or a recipe is a page; what is larger is another file taken for it


class _StrictLoader(yaml.SafeLoader):
    """SafeLoader without aliases (a few bytes of them can fill the memory) and without silently overwritten keys."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.events.AliasEvent):
            line = self.peek_event().start_mark.line + 1  # type: ignore[no-untyped-call]
            raise yaml.YAMLError(f"line {line}: aliases (*name) are not accepted: write the value out")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Hashable, Any]:
        seen: set[str] = set()
        for key, _ in node.value:
            line = key.start_mark.line + 1
            if not isinstance(key.value, str):
                raise yaml.YAMLError(f"line {line}: a list or mapping stands where a key is expected: write 'key: value'")
            if key.value in seen:
                raise yaml.YAMLError(f"line {line}: the key {key.value!r} appears twice: remove one")
            seen.add(key.value)
        return super().construct_mapping(node, deep)


def read_yaml(path: Path, error: type[NnhydroError]) -> dict[str, Any]:
    """Return the mapping in `path`; raise `error` with one line if it is missing, too large, not YAML or not a mapping."""
    try:
        if path.exists() and not path.is_file():
            raise error(f"{path}: is not a regular file: give a YAML file")
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise error(f"{path}: {size} bytes are too many for a settings file (limit {MAX_BYTES}): is this the right file?")
        document = yaml.load(path.read_text(encoding="utf-8-sig"), _StrictLoader)
    except OSError as cause:
        raise error(f"{path}: cannot be read ({cause.strerror or cause}): check the path and its permissions") from cause
    except UnicodeDecodeError as cause:
        raise error(f"{path}: is not UTF-8 text (byte {cause.start}): save it as UTF-8") from cause
    except (yaml.YAMLError, RecursionError, ValueError, OverflowError, TypeError) as cause:
        raise error(f"{path}: is not valid YAML: {' '.join(str(cause).split())[:300]}") from cause
    if not isinstance(document, dict):
        found = "nothing" if document is None else f"a {type(document).__name__}"
        raise error(f"{path}: holds {found} instead of 'key: value' lines: is this the right file?")
    strange = next((key for key in document if not isinstance(key, str)), None)
    if strange is not None:
        raise error(f"{path}: the key {strange!r} is no word: write 'key: value' lines")
    return document
