"""Turn pydantic's list of complaints into one line that names the file, the key, what is wrong and what to do."""

import re
from difflib import get_close_matches
from math import pi
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, ValidationInfo, field_validator

from nnhydro.errors import NnhydroError, count_text

PYDANTIC = "Input should"  # how its complaints begin
WISHES = {  # by pydantic's name of a complaint: what must hold
    **dict.fromkeys(("dict_type", "mapping_type", "model_type", "model_attributes_type"), "be a mapping (key: value)"),
    **dict.fromkeys(("tuple_type", "list_type"), "be a list"), "too_short": "have at least {min_length}, not {actual_length}",
    "too_long": "have at most {max_length}, not {actual_length}", "string_type": "be a text",
    "string_too_short": "have at least {min_length} characters", "string_too_long": "have at most {max_length} characters",
    **dict.fromkeys(("float_type", "float_parsing"), "be a number"), "finite_number": "be a finite number",
    **dict.fromkeys(("int_type", "int_parsing", "int_from_float"), "be a whole number"),
    **dict.fromkeys(("bool_type", "bool_parsing"), "be true or false"), "greater_than": "be greater than {gt}",
    "greater_than_equal": "be at least {ge}", "less_than": "be less than {lt}", "less_than_equal": "be at most {le}",
    "literal_error": "be {expected}", "invalid_key": "be a word: 'key: value'",
}
FOREIGN_UNITS = (  # ending of a key, unit that a number beyond the bound may be in, what it is in the key's own
    ("_m2_s", "mm2/s", 1e-6), ("_m", "mm", 1e-3), ("_rad", "degrees", pi / 180), ("efficiency", "per cent", 0.01),
    ("known_to", "per cent", 0.01))


class Settings(BaseModel):
    """A frozen settings model: unknown keys, NaN and infinity are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _no_truth_for_a_number(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuse true and false where the field takes none: they would count as 1 and 0."""
        kind = str(cls.model_fields[info.field_name or ""].annotation)
        if isinstance(value, bool) and "bool" not in kind and "Any" not in kind:
            raise ValueError(f"is {str(value).lower()}, not a number or text: write its value (YAML takes yes, no, on, off for them)")
        return value

    @classmethod
    def keys_of_others(cls, document: dict[str, Any]) -> frozenset[str]:
        """Return keys that are known but not meant for what `document` describes: none is proposed for an unknown one."""
        return frozenset()


M = TypeVar("M", bound=Settings)  # the PEP 695 form needs Python 3.12


def _key(location: tuple[int | str, ...]) -> str:
    text = ""
    for part in location:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text


def _child(node: dict[str, Any], part: int | str) -> Any:
    """Schema of the item or key `part` of `node`, None where it has none."""
    if isinstance(part, int):
        return node.get("items")
    return node.get("properties", {}).get(part, node.get("additionalProperties"))


def _known_keys(model: type[BaseModel], location: tuple[int | str, ...]) -> list[str]:
    """Keys that the sub-model at `location[:-1]` accepts, for 'did you mean'."""
    schema: dict[str, Any] = model.model_json_schema()
    definitions: dict[str, Any] = schema.get("$defs", {})

    def options(node: dict[str, Any]) -> list[dict[str, Any]]:
        """Return the schemas that `node` stands for, references and alternatives resolved."""
        if "$ref" in node:
            node = definitions[node["$ref"].rsplit("/", 1)[-1]]
        return [resolved for choice in node["anyOf"] for resolved in options(choice)] if "anyOf" in node else [node]

    nodes = options(schema)
    for part in location[:-1]:
        step = [child for node in nodes if isinstance(child := _child(node, part), dict)]
        nodes = [resolved for node in step for resolved in options(node)] or nodes  # what is no key is pydantic's name of an alternative
    return [key for node in nodes for key in node.get("properties", {})]


def _path(location: tuple[int | str, ...], document: Any) -> tuple[int | str, ...]:
    """The keys of `location` that stand in `document`; the rest are pydantic's names of alternatives."""
    found: list[int | str] = []
    node = document
    for part in location:
        inside = isinstance(node, list | tuple) and isinstance(part, int) and part < len(node)
        if inside or (isinstance(node, dict) and part in node):
            node = node[part]
            found.append(part)
    return tuple(found)


def _complaints(cause: ValidationError, document: dict[str, Any]) -> list[tuple[tuple[int | str, ...], dict[str, Any]]]:
    """The complaints with their places in `document`, one a place: an unknown key first; of alternatives the one that came closest."""
    every: list[dict[str, Any]] = [dict(error) for error in cause.errors(include_url=False)]
    # a list with wrong entries is also called too short, for these do not count
    every = [e for e in every if not (e["type"] == "too_short" and any(o["loc"][:len(e["loc"])] == e["loc"] != o["loc"] for o in every))]
    found: dict[tuple[int | str, ...], dict[str, Any]] = {}
    for error in every:
        there = error["loc"][:-1] if error["type"] == "missing" else error["loc"]
        path = (*_path(there, document), *error["loc"][len(there):])
        tagged = len(path) < len(error["loc"])
        if path not in found or (tagged and found[path]["type"].endswith(("_type", "_parsing")) and not error["type"].endswith("_type")):
            found[path] = error
    for path in list(found):  # a list that is one of several alternatives: its wrong entry says more
        if found[path]["type"].endswith("_type") and any(path == other[:len(path)] != other for other in found):
            del found[path]
    return sorted(found.items(), key=lambda item: item[1]["type"] != "extra_forbidden")


def one_line(where: str, cause: ValidationError, model: type[Settings], document: dict[str, Any]) -> str:
    """Return the first complaint of `cause` about `document` as one line that starts with `where`."""
    complaints = _complaints(cause, document)
    path, first = complaints[0]
    key = _key(path)
    more = f" (and {len(complaints) - 1} more to mend)" if len(complaints) > 1 else ""
    if first["type"] == "extra_forbidden":
        known = [name for name in _known_keys(model, first["loc"]) if name not in model.keys_of_others(document)]
        close = get_close_matches(str(first["loc"][-1]), known, n=1)
        hint = f"did you mean {close[0]!r}?" if close else "remove it; the README lists the keys"
        return f"{where}: unknown key {key!r}: {hint}{more}"
    if first["type"] == "missing":
        return f"{where}: key {key!r} is missing: add it{more}"
    place, value = f"{where}: {key}" if key else where, first["input"]
    if first["type"] == "value_error":
        got = f", got {_short(value)}" if isinstance(value, int | float | str) and not isinstance(value, bool) else ""
        return f"{place}: {str(first['msg']).removeprefix('Value error, ')}{got}{more}"
    got = "" if first["type"] in ("too_short", "too_long") else f", got {_short(value)}"
    return f"{place}: {_wish(first)}{got}: {_remedy(path, first)}{more}"


def _wish(error: dict[str, Any]) -> str:
    """What must hold, in words."""
    kind, given = str(error["type"]), error.get("ctx", {})
    if kind in WISHES:
        counted = ("min_length", "max_length") if kind.startswith("too") else ()
        numbers = {name: count_text(int(value), "entry") if name in counted else f"{value:.12g}" for name, value in given.items()
                   if isinstance(value, int | float)}
        return "must " + WISHES[kind].format(**{**given, **numbers})
    return "must " + str(error["msg"]).removeprefix(PYDANTIC).strip().split(", unable")[0]


def _remedy(path: tuple[int | str, ...], error: dict[str, Any]) -> str:
    """What to do: a number beyond its bound may stand in another unit, a text that is no number may hold a decimal comma."""
    value, given = error["input"], error.get("ctx", {})
    key = next((part for part in reversed(path) if isinstance(part, str)), "")
    bound = given.get("le", given.get("lt"))
    if bound is not None and isinstance(value, int | float):
        for ending, unit, factor in FOREIGN_UNITS:
            if key.endswith(ending) and abs(value) * factor <= bound:
                return f"probably in {unit}: write {value * factor:.6g}"
    if error["type"] == "float_parsing" and isinstance(value, str) and re.fullmatch(r"\s*[-+]?\d+,\d+\s*", value):
        return f"write {value.strip().replace(',', '.')}"
    close = get_close_matches(value, re.findall(r"'([^']+)'", str(given.get("expected"))), n=1) if isinstance(value, str) else []
    if error["type"] == "literal_error" and close:
        return f"did you mean {close[0]!r}?"
    if error["type"] == "tuple_type" and isinstance(value, int | float | str) and len(str(value)) <= 40:
        return f"write [{value}]"
    return "correct it"


def _short(value: Any) -> str:
    if value is None or isinstance(value, dict | list | tuple):
        return "nothing" if value is None else "a mapping" if isinstance(value, dict) else "a list"
    text = hex(value) if isinstance(value, int) and abs(value) > 10**18 else repr(value)  # decimal text of huge integers is refused
    return text if len(text) <= 60 else f"{text[:57]}..."


def validate(model: type[M], document: dict[str, Any], where: str, error: type[NnhydroError]) -> M:
    """Return `document` as a `model`; raise `error` with one line that starts with `where`."""
    try:
        return model.model_validate(document)
    except ValidationError as cause:
        raise error(one_line(where, cause, model, document)) from cause
