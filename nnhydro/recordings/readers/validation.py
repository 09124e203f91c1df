"""Turn pydantic's list of complaints into one line that names the file, the key, what is wrong and what to do."""

from difflib import get_close_matches
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, ValidationInfo, field_validator

from nnhydro.errors import NnhydroError

PYDANTIC = "Input should"  # how its own complaints begin; ours say the remedy themselves
M = TypeVar("M", bound=BaseModel)  # the PEP 695 form needs Python 3.12


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
        nodes = [resolved for node in step for resolved in options(node)]
    return [key for node in nodes for key in node.get("properties", {})]


def one_line(where: str, cause: ValidationError, model: type[BaseModel]) -> str:
    """Return the first complaint of `cause` as one line that starts with `where`."""
    errors = cause.errors(include_url=False)
    first = next((e for e in errors if e["type"] == "extra_forbidden"), errors[0])
    key = _key(first["loc"])
    more = f" (and {len(errors) - 1} more to mend)" if len(errors) > 1 else ""
    if first["type"] == "extra_forbidden":
        close = get_close_matches(str(first["loc"][-1]), _known_keys(model, first["loc"]), n=1)
        hint = f"did you mean {close[0]!r}?" if close else "remove it; the README lists the keys"
        return f"{where}: unknown key {key!r}: {hint}{more}"
    if first["type"] == "missing":
        return f"{where}: key {key!r} is missing: add it{more}"
    said, value = str(first["msg"]), first["input"]
    got = f", got {_short(value)}" if isinstance(value, int | float | str) and not isinstance(value, bool) else ""
    if said.startswith(PYDANTIC):
        return f"{where}: {key or 'the file'}: must{said.removeprefix(PYDANTIC).split(', unable')[0]}{got}: correct it{more}"
    return f"{where}: {key or 'the file'}: {said.removeprefix('Value error, ')}{got}{more}"


def _short(value: float | str) -> str:
    text = hex(value) if isinstance(value, int) and abs(value) > 10**18 else repr(value)  # decimal text of huge integers is refused
    return text if len(text) <= 60 else f"{text[:57]}..."


def validate(model: type[M], document: dict[str, Any], where: str, error: type[NnhydroError]) -> M:
    """Return `document` as a `model`; raise `error` with one line that starts with `where`."""
    try:
        return model.model_validate(document)
    except ValidationError as cause:
        raise error(one_line(where, cause, model)) from cause
