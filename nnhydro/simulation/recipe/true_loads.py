"""The terms of a recipe's truth: every load term that physics declares, sized for the arm and checked before anything is simulated."""

from collections.abc import Mapping
from math import isfinite
from typing import Any

import torch

from nnhydro.errors import ConfigError, NnhydroError, require
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import FORMER, LoadTerm, term_kinds
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.runtime.registry import choices

# what a term given options of the wrong type or size may raise when it is made or tried out
UNUSABLE = (TypeError, ValueError, RuntimeError, LookupError, AttributeError, ArithmeticError)


def _kind(name: str, given: Any, where: str) -> type[LoadTerm]:
    """The class of a load term by its name or `kind`; raises ConfigError for an unknown one."""
    kinds = term_kinds()
    kind = given.get("kind", name) if isinstance(given, dict) else name
    kind = FORMER.get(kind, kind) if isinstance(kind, str) else kind
    if not isinstance(kind, str) or kind not in kinds:
        raise ConfigError(f"{where}: {kind!r:.80} is not a load term: {choices(str(kind), kinds)} (a name of your own needs 'kind:' "
                          "beside its parameters)")
    return kinds[kind]


def _by_word(cls: type[LoadTerm], given: Any, arm: Arm, where: str) -> LoadTerm:
    """The term as arm.yaml states it ("arm") or with every parameter where fits begin ("start")."""
    made = getattr(cls, "of_arm", None)
    if given == "arm" and made is not None:
        term = made(arm)
        assert isinstance(term, LoadTerm)
        return term
    if given == "start":
        return cls.at_start(arm)
    words = "'arm', 'start'" if made is not None else "'start'"
    names = ', '.join(declaration.name for declaration in cls.parameters())
    raise ConfigError(f"{where}: {given!r:.80} says nothing: give {words} or a mapping of {names}")


def _numbers(value: Any, wanted: int, bounds: tuple[float, float], where: str) -> tuple[float, ...]:
    """`value` as `wanted` numbers within `bounds`; one number serves all."""
    values = value if isinstance(value, list | tuple) else [value]
    for number in values:
        good = isinstance(number, int | float) and not isinstance(number, bool) and abs(number) < 1e300 and isfinite(number)
        require(good, f"{where}: {number!r:.80} is not a finite number")
        require(bounds[0] <= number <= bounds[1], f"{where}: {number:g} is outside what physics allows, {bounds[0]:g} to {bounds[1]:g}")
    if not isinstance(value, list | tuple):
        values = [value] * wanted
    require(len(values) == wanted, f"{where}: {len(values)} number(s) for this arm: give {wanted}")
    return tuple(float(number) for number in values)


def _from_mapping(cls: type[LoadTerm], given: Mapping[str, Any], arm: Arm, where: str) -> LoadTerm:
    """A load term with the parameters and options of a recipe; raises ConfigError for unknown keys and values."""
    given = cls.present(given)
    parameters = {declaration.name: declaration for declaration in cls.parameters()}
    options = {declaration.name for declaration in cls.options()}
    for key in given:
        if key != "kind" and key not in parameters and key not in options:
            raise ConfigError(f"{where}: unknown key {key!r:.80} of {cls.kind}: {choices(str(key), [*parameters, *sorted(options)])}")
    chosen = {key: value for key, value in given.items() if key in options}
    try:
        start = cls.at_start(arm, **chosen)
        values = {}
        for name, field in parameters.items():
            if name not in given:
                if field.default == ():
                    continue
                raise ConfigError(f"{where}: {name} is missing: {field.metadata['meaning']} [{field.metadata['unit']}]; "
                                  f"give {len(getattr(start, name))} number(s)")
            values[name] = _numbers(given[name], len(getattr(start, name)), field.metadata["bounds"], f"{where}.{name}")
        return cls(**values, **chosen)
    except NnhydroError as cause:
        raise cause if str(cause).startswith(where) else ConfigError(f"{where}: {cause}") from cause
    except UNUSABLE as cause:
        raise ConfigError(f"{where}: cannot be made: {cause}") from cause


def _try_out(term: LoadTerm, arm: Arm, where: str) -> None:
    """Raise ConfigError unless `term` gives finite torques for a small motion of `arm`."""
    n = arm.n_links
    t = torch.linspace(0.0, 1.0, 20, dtype=torch.float64)
    swing = 0.3 * torch.stack([torch.sin(3 * t), 3 * torch.cos(3 * t), -9 * torch.sin(3 * t)])[..., None].expand(3, 20, n)
    motion = Motion(t, swing[0], swing[1], swing[2], 0.2 * t, torch.full_like(t, 0.2))
    try:
        torque = term.torque(Flow(arm, motion))
        good = torque.shape == (20, n) and bool(torch.isfinite(torque).all())
    except NnhydroError as cause:
        raise ConfigError(f"{where}: {cause}") from cause
    except UNUSABLE as cause:
        raise ConfigError(f"{where}: cannot be evaluated: {' '.join(str(cause).split())[:200]}") from cause
    require(good, f"{where}: gives no finite torque for this arm: check its values")


def true_loads(given: Mapping[str, Any], arm: Arm, where: str) -> Loads:
    """Return the sum of the terms `given` by a recipe; raise ConfigError naming `where`, the term and the key.

    A term is `KIND: {parameter: [..], option: ..}`, `KIND: start`, or `NAME: {kind: KIND, ..}`. `rigid_body` is that of `arm` where it
    is not given.
    """
    terms = {}
    for name, value in {"rigid_body": "arm", **given}.items():
        at = f"{where}: terms.{name}"
        cls = _kind(name, value, at)
        terms[name] = _from_mapping(cls, value, arm, at) if isinstance(value, dict) else _by_word(cls, value, arm, at)
        _try_out(terms[name], arm, at)
    return Loads(terms)
